"""What the witnesses say together, row by row of the table of the docs."""

import numpy as np
import pytest

from calib_core.geometry import OPTICAL_FROM_LINK
from calib_core.measurements import TimeNs
from calib_core.watching.witnesses import SeenTurn, verdict_of


def says(turn_deg: tuple[float, float, float], sigma_deg: float, *, blind: bool = False) -> SeenTurn:
    """Return a seen that counts turns of five sigmas; blind to all but the third axis."""
    least = np.full(3, 5.0 * np.deg2rad(sigma_deg))
    if blind:
        least[:2] = np.inf
    turned = np.abs(np.deg2rad(turn_deg)) > least
    since = TimeNs(5) if turned.any() else None
    return SeenTurn(np.deg2rad(turn_deg), np.deg2rad(sigma_deg) ** 2 * np.eye(3), least, turned, since)


STILL, FLAT = says((0.0, 0.0, 0.0), 0.02), says((0.0, 0.0, 0.0), 0.05, blind=True)
YAW, PITCH = says((0.0, 1.0, 0.0), 0.02), says((1.0, 0.0, 0.0), 0.02)
RADAR_YAW = says((0.0, 0.0, -1.0), 0.05, blind=True)  # about the radar's vertical, which is the camera's -y
SHARP = says((0.0, 0.0, 0.0), 0.05)
WEAK = says((0.0, 0.0, 0.0), 0.6)


@pytest.mark.parametrize(
    ("image", "returns", "traffic", "finding"),
    [
        (YAW, FLAT, None, "turned"),
        (YAW, FLAT, SHARP, "turned"),
        (YAW, RADAR_YAW, None, "mast_turned"),
        (STILL, RADAR_YAW, None, "turned"),
        (None, RADAR_YAW, None, "radar_turned"),
        (PITCH, FLAT, None, "camera_moved"),
        (PITCH, None, None, "camera_moved"),
        (PITCH, FLAT, WEAK, "camera_moved"),
        (PITCH, FLAT, SHARP, "traffic_denies"),
        (PITCH, says((0.0, -1.0, 0.0), 0.05), None, "mast_turned"),
        (PITCH, says((0.0, 0.0, 0.0), 0.05), None, "turned"),
        (None, None, says((0.0, 1.0, 0.0), 0.1), "turned"),
        (STILL, FLAT, says((1.0, 0.0, 0.0), 0.1), "turned"),
        (STILL, FLAT, SHARP, "nothing"),
        (STILL, SHARP, None, "nothing"),
        (None, None, SHARP, "nothing"),
        (STILL, FLAT, None, "too_little"),
        (STILL, None, WEAK, "too_little"),
        (None, None, None, "too_little"),
    ],
)
def test_witnesses_are_weighed(image, returns, traffic, finding):
    verdict = verdict_of(image, returns, traffic, camera_from_radar_rotation=OPTICAL_FROM_LINK)

    assert verdict.finding == finding
    if finding == "nothing":
        assert (verdict.noticed_rad[:2] <= np.deg2rad(1.0)).all()
    if finding == "turned":
        assert verdict.change is not None
        assert np.rad2deg(np.abs(verdict.change.rotation_rad)).max() == pytest.approx(1.0, abs=0.01)
