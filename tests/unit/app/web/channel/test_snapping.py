"""A page asks for the apex near a pixel: the answer, the refusals, and what stays as it is."""

import asyncio
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import cv2
import numpy as np
import pytest

from calib_core.errors import InputError
from calib_core.measurements import TimeNs
from calib_core.recordings.camera.images import EncodedImage
from cocalib.web.channel.channel import snapped
from cocalib.web.frames import FrameStore
from cocalib.web.messages.incoming import SnapWanted, parse
from cocalib.web.messages.outgoing import Snapped, encode
from tests.unit.proposing.trihedral import draw_look, noisy_image

_RNG = np.random.default_rng(5)
_LOOK = replace(
    draw_look(_RNG, size_px=(200, 200), width_px=60.0), blur_px=0.6, noise_grey=1.0, jpeg_quality=None, gain=1.0
)
_MOMENTS = np.array([1_000_000_000, 1_100_000_000])


class _OneImage:
    """A recording whose frames all show the same reflector."""

    def image_bytes(self, index: int) -> EncodedImage:
        image = noisy_image(_LOOK, np.full((200, 200), 0.25), np.random.default_rng(index))
        return EncodedImage(cv2.imencode(".png", image)[1].tobytes(), "png", 200, 200)


def _ask(time: int, pixel_px: tuple[float, float]) -> Snapped:
    async def ask() -> Snapped:
        with ThreadPoolExecutor(1) as executor:
            store = FrameStore(_OneImage(), 2, executor)
            return await snapped(SnapWanted(TimeNs(time), pixel_px, "click-1"), _MOMENTS, store, executor)

    return asyncio.run(ask())


def test_the_answer_is_the_apex_with_its_sigma():
    u, v = _LOOK.apex_px + np.array([5.0, -4.0])
    answer = _ask(1_100_000_000, (u, v))
    assert answer.pixel_px == pytest.approx(_LOOK.apex_px, abs=0.5)
    assert answer.sigma_px is not None
    assert f"standard deviation of {answer.sigma_px:.2f} px" in answer.words
    assert answer.id == "click-1"


@pytest.mark.parametrize("pixel_px", [(30.0, 30.0), (1e30, -1e30)])
def test_no_corner_is_an_answer_with_a_reason_and_no_frame_is_refused(pixel_px):
    answer = _ask(1_000_000_000, pixel_px)
    assert (answer.pixel_px, answer.sigma_px) == (None, None)
    assert answer.words.startswith("No corner found: ")
    with pytest.raises(InputError, match="no frame has the stamp 1050000000"):
        _ask(1_050_000_000, pixel_px)


def test_the_message_of_a_page_is_understood_and_answered_by_its_type():
    text = '{"type":"snap_wanted","image_time":{"sec":1,"nanosec":5},"pixel_px":[3.5,4],"id":null,"request":7}'
    incoming = parse(text)
    assert incoming.command == SnapWanted(TimeNs(1_000_000_005), (3.5, 4.0), None)
    assert incoming.request == 7
    near = parse(text.replace('"id":null', '"near":true')).command
    assert near == SnapWanted(TimeNs(1_000_000_005), (3.5, 4.0), None, near=True)
    assert encode(Snapped(None, None, "No corner found.")).startswith('{"type":"snapped","pixel_px":null')
