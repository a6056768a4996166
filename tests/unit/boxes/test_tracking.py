"""A box is followed through pictures of a textured rectangle that moves, grows, is hidden and leaves."""

from collections.abc import Iterator

import cv2
import numpy as np
import pytest

from calib_core.boxes.tracking import LostBox, TrackedBox, follow_box

SIZE = (320, 240)


def textured(shape: tuple[int, int], seed: int, contrast: float = 55.0) -> np.ndarray:
    """Smooth noise around middle grey."""
    noise = np.random.default_rng(seed).normal(size=shape).astype(np.float32)
    smooth = cv2.GaussianBlur(noise, (0, 0), 2.5)
    return 128 + contrast * smooth / smooth.std()


BACKGROUND = textured(SIZE[::-1], seed=1, contrast=18)
OBJECT = textured((64, 40), seed=2)
PILLAR = textured((240, 60), seed=3, contrast=25)


def picture(
    centre: tuple[float, float], scale: float = 1.0, *, pillar_at: int | None = None, seed: int = 0
) -> np.ndarray:
    """The object with its centre at (x, y) on the background, to a fraction of a pixel, with noise."""
    drawn = BACKGROUND.copy()
    matrix = np.array([[scale, 0, centre[0] - scale * 19.5], [0, scale, centre[1] - scale * 31.5]])
    moved = cv2.warpAffine(OBJECT, matrix, SIZE, flags=cv2.INTER_AREA)
    there = cv2.warpAffine(np.ones_like(OBJECT), matrix, SIZE)
    drawn = (1 - there) * drawn + there * moved
    if pillar_at is not None:
        drawn[:, pillar_at : pillar_at + 60] = PILLAR
    noisy = drawn + np.random.default_rng(seed).normal(0, 3, drawn.shape)
    return noisy.clip(0, 255).astype(np.uint8)


def edges(centre: tuple[float, float], scale: float = 1.0) -> tuple[float, float, float, float]:
    return centre[0] - 20 * scale, centre[1] - 32 * scale, centre[0] + 20 * scale, centre[1] + 32 * scale


def followed(pictures: Iterator[np.ndarray], start: tuple[float, float, float, float]) -> list[TrackedBox | LostBox]:
    return list(follow_box(pictures, start))


def test_a_box_follows_its_object_to_a_pixel():
    way = [(60 + 4.3 * step, 100 + 20 * np.sin(step / 6)) for step in range(40)]
    found = followed((picture(at, seed=step) for step, at in enumerate(way)), edges(way[0]))
    assert len(found) == 39
    for box, at in zip(found, way[1:], strict=True):
        assert isinstance(box, TrackedBox)
        assert box.edges_px == pytest.approx(edges(at), abs=2.0)
        assert 0.6 < box.confidence <= 1.0


def test_a_box_grows_with_its_object():
    scales = [1.015**step for step in range(45)]
    way = [(150 + step, 120.0) for step in range(45)]
    found = followed((picture(at, scale) for at, scale in zip(way, scales, strict=True)), edges(way[0]))
    last = found[-1]
    assert len(found) == 44
    assert isinstance(last, TrackedBox)
    left, top, right, bottom = last.edges_px
    assert (right - left) * (bottom - top) == pytest.approx(40 * 64 * scales[-1] ** 2, rel=0.15)
    assert ((left + right) / 2, (top + bottom) / 2) == pytest.approx(way[-1], abs=4)


def test_a_box_is_lost_behind_a_pillar_and_says_so():
    way = [(60 + 3.0 * step, 120.0) for step in range(60)]
    found = followed((picture(at, pillar_at=150, seed=step) for step, at in enumerate(way)), edges(way[0]))
    assert isinstance(found[-1], LostBox)
    assert "no longer looks like" in found[-1].reason
    hidden_from = next(step for step, at in enumerate(way) if at[0] > 150)
    assert hidden_from - 8 <= len(found) <= hidden_from + 8
    assert not any(isinstance(box, LostBox) for box in found[:-1])


def test_a_box_survives_a_post_that_hides_its_object_for_a_moment():
    def pictures() -> Iterator[np.ndarray]:
        for step in range(40):
            shown = picture((60 + 5.0 * step, 120.0), seed=step)
            if step in (15, 16):
                shown[:, 120:180] = 90
            yield shown

    found = followed(pictures(), edges((60, 120)))
    assert len(found) == 39
    assert isinstance(found[-1], TrackedBox)
    assert found[-1].edges_px == pytest.approx(edges((255, 120)), abs=2.5)


def test_a_box_ends_where_its_object_leaves_the_picture():
    way = [(200 + 6.0 * step, 120.0) for step in range(40)]
    found = followed((picture(at, seed=step) for step, at in enumerate(way)), edges(way[0]))
    assert isinstance(found[-1], LostBox)
    assert "leaves the picture" in found[-1].reason
    left_at = next(step for step, at in enumerate(way) if at[0] > 319.5)
    assert abs(len(found) - left_at) <= 3
    for box in found[:-1]:
        assert isinstance(box, TrackedBox)
        assert box.edges_px[2] <= 319.5


def test_another_picture_altogether_loses_the_box():
    def pictures() -> Iterator[np.ndarray]:
        yield picture((100, 100))
        for seed in range(8):
            yield textured(SIZE[::-1], seed=20 + seed).clip(0, 255).astype(np.uint8)

    found = followed(pictures(), edges((100, 100)))
    assert len(found) == 1
    assert isinstance(found[0], LostBox)


def test_an_object_before_a_wall_of_one_colour_is_followed():
    def pictures() -> Iterator[np.ndarray]:
        for step in range(20):
            drawn = np.full(SIZE[::-1], 150, dtype=np.uint8)
            drawn[68:132, 40 + 5 * step : 80 + 5 * step] = OBJECT.clip(0, 255)
            yield drawn

    found = followed(pictures(), (39.5, 67.5, 79.5, 131.5))
    assert len(found) == 19
    assert isinstance(found[-1], TrackedBox)
    assert found[-1].edges_px == pytest.approx((134.5, 67.5, 174.5, 131.5), abs=2.0)


def test_a_box_of_one_colour_cannot_be_followed():
    grey = np.full((240, 320), 90, dtype=np.uint8)
    [lost] = followed(iter([grey, grey]), edges((100, 100)))
    assert isinstance(lost, LostBox)
    assert "one colour" in lost.reason


def test_pictures_are_read_only_as_they_are_asked_for():
    read: list[int] = []

    def pictures() -> Iterator[np.ndarray]:
        for step in range(100):
            read.append(step)
            yield picture((60 + 2.0 * step, 100.0), seed=step)

    boxes = follow_box(pictures(), edges((60, 100)))
    for _ in range(3):
        next(boxes)
    assert read == [0, 1, 2, 3]
