"""What of a covariance rests on stated standard deviations, in a calibration-1 file."""

import numpy as np

from calib_core.arrays import Matrix66
from calib_core.covariance_parts import CovarianceParts
from calib_core.errors import InputError
from calib_core.interchange.own.documents import CovariancePartsDocument
from calib_core.interchange.own.documents import Matrix66 as StatedMatrix
from calib_core.interchange.own.numbers import nested


def covariance_parts_document(parts: CovarianceParts | None) -> CovariancePartsDocument | None:
    """Return the document of the parts; without a measured camera position that part is left out."""
    if parts is None or not np.isfinite(parts.systematic).all():
        return None
    measured = nested(parts.camera_position + 0.0) if parts.camera_position.any() else None
    return CovariancePartsDocument(nested(parts.systematic + 0.0), measured)


def covariance_parts_of(
    document: CovariancePartsDocument | None, *, source: str, place: str = "covariance_parts"
) -> CovarianceParts | None:
    """Return the parts in a document.

    Raises:
        InputError: a part is no covariance.
    """
    if document is None:
        return None
    measured = document.camera_position
    return CovarianceParts(
        _part(document.systematic, source=source, place=f"{place}.systematic"),
        np.zeros((6, 6)) if measured is None else _part(measured, source=source, place=f"{place}.camera_position"),
    )


def _part(rows: StatedMatrix, *, source: str, place: str) -> Matrix66:
    part = np.array(rows)
    if not np.isfinite(part).all() or (np.diagonal(part) < 0.0).any():
        raise InputError(
            f"{source}: {place}: a variance on the diagonal is negative or no number; solve the session again"
        )
    return np.asarray(0.5 * (part + part.T))
