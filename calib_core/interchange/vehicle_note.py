"""Which vehicle a calibration is of, and the serials of its sensors, as far as somebody stated them."""

from dataclasses import dataclass, fields, replace

from calib_core.errors import InputError

__all__ = ["MOST_CHARACTERS", "VehicleNote"]

MOST_CHARACTERS = 120
"""The longest name or serial."""


@dataclass(frozen=True, slots=True)
class VehicleNote:
    """What is stated of a vehicle and of one session with it; None where nothing is.

    Attributes:
        name: of the vehicle.
        type: vehicles of one type are mounted alike.
        session: name of the session, such as a date.
        radar_serial: of the radar.
        camera_serial: of the camera.

    Raises:
        InputError: a text is empty, too long or not printable.
    """

    name: str | None = None
    type: str | None = None
    session: str | None = None
    radar_serial: str | None = None
    camera_serial: str | None = None

    def __post_init__(self) -> None:
        for field in fields(self):
            _require_label(getattr(self, field.name), field.name)

    def over(self, other: "VehicleNote") -> "VehicleNote":
        """Return another note with what this one states instead."""
        stated = {field.name: getattr(self, field.name) for field in fields(self)}
        return replace(other, **{name: value for name, value in stated.items() if value is not None})


def _require_label(text: str | None, what: str) -> None:
    if text is None:
        return
    if not text.strip() or not text.isprintable() or len(text) > MOST_CHARACTERS:
        shown = text if len(text) <= MOST_CHARACTERS else f"{text[:20]}…"
        raise InputError(
            f"vehicle.{what} is {shown!r}; give 1 to {MOST_CHARACTERS} printable characters that are not all spaces"
        )
