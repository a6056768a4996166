"""Frames are sent as recorded, read once, and never on the event loop."""

import asyncio
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Literal

import cv2
import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.recordings.camera.images import EncodedImage
from cocalib.web.frames import FrameStore
from cocalib.web.messages.outgoing import FrameHeader


def decoded(data: bytes) -> np.ndarray:
    return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)


class Images:
    """A recording's images, with a count of how often and where each was read."""

    def __init__(self, width_px: int, height_px: int, suffix: str = ".jpg") -> None:
        ramp = np.tile(np.linspace(0, 255, width_px).astype(np.uint8)[None, :, None], (height_px, 1, 3))
        self.data = cv2.imencode(suffix, ramp)[1].tobytes()
        self.size = (width_px, height_px)
        self.format: Literal["jpeg", "png"] = "jpeg" if suffix == ".jpg" else "png"
        self.read: list[int] = []
        self.threads: set[int] = set()
        self.may_read = threading.Event()
        self.may_read.set()

    def image_bytes(self, index: int) -> EncodedImage:
        assert self.may_read.wait(10)
        self.read.append(index)
        self.threads.add(threading.get_ident())
        if index == 7:
            raise ValueError("frame 7 is broken")
        return EncodedImage(self.data, self.format, *self.size)


@pytest.fixture
def store() -> Iterator[Callable[..., FrameStore]]:
    with ThreadPoolExecutor(2) as pool:
        yield lambda images, **options: FrameStore(images, 10, pool, **options)


def test_recorded_bytes_pass_through_untouched(store):
    images = Images(64, 48)
    frame = asyncio.run(store(images).get(3))
    assert frame.data is images.data
    assert frame.header == FrameHeader(3, 0, 64, 48, 1.0, "jpeg")


def test_a_large_frame_is_halved_for_playing_and_a_small_one_is_not(store):
    large, small = Images(2000, 1500), Images(640, 480)
    halved = asyncio.run(store(large).get(0, "half"))
    assert decoded(halved.data).shape[:2] == (750, 1000)
    assert halved.header == FrameHeader(0, 0, 2000, 1500, 0.5, "jpeg")
    assert asyncio.run(store(small).get(0, "half")).data is small.data


@pytest.mark.parametrize(
    ("size", "suffix"), [((2000, 1500), ".jpg"), ((640, 480), ".png"), ((5000, 40), ".jpg"), ((100, 80), ".png")]
)
def test_a_thumbnail_is_a_small_jpeg(store, size, suffix):
    thumbnail = asyncio.run(store(Images(*size, suffix=suffix)).get(0, "thumbnail"))
    assert thumbnail.header.format == "jpeg"
    assert decoded(thumbnail.data).shape[1] == min(480, size[0])


def test_concurrent_requests_share_one_read_off_the_event_loop(store):
    images = Images(64, 48)

    async def ask() -> None:
        frames_of = store(images)
        frames = await asyncio.gather(*(frames_of.get(5) for _ in range(20)))
        assert all(frame is frames[0] for frame in frames)
        assert (await frames_of.get(5)) is frames[0]

    asyncio.run(ask())
    assert images.read == [5]
    assert threading.get_ident() not in images.threads


def test_the_loop_runs_on_while_a_frame_is_read_and_a_client_that_leaves_does_not_cancel_it_for_others(store):
    images = Images(64, 48)
    images.may_read.clear()

    async def ask() -> None:
        frames_of = store(images)
        leaver, stayer = asyncio.ensure_future(frames_of.get(1)), asyncio.ensure_future(frames_of.get(1))
        await asyncio.sleep(0)
        assert not stayer.done()
        leaver.cancel()
        images.may_read.set()
        assert (await stayer).header.index == 1

    asyncio.run(ask())
    assert images.read == [1]


def test_playing_a_long_recording_keeps_few_of_its_frames(store):
    images = Images(64, 48)
    images.data += bytes(3 << 20)

    async def play() -> None:
        frames_of = store(images)
        for index in (0, 1, 2, 3, 4, 5, 6, 8, 9):
            await frames_of.get(index)
        assert 4 * len(images.data) <= frames_of.kept_bytes <= 20 << 20

    asyncio.run(play())


def test_the_memory_stays_within_the_budget_and_drops_the_oldest(store):
    images = Images(64, 48)
    budget = 3 * len(images.data)

    async def ask() -> None:
        frames_of = store(images, budget_bytes=budget)
        for index in (0, 1, 2, 0, 3):
            await frames_of.get(index)
            assert frames_of.kept_bytes <= budget
        await frames_of.get(0)
        assert images.read == [0, 1, 2, 3], "frame 0 was used again and stayed"
        await frames_of.get(1)
        assert images.read == [0, 1, 2, 3, 1]

    asyncio.run(ask())


@pytest.mark.parametrize(
    ("start", "step", "expected"), [(4, 1, [4, 5, 6]), (4, -1, [2, 3, 4]), (9, 1, [9]), (4, 0, [4])]
)
def test_prefetching_goes_in_the_direction_of_play_and_stops_at_the_end(store, start, step, expected):
    images = Images(64, 48)

    async def ask() -> None:
        frames_of = store(images)
        await frames_of.get(start)
        frames_of.prefetch(start, "full", step, ahead=2)
        for index in expected:
            await frames_of.get(index)

    asyncio.run(ask())
    assert sorted(images.read) == expected


def test_a_frame_that_is_broken_or_none_is_an_error_only_when_it_is_requested(store):
    async def ask() -> None:
        frames_of = store(Images(64, 48))
        frames_of.prefetch(6, "full", 1, ahead=1)
        with pytest.raises(ValueError, match="frame 7"):
            await frames_of.get(7)
        for index in (-1, 10):
            with pytest.raises(IndexError):
                await frames_of.get(index)
        assert (await frames_of.get(6)).header.index == 6

    asyncio.run(ask())


def test_a_closed_store_leaves_nothing_pending_and_starts_nothing(store):
    images = Images(64, 48)
    images.may_read.clear()

    async def ask() -> None:
        frames_of = store(images)
        frames_of.prefetch(1, "full", 1, ahead=3)
        await asyncio.sleep(0)
        images.may_read.set()
        await frames_of.close()
        frames_of.prefetch(5, "full", 1, ahead=2)
        with pytest.raises(IndexError, match="stopping"):
            await frames_of.get(5)
        assert asyncio.all_tasks() == {asyncio.current_task()}

    asyncio.run(ask())
    assert 6 not in images.read


def test_a_rectified_frame_is_made_with_the_intrinsics_of_the_moment_and_not_kept_for_others(store):
    matrix = np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]])
    lenses = [Camera("plumb_bob", 640, 480, matrix, np.array([k1, 0, 0, 0])) for k1 in (-0.2, 0.1)]
    cameras = [*lenses, None, Camera("pinhole", 64, 48, matrix)]

    async def run() -> None:
        frames_of = store(Images(640, 480), camera=lambda: cameras[0])
        first = await frames_of.get(0, "rectified")
        assert (await frames_of.get(0, "rectified")).data is first.data
        assert first.data != (await frames_of.get(0)).data
        cameras.pop(0)
        other = await frames_of.get(0, "rectified")
        assert other.data != first.data
        for words in ("no intrinsics to rectify", "64 x 48 px, and the image has 640 x 480"):
            cameras.pop(0)
            with pytest.raises(InputError, match=words):
                await frames_of.get(0, "rectified")
        assert frames_of.kept_bytes == len((await frames_of.get(0)).data), "what was rectified otherwise is gone"

    asyncio.run(run())
