"""Warnings about errors that all pairs share and clearly show: angles that are scaled, clicks beside the target."""

import numpy as np

from calib_core.diagnostics.solved_fit import SolvedFit
from calib_core.results import DataWarning
from calib_core.systematic_errors import SystematicErrorResult

_CLEAR_SIGMAS = 3.0
_NOTABLE_SCALE = 0.015
_BEYOND_PRIOR = 2.0  # of the prior's standard deviations
_SIDES = {
    "reflector_right_m": ("to the right of", "to the left of"),
    "reflector_down_m": ("below", "above"),
    "reflector_forward_m": ("beyond", "in front of"),
}


def angle_scale(fit: SolvedFit) -> list[DataWarning]:
    """Warn if the radar's angles are clearly scaled, and say what would look the same."""
    found = {
        one.name: one for one in fit.uncertainty.systematic_errors if _clear(one) and abs(one.value) > _NOTABLE_SCALE
    }
    warnings = []
    if "azimuth_scale" in found:
        warnings.append(_azimuth_scale(found["azimuth_scale"], flat=fit.measurements.flat))
    if "elevation_scale" in found:
        warnings.append(_elevation_scale(found["elevation_scale"]))
    return warnings


def _clear(one: SystematicErrorResult) -> bool:
    return one.estimated and abs(one.value) > _CLEAR_SIGMAS * one.sigma


def _azimuth_scale(one: SystematicErrorResult, *, flat: bool) -> DataWarning:
    size, length = ("large", "long") if one.value > 0.0 else ("small", "short")
    tilted = "; so would a tilt of the radar" if flat and one.value > 0.0 else ""
    return DataWarning(
        "angle-scale",
        f"the radar's azimuths look {_percent(one)} too {size}; a given focal length that is too {length} by the same amount "
        f"would look the same, and pairs cannot tell them apart{tilted}",
        "check the element spacing and wavelength that the radar's driver assumes, and whether the intrinsics belong to this "
        "camera, lens, zoom and image size; whichever is known to be right, give it a smaller sigma among the options",
    )


def _elevation_scale(one: SystematicErrorResult) -> DataWarning:
    size, side = ("large", "above") if one.value > 0.0 else ("small", "below")
    return DataWarning(
        "angle-scale",
        f"the radar's elevations look {_percent(one)} too {size}; on flat ground, clicks {side} the radar's phase centre would "
        "look the same",
        "click the reflector's apex, where its three sheets meet, not its mouth or its stand; to tell the two apart, put a few "
        "placements at other heights (a tripod)",
    )


def _by_pairs_alone(one: SystematicErrorResult) -> tuple[float, float]:
    """Return size and standard deviation of an error without its prior, which draws the estimate towards 0."""
    share = 1.0 - min(one.sigma / one.prior_sigma, 0.99) ** 2
    return abs(one.value) / share, one.sigma / float(np.sqrt(share))


def _percent(one: SystematicErrorResult) -> str:
    value, sigma = _by_pairs_alone(one)
    return f"{100.0 * value:.1f} ± {100.0 * sigma:.1f} %"


def _centimetres(one: SystematicErrorResult) -> str:
    value, sigma = _by_pairs_alone(one)
    return f"{100.0 * value:.0f} ± {100.0 * sigma:.0f} cm"


def clicks_off_centre(fit: SolvedFit) -> list[DataWarning]:
    """Warn if, with a measured camera position, all clicks clearly lie beside the radar's phase centre."""
    off = [
        one
        for one in fit.uncertainty.systematic_errors
        if one.name in _SIDES and _clear(one) and abs(one.value) > _BEYOND_PRIOR * one.prior_sigma
    ]
    if not off:
        return []
    parts = [f"{_centimetres(one)} {_SIDES[one.name][one.value < 0.0]}" for one in off]
    return [
        DataWarning(
            "clicks-off-centre",
            f"all clicks lie {' and '.join(parts)} the radar's phase centre, or the camera is that far from its measured "
            "position: pairs cannot tell them apart",
            "click the reflector's apex, where its three sheets meet, not its mouth or its stand; and measure again from the "
            "radar's antennas to the lens",
        )
    ]
