"""How much each warning of a calibration matters: what it does to the verdict, and which of several comes first."""

from collections.abc import Iterable
from typing import Literal, TypeAlias

from calib_core.results import DataWarning

Consequence: TypeAlias = Literal["contradictory", "weak", "limited", "note"]
"""What a warning says of the pose: another one is as likely or the input is not what it claims to be; it cannot be relied
on; it rests on an assumption, so it cannot be called good; nothing."""

_CODES: dict[Consequence, tuple[str, ...]] = {
    "contradictory": (
        "behind-camera",
        "outside-picture",
        "mirrored-axes",
        "units-suspected",
        "pixels-suspected",
        "camera-position-contradicted",
        "two-poses",
        "handedness-open",
        "camera-far-away",
        "many-outliers",
        "agreeing-outliers",
        "doubtful-pair",
    ),
    "weak": (
        "rests-on-fleet-prior",
        "off-its-kind",
        "weak-geometry",
        "swapped-parts",
        "one-pair-decides",
        "few-pairs",
        "residuals-too-large",
        "intrinsics-suspected",
        "clock-bias-suspected",
        "radar-axes-suspected",
        "repeated-placements",
    ),
    "limited": (
        "flat-radar",
        "choices-unused",
        "uncertain-association",
        "smooth-angle-errors",
        "angle-scale",
        "lens-or-radar-scale",
        "clicks-off-centre",
        "handedness-assumed",
        "nobody-confirmed",
    ),
}
"""The codes of each consequence, the gravest first."""
_RANKED: dict[str, tuple[int, Consequence]] = {
    code: (rank, consequence)
    for rank, (consequence, code) in enumerate((one, code) for one, codes in _CODES.items() for code in codes)
}


def consequence_of(code: str) -> Consequence:
    """Return what a warning with this code does to the verdict; one that is not about the pose does nothing."""
    return _RANKED[code][1] if code in _RANKED else "note"


def by_consequence(warnings: Iterable[DataWarning]) -> tuple[DataWarning, ...]:
    """Return the warnings with the gravest first; those that say nothing of the pose come last, as they were given."""
    return tuple(sorted(warnings, key=lambda warning: _RANKED.get(warning.code, (len(_RANKED), "note"))[0]))
