"""What it means that a pair is an outlier: the mark may be wrong, or it is the method, or an option."""

from dataclasses import dataclass

from calib_core.options import CalibrationOptions, NoiseOptions

_STRICT = 1.0 / 3.0
_NOISE = {"sigma_px": "click noise", "sigma_range_m": "range noise", "sigma_azimuth_deg": "azimuth noise"}


@dataclass(frozen=True, slots=True)
class Disagreement:
    """Why pairs are outliers under some options.

    Attributes:
        what: what is wrong, the beginning of a sentence.
        action: what to do about it, a sentence.
    """

    what: str
    action: str


def disagreement(options: CalibrationOptions) -> Disagreement:
    """Say what makes a pair an outlier: the pair itself, the paper's method, or options that allow too little noise."""
    if not options.models_noise:
        return Disagreement(
            f"Outside the {options.paper.ransac_threshold_px:g} px of Algorithm 1's RANSAC, which uses it all the same",
            "The default method tells whether it is wrong.",
        )
    usual, given = NoiseOptions(), options.noise
    strict = [text for name, text in _NOISE.items() if getattr(given, name) < _STRICT * getattr(usual, name)]
    if not strict:
        return Disagreement("Disagrees with the other pairs", "Check the click, or exclude it.")
    return Disagreement(
        f"Does not fit the noise that the options state ({' and '.join(strict)} far below the default)",
        "Check these options before the click.",
    )
