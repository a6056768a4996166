"""A transform in our files: matrix and quaternion, compared as exactly as its digits allow; numbers and arrays for JSON."""

from decimal import Decimal
from typing import Any

import numpy as np

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform, matrix_from_quaternion_wxyz, quaternion_wxyz_from_matrix
from calib_core.interchange.own.documents import TransformDocument
from calib_core.interchange.rotations import nearest_rotation

_AGREEMENT = 1e-5
"""The largest difference allowed between two statements of one transform, in any matrix entry, besides rounding."""
_ORTHONORMAL = 1e-6
_FEWEST_DIGITS = 4
"""Numbers with fewer digits count as rounded to this many: a short number is exact more often than it is rounded."""
_QUATERNION_SHARE = 10
"""How far rounding of a quaternion's or a matrix's entries moves an entry of the rotation, at most."""


def transform_of(document: TransformDocument, *, source: str, place: str) -> RigidTransform:
    """Return the transform in a document; a rotation with few digits becomes the nearest proper one.

    Raises:
        InputError: the rotation is invalid (mirrored, or not orthonormal), or the quaternion is a different rotation.
    """
    rotation = np.array(document.rotation)
    tolerance = _rotation_rounding(document)
    try:
        if np.abs(rotation @ rotation.T - np.eye(3)).max() > _ORTHONORMAL:
            rotation = nearest_rotation(rotation, tolerance=tolerance)
        transform = RigidTransform(rotation, np.array(document.translation_m))
    except ValueError as error:
        raise InputError(f"{source}: {place}.rotation: {error}; give a proper rotation") from None
    if document.quaternion_wxyz is not None and not _same_rotation(
        document.quaternion_wxyz, transform, _AGREEMENT + tolerance
    ):
        raise InputError(
            f"{source}: {place}.quaternion_wxyz: is a different rotation from {place}.rotation; "
            "the order is w, x, y, z; correct one of the two"
        )
    return transform


def are_inverse(document: TransformDocument, inverse: TransformDocument, *, source: str, place: str) -> bool:
    """Return whether two stated transforms are each other's inverse, as far as their digits tell.

    Args:
        document: the one; already read.
        inverse: the other.
        source: the name of the file in error messages.
        place: of the other in the file.

    Raises:
        InputError: the other's rotation is invalid, or contradicts its quaternion.
    """
    turned = TransformDocument(document.rotation, document.translation_m)
    stated = transform_of(turned, source=source, place=place)
    other = transform_of(inverse, source=source, place=place).inverse()
    rounding = max(_rotation_rounding(document), _rotation_rounding(inverse))
    reach_m = float(np.abs(stated.translation_m).sum())
    translation_rounding = 3 * (_rounding(document.translation_m) + _rounding(inverse.translation_m))
    apart = np.abs(other.as_matrix() - stated.as_matrix())
    return bool(
        apart[:, :3].max() <= _AGREEMENT + 2 * rounding
        and apart[:, 3].max() <= _AGREEMENT + translation_rounding + reach_m * rounding
    )


def transform_document(transform: RigidTransform) -> TransformDocument:
    """Return the document of a transform."""
    return TransformDocument(
        rotation=nested(transform.rotation + 0.0),
        translation_m=nested(transform.translation_m + 0.0),
        quaternion_wxyz=nested(quaternion_wxyz_from_matrix(transform.rotation) + 0.0),
    )


def _same_rotation(quaternion_wxyz: tuple[float, ...], transform: RigidTransform, tolerance: float) -> bool:
    quaternion = np.array(quaternion_wxyz)
    if not quaternion.any():
        return False
    return bool(np.abs(matrix_from_quaternion_wxyz(quaternion) - transform.rotation).max() <= tolerance)


def _rotation_rounding(document: TransformDocument) -> float:
    """Return how far rounding may have moved an entry of the rotation, from the digits of its numbers."""
    numbers = [number for row in document.rotation for number in row]
    return _QUATERNION_SHARE * max(_rounding(numbers), _rounding(document.quaternion_wxyz or numbers))


def _rounding(numbers: "tuple[float, ...] | list[float]") -> float:
    """Return half a unit of the last digit that numbers rounded alike were written with.

    They may have been rounded to decimals or to significant digits; the number with the most tells how many.
    """
    written = [Decimal(repr(float(number))).normalize() for number in numbers if np.isfinite(number)]
    decimals = max([_FEWEST_DIGITS, *(-int(one.as_tuple().exponent) for one in written)])
    digits = max([_FEWEST_DIGITS, *(len(one.as_tuple().digits) for one in written)])
    largest = max([0.0, *(abs(float(one)) for one in written)])
    magnitude = int(np.floor(np.log10(largest))) + 1 if largest > 1.0 else 0
    return 0.5 * max(10.0**-decimals, 10.0 ** (magnitude - digits))


def finite_or_none(value: float) -> float | None:
    """Return a finite number as it is, and None for any other."""
    return float(value) if np.isfinite(value) else None


def nan_if_none(value: float | None) -> float:
    """Return the number in a file, NaN for null."""
    return float("nan") if value is None else value


def nested(array: np.ndarray) -> Any:
    """Return an array as nested tuples; None if any entry is not finite."""
    if not np.isfinite(array).all():
        return None
    return tuple(map(tuple, array.tolist())) if array.ndim == 2 else tuple(array.tolist())
