"""A camera that turned between placements is named with the placements on one side; a moving rig, and noise, are not."""

import numpy as np
import pytest

from calib_core.measurements import NS_PER_S, ReflectorClick, TimeNs
from calib_core.watching.turned_camera import camera_turned
from calib_core.watching.witnesses import Turn
from tests.unit.watching.test_still_image import CAMERA

SIGMA_PX = 2.0  # 0.29 deg of this camera


def turns(yaw_deg: list[float | None], noise_deg: float = 0.01) -> dict[TimeNs, Turn | None]:
    rng = np.random.default_rng(2)
    covariance = np.deg2rad(0.01) ** 2 * np.eye(3)
    return {
        TimeNs(20 * NS_PER_S * number): None
        if yaw is None
        else Turn(np.deg2rad([0.0, yaw, 0.0] + noise_deg * rng.normal(size=3)), covariance)
        for number, yaw in enumerate(yaw_deg)
    }


def clicks(count: int) -> list[ReflectorClick]:
    return [ReflectorClick(TimeNs(20 * NS_PER_S * number), f"c{number}", 1.0, 1.0) for number in range(count)]


@pytest.mark.parametrize("step_deg", [0.35, 1.0, -2.0])
def test_a_turn_beyond_what_a_click_is_off_by_is_named(step_deg):
    (warning,) = camera_turned(turns([0.0] * 2 + [step_deg] * 6), clicks(8), CAMERA, sigma_px=SIGMA_PX)

    assert warning.code == "camera-turned"
    assert warning.facts["turned_deg"] == pytest.approx(abs(step_deg), abs=0.05)
    assert (warning.facts["last_s"], warning.facts["first_s"]) == (20.0, 40.0)
    assert (warning.facts["ids"], warning.facts["before"]) == (("c0", "c1"), True)


def test_the_smaller_side_is_named():
    (warning,) = camera_turned(turns([0.0] * 6 + [1.0] * 2), clicks(8), CAMERA, sigma_px=SIGMA_PX)

    assert (warning.facts["ids"], warning.facts["before"]) == (("c6", "c7"), False)


@pytest.mark.parametrize(
    "yaw_deg",
    [
        [0.0] * 8,
        [0.0] * 4 + [0.2] * 4,  # less than a click is off by
        [0.0, 2.0, None, None, 5.0, None, 8.0, 9.0],  # a moving rig
        [0.0, 9.0] * 4,
        [0.0],
        [],
    ],
)
def test_nothing_else_is_named(yaw_deg):
    assert camera_turned(turns(yaw_deg), clicks(8), CAMERA, sigma_px=SIGMA_PX) == ()


def test_scatter_is_not_taken_for_a_turn():
    assert camera_turned(turns([0.0] * 8, noise_deg=0.4), clicks(8), CAMERA, sigma_px=0.5) == ()
