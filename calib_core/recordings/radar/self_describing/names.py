"""What the name of a message's field means: its quantity and unit, and how plainly the name says it."""

from dataclasses import dataclass
from functools import cache

from calib_core.recordings.field_words.names import named_quantity, spelt
from calib_core.recordings.field_words.spellings import AMBIGUOUS, SPELLINGS
from calib_core.recordings.field_words.units import Unit
from calib_core.recordings.field_words.words import words_of


@dataclass(frozen=True, slots=True)
class Meaning:
    """What a name means.

    Attributes:
        quantity: x, y, z, range, azimuth, elevation, doppler, vx, vy, vz or amplitude.
        rank: 0 for the plainest names; larger for names that are used for other things too.
        unit: what the name states; None if nothing.
        sigma: it is the quantity's standard deviation.
        second: it is a second hypothesis, such as azimuth2.
        vague: the name fits azimuth and elevation alike.
        radial: a speed that can only be the radial one.
        named_axis: the axis is named by its direction, longitudinal or lateral.
    """

    quantity: str
    rank: int
    unit: Unit | None = None
    sigma: bool = False
    second: bool = False
    vague: bool = False
    radial: bool = False
    named_axis: bool = False


_KNOWN = spelt((*SPELLINGS, *AMBIGUOUS))
_LEVELS = ("snr", "intensity", "rcs", "power", "amplitude")


@cache
def meaning_of(name: str) -> Meaning | None:
    """Return what a field's dotted name means; None if it is none of the quantities in use."""
    found = named_quantity(words_of(name), _KNOWN)
    if found is None:
        return None
    kind = found.spelling.kind
    return Meaning(
        "amplitude" if kind in _LEVELS else found.quantity,
        found.spelling.rank,
        found.unit,
        sigma=found.sigma,
        second=found.second,
        vague=kind == "vague",
        radial=kind == "radial",
        named_axis=kind in ("longitudinal", "lateral"),
    )
