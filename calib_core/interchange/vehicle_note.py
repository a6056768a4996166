"""Which vehicle a calibration is of, and the serials of its sensors, as far as somebody stated them."""

from dataclasses import dataclass, fields, replace

from calib_core.errors import InputError

MOST_CHARACTERS = 120
"""The longest name or serial, in manifests, files and flags alike."""


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
        InputError: a text is empty, too long or not printable, or a name has a slash; the message begins with the key.
    """

    name: str | None = None
    type: str | None = None
    session: str | None = None
    radar_serial: str | None = None
    camera_serial: str | None = None

    def __post_init__(self) -> None:
        for field in fields(self):
            if (text := getattr(self, field.name)) is not None:
                (require_name if field.name in ("name", "session") else require_label)(text, f"vehicle.{field.name}")

    def over(self, other: "VehicleNote") -> "VehicleNote":
        """Return another note with what this one states instead."""
        stated = {field.name: getattr(self, field.name) for field in fields(self)}
        return replace(other, **{name: value for name, value in stated.items() if value is not None})


def require_name(name: str, where: str) -> None:
    """Refuse what cannot name a vehicle or a session, since `VEHICLE/SESSION` names one session.

    Args:
        name: of a vehicle or a session.
        where: the name of the key or flag, with its file, for the message.

    Raises:
        InputError: it is blank, only dots, or too long, or has a slash or an unprintable character.
    """
    require_label(name, where)
    if not name.strip(". ") or set(name) & set("/\\"):
        raise InputError(f"{where}: {name!r} cannot be a name; give one without slashes")


def require_label(text: str, where: str) -> None:
    """Refuse what cannot be a vehicle's type or a sensor's serial.

    Args:
        text: as it was stated.
        where: the name of the key or flag, with its file, for the message.

    Raises:
        InputError: it is blank, too long or not printable.
    """
    if text != text.strip() and text.strip():
        raise InputError(f"{where} is {text!r}; leave out the spaces around it")
    if not text.strip() or not text.isprintable() or len(text) > MOST_CHARACTERS:
        shown = text if len(text) <= MOST_CHARACTERS else f"{text[:20]}…"
        raise InputError(
            f"{where} is {shown!r}; give 1 to {MOST_CHARACTERS} printable characters that are not all spaces"
        )
