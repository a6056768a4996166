"""Frames are sent as recorded, read once, and never on the event loop."""

import asyncio
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.errors import InputError
from cocalib.web.frames import FrameStore
from cocalib.web.messages import FrameHeader


@dataclass(frozen=True)
class Encoded:
    data: bytes
    format: Literal["jpeg", "png"]
    width_px: int
    height_px: int


class Pictures:
    """A recording's pictures, with a count of how often and where each was read."""

    def __init__(self, width_px: int, height_px: int, suffix: str = ".jpg") -> None:
        ramp = np.tile(np.linspace(0, 255, width_px).astype(np.uint8)[None, :, None], (height_px, 1, 3))
        self.data = cv2.imencode(suffix, ramp)[1].tobytes()
        self.size = (width_px, height_px)
        self.format: Literal["jpeg", "png"] = "jpeg" if suffix == ".jpg" else "png"
        self.read: list[int] = []
        self.threads: set[int] = set()
        self.may_read = threading.Event()
        self.may_read.set()

    def image_bytes(self, index: int) -> Encoded:
        assert self.may_read.wait(10)
        self.read.append(index)
        self.threads.add(threading.get_ident())
        if index == 7:
            raise ValueError("frame 7 is broken")
        return Encoded(self.data, self.format, *self.size)


@pytest.fixture
def executor() -> Iterator[ThreadPoolExecutor]:
    with ThreadPoolExecutor(2) as pool:
        yield pool


def test_recorded_bytes_pass_through_untouched(executor):
    pictures = Pictures(64, 48)
    frame = asyncio.run(FrameStore(pictures, 10, executor).get(3))
    assert frame.data is pictures.data
    assert frame.header == FrameHeader(3, 0, 64, 48, 1.0, "jpeg")


def test_a_large_frame_is_halved_for_playing_and_a_small_one_is_not(executor):
    large, small = Pictures(2000, 1500), Pictures(640, 480)
    halved = asyncio.run(FrameStore(large, 10, executor).get(0, "half"))
    picture = cv2.imdecode(np.frombuffer(halved.data, np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape[:2] == (750, 1000)
    assert halved.header == FrameHeader(0, 0, 2000, 1500, 0.5, "jpeg")
    assert asyncio.run(FrameStore(small, 10, executor).get(0, "half")).data is small.data


@pytest.mark.parametrize(
    ("size", "suffix"), [((2000, 1500), ".jpg"), ((640, 480), ".png"), ((5000, 40), ".jpg"), ((100, 80), ".png")]
)
def test_a_thumbnail_is_a_small_jpeg(executor, size, suffix):
    thumbnail = asyncio.run(FrameStore(Pictures(*size, suffix=suffix), 10, executor).get(0, "thumbnail"))
    picture = cv2.imdecode(np.frombuffer(thumbnail.data, np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    assert thumbnail.header.format == "jpeg"
    assert picture.shape[1] == min(480, size[0])


def test_concurrent_requests_share_one_read_off_the_event_loop(executor):
    pictures = Pictures(64, 48)

    async def ask() -> None:
        store = FrameStore(pictures, 10, executor)
        frames = await asyncio.gather(*(store.get(5) for _ in range(20)))
        assert all(frame is frames[0] for frame in frames)
        assert (await store.get(5)) is frames[0]

    asyncio.run(ask())
    assert pictures.read == [5]
    assert threading.get_ident() not in pictures.threads


def test_the_loop_runs_on_while_a_frame_is_read(executor):
    pictures = Pictures(64, 48)
    pictures.may_read.clear()

    async def ask() -> None:
        waiting = asyncio.ensure_future(FrameStore(pictures, 10, executor).get(1))
        await asyncio.sleep(0)
        assert not waiting.done()
        pictures.may_read.set()
        assert (await waiting).header.index == 1

    asyncio.run(ask())


def test_a_client_that_leaves_early_does_not_cancel_the_frame_for_others(executor):
    pictures = Pictures(64, 48)
    pictures.may_read.clear()

    async def ask() -> None:
        store = FrameStore(pictures, 10, executor)
        leaver, stayer = asyncio.ensure_future(store.get(1)), asyncio.ensure_future(store.get(1))
        await asyncio.sleep(0)
        leaver.cancel()
        pictures.may_read.set()
        assert (await stayer).header.index == 1

    asyncio.run(ask())
    assert pictures.read == [1]


def test_playing_a_long_recording_keeps_few_of_its_frames(executor):
    pictures = Pictures(64, 48)
    pictures.data += bytes(1 << 20)

    async def play() -> None:
        store = FrameStore(pictures, 100, executor)
        for index in range(20, 60):
            await store.get(index)
        assert 4 * len(pictures.data) <= store.kept_bytes <= 20 << 20

    asyncio.run(play())


def test_the_memory_stays_within_the_budget_and_drops_the_oldest(executor):
    pictures = Pictures(64, 48)
    budget = 3 * len(pictures.data)

    async def ask() -> None:
        store = FrameStore(pictures, 10, executor, budget_bytes=budget)
        for index in (0, 1, 2, 0, 3):
            await store.get(index)
            assert store.kept_bytes <= budget
        await store.get(0)
        assert pictures.read == [0, 1, 2, 3], "frame 0 was used again and stayed"
        await store.get(1)
        assert pictures.read == [0, 1, 2, 3, 1]

    asyncio.run(ask())


@pytest.mark.parametrize(
    ("start", "step", "expected"), [(4, 1, [4, 5, 6]), (4, -1, [2, 3, 4]), (9, 1, [9]), (4, 0, [4])]
)
def test_prefetching_goes_in_the_direction_of_play_and_stops_at_the_end(executor, start, step, expected):
    pictures = Pictures(64, 48)

    async def ask() -> None:
        store = FrameStore(pictures, 10, executor)
        await store.get(start)
        store.prefetch(start, "full", step, ahead=2)
        for index in expected:
            await store.get(index)

    asyncio.run(ask())
    assert sorted(pictures.read) == expected


def test_a_broken_frame_is_an_error_only_when_it_is_requested(executor):
    pictures = Pictures(64, 48)

    async def ask() -> None:
        store = FrameStore(pictures, 10, executor)
        store.prefetch(6, "full", 1, ahead=1)
        with pytest.raises(ValueError, match="frame 7"):
            await store.get(7)
        assert (await store.get(6)).header.index == 6

    asyncio.run(ask())


@pytest.mark.parametrize("index", [-1, 10])
def test_there_is_no_frame_outside_the_recording(executor, index):
    with pytest.raises(IndexError):
        asyncio.run(FrameStore(Pictures(64, 48), 10, executor).get(index))


def test_a_closed_store_leaves_nothing_pending_and_starts_nothing(executor):
    pictures = Pictures(64, 48)
    pictures.may_read.clear()

    async def ask() -> None:
        store = FrameStore(pictures, 10, executor)
        store.prefetch(1, "full", 1, ahead=3)
        await asyncio.sleep(0)
        pictures.may_read.set()
        await store.close()
        store.prefetch(5, "full", 1, ahead=2)
        with pytest.raises(IndexError, match="stopping"):
            await store.get(5)
        assert asyncio.all_tasks() == {asyncio.current_task()}

    asyncio.run(ask())
    assert 6 not in pictures.read


def test_a_rectified_frame_is_made_with_the_intrinsics_of_the_moment_and_not_kept_for_others(executor):
    def camera(k1: float) -> Camera:
        matrix = np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]])
        return Camera("plumb_bob", 640, 480, matrix, np.array([k1, 0, 0, 0]))

    cameras: list[Camera | None] = [camera(-0.2), camera(0.1), None]

    async def run() -> None:
        store = FrameStore(Pictures(640, 480), 10, executor, camera=lambda: cameras[0])
        first = await store.get(0, "rectified")
        assert (await store.get(0, "rectified")).data is first.data
        assert first.data != (await store.get(0)).data
        cameras.pop(0)
        other = await store.get(0, "rectified")
        assert other.data != first.data
        cameras.pop(0)
        with pytest.raises(InputError, match="no intrinsics to rectify"):
            await store.get(0, "rectified")
        assert store.kept_bytes == len((await store.get(0)).data), "what was rectified with other intrinsics is gone"

    asyncio.run(run())


def test_intrinsics_of_another_size_rectify_nothing(executor):
    small = Camera("pinhole", 64, 48, np.array([[50.0, 0, 32], [0, 50, 24], [0, 0, 1]]))
    store = FrameStore(Pictures(640, 480), 10, executor, camera=lambda: small)
    with pytest.raises(InputError, match="64 x 48 px, and the picture has 640 x 480"):
        asyncio.run(store.get(0, "rectified"))
