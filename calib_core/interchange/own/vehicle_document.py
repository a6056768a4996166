"""Which vehicle a calibration is of, in a calibration-1 file."""

from dataclasses import asdict

from calib_core.errors import InputError
from calib_core.interchange.calibration_file import KeptResult
from calib_core.interchange.own.documents import VehicleDocument
from calib_core.interchange.vehicle_note import VehicleNote


def vehicle_document(note: VehicleNote, kept: tuple[KeptResult, ...] = ()) -> VehicleDocument | None:
    """Return the document; None if nothing is stated.

    Args:
        note: what is stated.
        kept: results that go back to their places, which may be in this document alone.
    """
    has_more = any(result.place[0] == "vehicle" for result in kept)
    return VehicleDocument(**asdict(note)) if has_more or note != VehicleNote() else None


def vehicle_of(document: VehicleDocument | None, *, source: str) -> VehicleNote:
    """Return what a document states.

    Raises:
        InputError: a text is empty, too long or not printable, or a name has a slash; the message names the file and the key.
    """
    if document is None:
        return VehicleNote()
    try:
        return VehicleNote(
            document.name, document.type, document.session, document.radar_serial, document.camera_serial
        )
    except InputError as error:
        raise InputError(f"{source}: {error}") from None
