"""How much the image changes: much where something moves, little where it stands still; not measured while someone plays."""

import asyncio
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from calib_core.measurements import NS_PER_S
from cocalib.web.channel.image_changes import ImageChanges, changes_of, comparison_order
from tests.image_recording import START, ImageRecording


def walker(column_px: int) -> np.ndarray:
    """Draw a person, dark on noise, 1 % of the image."""
    rng = np.random.default_rng(column_px)
    image = rng.normal(140, 3, (360, 640, 3)).clip(0, 255).astype(np.uint8)
    image[150:240, column_px : column_px + 26] = 40
    return image


def compared(recording: ImageRecording, busy: list[bool]) -> list[ImageChanges]:
    """Compare all frames; return what was told."""
    told: list[ImageChanges] = []

    async def run() -> None:
        with ThreadPoolExecutor(1) as executor:
            times = recording.image_times
            await changes_of(recording, times, executor, told.append, lambda: bool(busy) and busy.pop())

    asyncio.run(run())
    return told


def test_a_person_who_walks_changes_the_image_and_one_who_stands_does_not():
    recording, busy = ImageRecording([walker(100), walker(100), walker(100), walker(130), walker(160)]), [True]
    last = compared(recording, busy)[-1]
    assert busy == [], "they are compared only while nobody plays"
    assert last.complete
    assert last.seconds == (0.0, 0.1, 0.2, 0.3)
    still, walking = last.grey_levels[:2], last.grey_levels[2:]
    assert max(still) < 5
    assert min(walking) > 50


def test_the_first_comparisons_span_the_recording_and_none_crosses_a_gap():
    moments = START + (np.concatenate([np.arange(0, 100, 0.1), np.arange(4000, 4100, 0.1)]) * NS_PER_S).astype(np.int64)
    order = comparison_order(moments)
    assert len(order) == len(set(order)) == 300
    assert np.ptp(order[:10]) > 0.8 * len(moments)
    assert 999 not in order  # the last frame before the gap
    assert comparison_order(moments[:1]) == []
