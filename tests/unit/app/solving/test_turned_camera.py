"""The images that were clicked say whether the camera turned; each is decoded once."""

import cv2
import numpy as np

from calib_core.errors import MessageError
from calib_core.measurements import NS_PER_S, ReflectorClick, TimeNs
from calib_core.options import CalibrationOptions
from cocalib.solving.solving import camera_turned_warnings
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
