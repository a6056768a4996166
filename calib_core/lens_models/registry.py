"""The lens models a camera can have, and their names in other formats. To add one: write its module, and add it here."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from calib_core.arrays import Values
from calib_core.errors import InputError
from calib_core.lens_models.brown_conrady import PINHOLE, PLUMB_BOB, RATIONAL_POLYNOMIAL
from calib_core.lens_models.equidistant import EQUIDISTANT
from calib_core.lens_models.lens_model import Elsewhere, LensModel

_LENSES: tuple[LensModel, ...] = (
    PINHOLE,
    PLUMB_BOB,
    RATIONAL_POLYNOMIAL,
    EQUIDISTANT,
)

LENS_MODELS: Final[dict[str, LensModel]] = {lens.name: lens for lens in _LENSES}
"""By name, in display order."""


_TITLES: dict[Elsewhere, str] = {
    "camera_info": "ROS",
    "kalibr": "Kalibr",
    "opencv": "OpenCV",
    "colmap": "COLMAP",
    "foxglove": "Foxglove",
}


@dataclass(frozen=True, slots=True)
class WrittenLens:
    """A lens as another format writes it.

    Attributes:
        name: the lens model's name there.
        coefficients: as many as that name requires.
    """

    name: str
    coefficients: tuple[float, ...]


def written_lens(lens: LensModel, distortion: Values, where: Elsewhere) -> WrittenLens:
    """Return a lens as a format writes it.

    Args:
        lens: the camera's lens model.
        distortion: the camera's coefficients.
        where: the format.

    Raises:
        InputError: the format has no name for this lens model, or cannot store a coefficient that is not zero.
    """
    names = [known for known in lens.names_elsewhere if known.where == where]
    if not names:
        raise InputError(
            f"{_TITLES[where]} has no name for the lens model {lens.name}; json and matlab can store every lens"
        )
    for known in names:
        count = len(distortion) if known.coefficients is None else known.coefficients
        if not np.any(distortion[count:]):
            padded = [*distortion.tolist(), *[0.0] * count]
            return WrittenLens(known.name, tuple(padded[:count]))
    longest = max(names, key=lambda known: known.coefficients or 0)
    kept, left_out = (
        lens.coefficients[: longest.coefficients],
        lens.coefficients[longest.coefficients : len(distortion)],
    )
    missing = left_out[0] if len(left_out) == 1 else f"{left_out[0]} to {left_out[-1]}"
    other = "opencv" if any(known.where == "opencv" for known in lens.names_elsewhere) else "json"  # stores all of them
    raise InputError(
        f"{_TITLES[where]}'s {longest.name} model has no {missing}, which this camera uses; "
        f"export with --to {other}, or calibrate the camera with {' '.join(kept)} only"
    )


def lenses_named(where: Elsewhere, name: str) -> tuple[LensModel, ...]:
    """Return the lens models that a format may write under a name, in the registry's order."""
    return tuple(
        lens
        for lens in LENS_MODELS.values()
        if any((known.where, known.name) == (where, name) for known in lens.names_elsewhere)
    )


def names_in(where: Elsewhere) -> tuple[str, ...]:
    """Return every name that a format has for a lens model, each once, in the registry's order."""
    names = (known.name for lens in LENS_MODELS.values() for known in lens.names_elsewhere if known.where == where)
    return tuple(dict.fromkeys(names))


def lenses_of_opencv() -> tuple[LensModel, ...]:
    """Return the lens models that cv2.projectPoints distinguishes by their number of coefficients."""
    return tuple(
        sorted(
            (lens for lens in LENS_MODELS.values() if lens.opencv == "projectPoints"), key=lambda lens: lens.counts[-1]
        )
    )


def opencv_lens(count: int) -> LensModel:
    """Return the lens model that cv2.projectPoints uses for a number of coefficients: the smallest with at least as many."""
    lenses = lenses_of_opencv()
    return next((lens for lens in lenses if lens.counts[-1] >= count), lenses[-1])
