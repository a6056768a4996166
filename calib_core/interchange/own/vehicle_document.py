"""Which vehicle a calibration is of, in a calibration-1 file."""

from dataclasses import asdict

from calib_core.errors import InputError
from calib_core.interchange.own.documents import VehicleDocument
from calib_core.interchange.vehicle_note import VehicleNote

__all__ = ["vehicle_document", "vehicle_of"]


def vehicle_document(note: VehicleNote) -> VehicleDocument | None:
    """Return the document; None if nothing is stated."""
    return None if note == VehicleNote() else VehicleDocument(**asdict(note))


def vehicle_of(document: VehicleDocument | None, *, source: str) -> VehicleNote:
    """Return what a document states.

    Raises:
        InputError: a text is empty, too long or not printable.
    """
    if document is None:
        return VehicleNote()
    try:
        return VehicleNote(
            document.name, document.type, document.session, document.radar_serial, document.camera_serial
        )
    except InputError as error:
        raise InputError(f"{source}: {error}") from None
