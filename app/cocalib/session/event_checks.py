"""What every event about a frame is checked against: its stamp, and the size of the picture."""

import math

from calib_core.errors import CalibrationError
from calib_core.measurements import TimeNs, time_parts
from cocalib.session.chosen_intrinsics import ChosenIntrinsics
from cocalib.session.click_stamps import nearest_frame
from cocalib.session.state import RecordingFacts


class EventError(CalibrationError):
    """An event that does not fit the session or the recording; the session is unchanged."""


def require_frame(time: TimeNs, facts: RecordingFacts, what: str = "a click") -> None:
    """Check that a frame has a stamp.

    Args:
        time: the stamp.
        facts: the recording's frames.
        what: needs the frame, for the message.

    Raises:
        EventError: no frame has it.
    """
    if facts.frame_at(time) is not None:
        return
    nearest = ""
    if len(facts.image_times):
        index = nearest_frame(facts.image_times, time)
        nearest = f", the nearest is frame {index + 1} at {seconds(TimeNs(int(facts.image_times[index])))}"
    raise EventError(
        f"no frame of {facts.name} has the stamp {seconds(time)}{nearest}; {what} needs the exact stamp of its frame"
    )


def require_pixel(pixel_px: tuple[float, float], facts: RecordingFacts) -> tuple[float, float]:
    """Return a pixel that is in the frame.

    Raises:
        EventError: it is not.
    """
    u_px, v_px = pixel_px
    if not (math.isfinite(u_px) and math.isfinite(v_px) and facts.has_pixel(u_px, v_px)):
        raise EventError(
            f"({u_px:.1f}, {v_px:.1f}) px is outside the frame of {facts.width_px} x {facts.height_px} px; click inside it"
        )
    return pixel_px


def require_camera(intrinsics: ChosenIntrinsics, facts: RecordingFacts) -> None:
    """Check that intrinsics are a camera's, for frames of this size.

    Raises:
        EventError: they are not.
    """
    try:
        camera = intrinsics.camera
    except ValueError as error:
        raise EventError(f"the intrinsics cannot be used: {error}; calibrate the lens again") from None
    if (camera.width_px, camera.height_px) != (facts.width_px, facts.height_px):
        raise EventError(
            f"the intrinsics are for pictures of {camera.width_px} x {camera.height_px} px, but the frames have "
            f"{facts.width_px} x {facts.height_px}; calibrate with pictures of that size"
        )


def seconds(time: TimeNs) -> str:
    """Return a stamp as text, to the nanosecond."""
    sec, nanosec = time_parts(time)
    return f"{sec}.{nanosec:09d} s"
