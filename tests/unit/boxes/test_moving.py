"""What moves before a fixed camera is boxed and followed; a camera that moves itself is refused."""

import numpy as np
import pytest

from calib_core.boxes import changed_boxes
from calib_core.errors import InputError, MessageError
from calib_core.measurements import Box

HEIGHT, WIDTH = 120, 160
START_NS = 1_700_000_000_000_000_000
SCENE = np.random.default_rng(5).integers(60, 200, (HEIGHT // 8, WIDTH // 8, 3)).repeat(8, axis=0).repeat(8, axis=1)


def times(count: int) -> np.ndarray:
    return START_NS + 50_000_000 * np.arange(count)


def walker(index: int, count: int) -> tuple[int, int, int, int]:
    """Return left, top, right and bottom of a thing that crosses the image; the last two are the first pixels outside."""
    left = round((WIDTH - 20) * index / (count - 1))
    return left, 40, left + 12, 80


def scene_image(index: int, count: int, *, gain: float = 1.0, shadow: bool = False) -> np.ndarray:
    rng = np.random.default_rng(index)
    values = SCENE * gain + rng.normal(0, 1.0, SCENE.shape)
    left, top, right, bottom = walker(index, count)
    if shadow:
        values[bottom : bottom + 4, left : right + 30] *= 0.7
    values[top:bottom, left:right] = (40, 60, 250)
    return np.clip(values, 0, 255).astype(np.uint8)


@pytest.mark.parametrize("changes", [pytest.param("steady", marks=pytest.mark.slow), "brightness", "shadow"])
def test_a_thing_that_moves_is_boxed_and_keeps_its_track(changes):
    count = 40

    def image(index: int) -> np.ndarray:
        gain = 1.0 + 0.2 * (index / count) if changes == "brightness" else 1.0
        return scene_image(index, count, gain=gain, shadow=changes == "shadow")

    boxes = changed_boxes(image, times(count))

    assert len(boxes) == count
    assert boxes.image_size_px == (WIDTH, HEIGHT)
    for index, frame in enumerate(boxes):
        left, top, right, bottom = walker(index, count)
        (box,) = frame.boxes
        np.testing.assert_allclose(
            (box.left_px, box.top_px, box.right_px, box.bottom_px),
            (left - 0.5, top - 0.5, right - 0.5, bottom - 0.5),
            atol=2.0,
        )
        assert (box.label, box.track) == ("moving", "1")


@pytest.mark.slow
def test_images_are_reduced_and_boxes_are_in_recorded_pixels():
    count = 10

    def image(index: int) -> np.ndarray:
        return scene_image(index, count).repeat(6, axis=0).repeat(6, axis=1)

    box: Box = changed_boxes(image, times(count)).frames[4].boxes[0]

    left, top, right, bottom = (6 * edge for edge in walker(4, count))
    edges = (box.left_px, box.top_px, box.right_px, box.bottom_px)
    np.testing.assert_allclose(edges, (left - 0.5, top - 0.5, right - 0.5, bottom - 0.5), atol=8.0)


def test_a_long_recording_is_looked_at_in_stretches():
    count, decoded = 6000, []

    def image(index: int) -> np.ndarray:
        decoded.append(index)
        return scene_image(index, count)

    boxes = changed_boxes(image, times(count), most_frames=60)

    assert len(decoded) <= 60 + 25
    steps = np.diff(boxes.times_ns)
    assert len(boxes) == 60
    assert np.count_nonzero(steps == 200_000_000) == 58
    assert boxes.times_ns[-1] >= times(count)[-5]


def test_unreadable_frames_are_skipped():
    count = 20

    def image(index: int) -> np.ndarray:
        if index % 2:
            raise MessageError("damaged")
        return scene_image(index, count)

    assert changed_boxes(image, times(count)).times_ns.tolist() == times(count)[::2].tolist()


def test_a_camera_that_moves_is_refused():
    wide = np.random.default_rng(6).integers(0, 255, (HEIGHT, 20 * WIDTH, 3), dtype=np.uint8)

    with pytest.raises(InputError, match="the camera itself moves"):
        changed_boxes(lambda index: wide[:, 40 * index : 40 * index + WIDTH], times(40))


def test_too_few_frames_are_refused():
    with pytest.raises(InputError, match="3 readable frames; finding movement needs 5"):
        changed_boxes(lambda index: scene_image(index, 3), times(3))


def test_images_in_which_nothing_moves_are_refused():
    still = SCENE.astype(np.uint8)

    with pytest.raises(InputError, match="nothing moves in 10 frames"):
        changed_boxes(lambda _: still, times(10))


@pytest.mark.parametrize("turned_from", [20, 30])
def test_a_camera_that_turns_once_gets_a_background_on_each_side(turned_from):
    count = 50

    def image(index: int) -> np.ndarray:
        return np.roll(scene_image(index, count), 5 if index >= turned_from else 0, axis=1)

    boxes = changed_boxes(image, times(count))

    per_frame = np.array([len(frame.boxes) for frame in boxes])
    assert np.median(per_frame) == 1
    assert (per_frame == 1).mean() > 0.9
    assert len(boxes.notes) == 2
    (box,) = boxes.frames[45].boxes
    assert box.left_px == pytest.approx(walker(45, count)[0] + 4.5, abs=3.0)
