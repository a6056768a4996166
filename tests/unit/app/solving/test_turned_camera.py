"""The images that were clicked say whether the camera turned; each is decoded once."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from calib_core.errors import MessageError
from calib_core.measurements import NS_PER_S, ReflectorClick, TimeNs
from calib_core.options import CalibrationOptions
from cocalib.solving.solving import camera_turned_warnings, is_a_stretch
from tests.unit.watching.test_still_image import CAMERA, scene, turned


class _Recording:
    """Ten images of a camera that turned by half a degree after the third; the fifth cannot be read."""

    def __init__(self, turned_deg: float) -> None:
        self.image_times = np.arange(10) * 20 * NS_PER_S
        self.decoded: list[int] = []
        self._turned_deg = turned_deg

    def image(self, index: int) -> np.ndarray:
        self.decoded.append(index)
        if index == 4:
            raise MessageError("damaged")
        grey = turned(scene(), (0.0, self._turned_deg if index > 2 else 0.0, 0.0))
        return cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR)


CLICKS = [ReflectorClick(TimeNs(20 * NS_PER_S * index), f"c{index}", 1.0, 1.0) for index in range(10)]


def test_a_turn_between_clicks_is_named_and_images_are_decoded_once():
    recording = _Recording(0.5)
    options = CalibrationOptions()

    (warning,) = camera_turned_warnings(recording, CLICKS, CAMERA, options)
    again = camera_turned_warnings(recording, CLICKS[:9], CAMERA, options)

    assert warning.code == "camera-turned"
    assert warning.facts["ids"] == ("c0", "c1", "c2")
    assert len(again) == 1
    assert sorted(recording.decoded) == list(range(10))


def test_a_camera_that_stands_still_and_a_single_click_say_nothing():
    assert camera_turned_warnings(_Recording(0.0), CLICKS, CAMERA, CalibrationOptions()) == ()
    assert camera_turned_warnings(_Recording(0.5), CLICKS[:1], CAMERA, CalibrationOptions()) == ()
    assert camera_turned_warnings(_Recording(0.5), [], CAMERA, CalibrationOptions()) == ()


@pytest.mark.parametrize(
    ("turned_deg", "excluded", "expected"),
    [
        (0.5, "c0 c1 c2", True),
        (0.5, "c3 c4 c5 c6 c7 c8 c9", True),
        (0.5, "c0 c1", False),
        (0.5, "", False),
        (0.0, "c0 c1 c2", False),
    ],
)
def test_the_clicks_of_one_side_of_a_turn_are_a_stretch_to_be_solved_on_its_own(turned_deg, excluded, expected):
    clicks = [replace(click, excluded=click.id in excluded.split()) for click in CLICKS]

    assert is_a_stretch(_Recording(turned_deg), clicks, CAMERA, CalibrationOptions()) is expected
