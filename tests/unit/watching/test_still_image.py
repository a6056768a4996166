"""The still image says how a camera turned, whatever light and passers-by do, and leaves no trace of anybody."""

import cv2
import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.geometry import rotation_exp
from calib_core.watching.still_image import background, camera_turn

WIDTH, HEIGHT = 480, 300
CAMERA = Camera("pinhole", WIDTH, HEIGHT, np.array([[400.0, 0.0, 239.5], [0.0, 400.0, 149.5], [0.0, 0.0, 1.0]]))


def scene(seed: int = 3) -> np.ndarray:
    """Return grey blocks of several sizes, larger than the image, as uint8."""
    rng = np.random.default_rng(seed)
    values = np.zeros((HEIGHT, WIDTH))
    for size in (8, 20, 50):
        shape = (HEIGHT // size + 1, WIDTH // size + 1)
        values += rng.uniform(0.0, 80.0, shape).repeat(size, 0).repeat(size, 1)[:HEIGHT, :WIDTH]
    return np.clip(values, 0, 255).astype(np.uint8)


def turned(image: np.ndarray, rotation_deg: tuple[float, float, float]) -> np.ndarray:
    rotation = rotation_exp(np.deg2rad(rotation_deg))
    homography = CAMERA.matrix_px @ rotation @ np.linalg.inv(CAMERA.matrix_px)
    return cv2.warpPerspective(image, homography, (WIDTH, HEIGHT), borderMode=cv2.BORDER_REFLECT)


@pytest.mark.parametrize("rotation_deg", [(0.0, 0.05, 0.0), (-0.3, 0.0, 0.0), (0.4, 2.0, -1.0), (0.0, 0.0, 0.0)])
def test_a_turn_is_found_about_all_axes_with_an_honest_sigma(rotation_deg):
    turn = camera_turn(scene(), turned(scene(), rotation_deg), CAMERA)

    assert turn is not None
    error = np.rad2deg(turn.rotation_rad) - rotation_deg
    assert (np.abs(error) < 0.02).all()
    assert (np.abs(error) < 4.0 * np.rad2deg(np.sqrt(np.diag(turn.covariance_rad2)))).all()


def light(image: np.ndarray) -> np.ndarray:
    return np.clip(image * 0.6 + 25.0, 0, 255).astype(np.uint8)


def shadow(image: np.ndarray) -> np.ndarray:
    dark = image.copy()
    cv2.fillPoly(dark, [np.array([(40, 300), (200, 60), (330, 300)])], 0)
    return cv2.addWeighted(image, 0.55, dark, 0.45, 0.0)


def rain(image: np.ndarray) -> np.ndarray:
    rng = np.random.default_rng(7)
    wet = cv2.GaussianBlur(image, (0, 0), 1.5).astype(np.float64) * 0.7 + 50.0
    return np.clip(wet + rng.normal(0.0, 4.0, image.shape), 0, 255).astype(np.uint8)


def parked(image: np.ndarray) -> np.ndarray:
    cars = image.copy()
    cars[180:260, 60:200] = scene(8)[180:260, 60:200]
    cars[190:250, 300:420] = 220
    return cars


@pytest.mark.parametrize("change", [light, shadow, rain, parked])
def test_light_weather_and_parked_cars_are_no_turn(change):
    still = camera_turn(scene(), change(scene()), CAMERA)
    moved = camera_turn(scene(), change(turned(scene(), (0.0, 0.1, 0.0))), CAMERA)

    assert still is not None
    assert moved is not None
    assert (np.abs(np.rad2deg(still.rotation_rad)) < 0.03).all()
    assert np.rad2deg(moved.rotation_rad) == pytest.approx([0.0, 0.1, 0.0], abs=0.03)


def test_another_scene_or_a_blank_one_says_nothing():
    assert camera_turn(scene(), scene(11), CAMERA) is None
    assert camera_turn(scene(), np.full((HEIGHT, WIDTH), 128, dtype=np.uint8), CAMERA) is None
    assert camera_turn(np.full((HEIGHT, WIDTH), 128, dtype=np.uint8), scene(), CAMERA) is None


@pytest.mark.slow
def test_a_walker_in_a_third_of_the_frames_leaves_no_trace():
    rng = np.random.default_rng(4)

    def frame(index: int) -> np.ndarray:
        image = cv2.cvtColor(scene(), cv2.COLOR_GRAY2BGR).astype(np.float64) + rng.normal(0, 2.0, (HEIGHT, WIDTH, 3))
        if index % 10 < 3:
            image[120:220, 100:140] = (30, 40, 240)
        return np.clip(image, 0, 255).astype(np.uint8)

    with_walker = background([frame(index) for index in range(25)])

    assert with_walker is not None
    off = np.abs(with_walker.astype(int) - scene().astype(int))
    assert off[120:220, 100:140].max() <= off.max() <= 6
    assert background([frame(0)] * 4) is None
