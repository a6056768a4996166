"""The lens models a camera can have. To add one: write its module, and add it here."""

from typing import Final

from calib_core.lens_models.brown_conrady import PINHOLE, PLUMB_BOB, RATIONAL_POLYNOMIAL
from calib_core.lens_models.equidistant import EQUIDISTANT
from calib_core.lens_models.lens_model import LensModel

_LENSES: tuple[LensModel, ...] = (
    PINHOLE,
    PLUMB_BOB,
    RATIONAL_POLYNOMIAL,
    EQUIDISTANT,
)

LENS_MODELS: Final[dict[str, LensModel]] = {lens.name: lens for lens in _LENSES}
"""By name, in display order."""
