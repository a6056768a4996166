"""Choose the columns of a message by the meanings of their names and comments."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Values
from calib_core.recordings.field_words.units import Unit, dimension_of
from calib_core.recordings.field_words.words import has_word, words_of
from calib_core.recordings.radar.self_describing.comment_units import unit_in
from calib_core.recordings.radar.self_describing.comments import angle_in
from calib_core.recordings.radar.self_describing.names import Meaning, meaning_of


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


_AXIS_WORDS = _words("x y z long lat vertical height altitude dx dy dz px py pz dlong dlat vx vy vz vlong vlat")
_SIZES = ("width", "length")
_NOT_RADARS = ("curvature", "steering", "steer", "lane", "jerk", "effort", "joint", "wheel", "throttle", "brake")
_MOST_OF_THEM = 0.6


@dataclass(frozen=True, slots=True, eq=False)
class DescribedColumn:
    """One number of a return, as the message describes it.

    Attributes:
        name: dotted.
        integer: whether its values are integers.
        comment: of the definition.
        values: (n,) in a sample of messages, in the same order for all columns; empty if there is none.
        standard: it belongs to a position or vector of geometry_msgs, whose unit and axes ROS defines.
    """

    name: str
    integer: bool
    comment: str
    values: Values
    standard: bool = False

    @property
    def filled(self) -> bool:
        """Whether any value is not zero; also without values."""
        return not len(self.values) or bool(np.any(np.isfinite(self.values) & (self.values != 0)))


@dataclass(frozen=True, slots=True, eq=False)
class Picked:
    """A column and what it means.

    Attributes:
        column: the column.
        meaning: of its name.
        unit: that its name or comment states; None if neither does.
        why: where the unit is stated; "" if it is not.
    """

    column: DescribedColumn
    meaning: Meaning
    unit: Unit | None
    why: str

    @property
    def order(self) -> tuple[int, bool, int, int, str]:
        """The order of preference: plain names first; it does not depend on the order of the fields."""
        name = self.column.name
        return self.meaning.rank, not self.column.filled, len(words_of(name)), len(name), name

    @property
    def stem(self) -> tuple[str, ...]:
        """The words of the name other than the axis, which x, y and z of one position share."""
        return tuple(word for word in words_of(self.column.name) if word not in _AXIS_WORDS)


@dataclass(frozen=True, slots=True, eq=False)
class Chosen:
    """The columns in use by quantity.

    Attributes:
        picked: by quantity.
        sigma: standard deviations by quantity.
        vague: angles whose names fit azimuth and elevation alike, if they had to be told apart.
        other_azimuths: columns with further hypotheses.
        unused_heights: columns that may hold the elevation or height of a polar position, if none is sure to.
    """

    picked: dict[str, Picked]
    sigma: dict[str, Picked]
    vague: tuple[Picked, ...] = ()
    other_azimuths: tuple[str, ...] = ()
    unused_heights: tuple[str, ...] = ()


def choose(columns: Sequence[DescribedColumn]) -> Chosen:
    """Choose a column for each quantity."""
    found = [one for one in (_picked(column, name) for column, name in _stripped(columns)) if one is not None]
    if any(has_word(column.name, *_SIZES) for column in columns):
        found = [one for one in found if not has_word(one.column.name, "height")]  # of an object
    if any(has_word(column.name, *_NOT_RADARS) for column in columns):
        found = []
    found.sort(key=lambda one: one.order)
    picked: dict[str, Picked] = {}
    sigma: dict[str, Picked] = {}
    for one in found:
        if one.meaning.sigma:
            sigma.setdefault(one.meaning.quantity, one)
        elif not one.meaning.second and not one.meaning.vague:
            picked.setdefault(one.meaning.quantity, one)
    first = [one for one in found if not one.meaning.sigma and not one.meaning.second]
    picked |= _together(first, ("x", "y", "z")) | _together(first, ("vx", "vy", "vz"))
    second = (
        one for one in found if one.meaning.second and one.meaning.quantity == "azimuth" and not one.meaning.sigma
    )
    others = tuple(one.column.name for one in second) if "azimuth" in picked else ()
    vague = _told_apart([one for one in first if one.meaning.vague], picked)
    used = [one.column.name for one in picked.values()]
    unused = tuple(one.column.name for one in first if one.meaning.vague and one.column.name not in used)
    heights = tuple(one.column.name for one in first if one.meaning.quantity == "z" and one.column.filled)
    return Chosen(picked, sigma, vague, others, () if "elevation" in picked else (*unused, *heights))


def _stripped(columns: Sequence[DescribedColumn]) -> list[tuple[DescribedColumn, str]]:
    """Return the columns with their names without a first word that most of them share."""
    firsts = Counter(words_of(column.name)[:1] for column in columns)
    (common, count), *_ = firsts.most_common(1) or [((), 0)]
    shared = len(columns) > 2 and count >= _MOST_OF_THEM * len(columns) and common and meaning_of(common[0]) is None
    return [
        (c, "_".join(words_of(c.name)[1:]) if shared and words_of(c.name)[:1] == common else c.name) for c in columns
    ]


def _picked(column: DescribedColumn, name: str) -> Picked | None:
    meaning = meaning_of(name) or meaning_of(column.name)
    if meaning is None:
        return None
    if meaning.vague and (angle := angle_in(column.comment)):
        meaning = replace(meaning, quantity=angle, vague=False)
    if meaning.unit is not None:
        return Picked(column, meaning, meaning.unit, "name")
    unit = unit_in(column.comment, dimension_of(meaning.quantity), integer=column.integer)
    return Picked(column, meaning, unit, "comment in the definition" if unit else "")


def _together(found: Sequence[Picked], axes: tuple[str, str, str]) -> dict[str, Picked]:
    """Choose x and y (and z) of one position, not of two."""
    stems: dict[tuple[str, ...], dict[str, Picked]] = {}
    for one in found:
        if one.meaning.quantity in axes:
            stems.setdefault(one.stem, {}).setdefault(one.meaning.quantity, one)
    whole = [group for group in stems.values() if axes[0] in group and axes[1] in group]
    return min(whole, key=lambda group: (not group[axes[0]].column.filled, group[axes[0]].order), default={})


def _told_apart(vague: Sequence[Picked], picked: dict[str, Picked]) -> tuple[Picked, ...]:
    """Take phi, theta, angle and the like for azimuth and elevation; return them if there was more than one."""
    if not vague or "azimuth" in picked:
        return ()
    if len(vague) == 1 or "elevation" in picked:
        picked["azimuth"] = vague[0]
        return ()
    first, second = vague[:2]
    if _span(second) > 1.5 * _span(first):
        first, second = second, first  # radars see wider than high
    picked["azimuth"], picked["elevation"] = first, second
    return first, second


def _span(one: Picked) -> float:
    values = one.column.values[np.isfinite(one.column.values)]
    return float(np.ptp(values)) if len(values) else 0.0
