"""Convert what a file says of clicks that nobody confirmed."""

from collections.abc import Sequence

from msgspec import UNSET, UnsetType

from calib_core.interchange.own.documents import UnconfirmedDocument
from calib_core.results import UnconfirmedClicks


def unconfirmed_document(unconfirmed: UnconfirmedClicks | None) -> UnconfirmedDocument | UnsetType:
    """Return the document; unset if everything was confirmed."""
    return UNSET if unconfirmed is None else UnconfirmedDocument(list(unconfirmed.ids), unconfirmed.confidence)


def unconfirmed_of(
    document: UnconfirmedDocument | UnsetType, present: Sequence[str] | None = None
) -> UnconfirmedClicks | None:
    """Return what a document says; None if it says nothing.

    Args:
        document: of a file.
        present: ids of the file's clicks: others were taken out of it since; None keeps all.
    """
    if isinstance(document, UnsetType):
        return None
    ids = tuple(name for name in document.clicks if present is None or name in present)
    return UnconfirmedClicks(ids, document.confidence) if ids else None
