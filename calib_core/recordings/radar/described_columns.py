"""Choose the columns of a message by what their names, comments and values say: meaning, unit, direction."""

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Literal, TypeAlias

import numpy as np

from calib_core.arrays import Values
from calib_core.recordings.field_words import (
    AMBIGUOUS,
    SPELLINGS,
    UNITS_BY_SPELLING,
    Dimension,
    Unit,
    dimension_of,
    has_word,
    named_quantity,
    spelt,
    unit_of_word,
    words_of,
)

_KNOWN = spelt((*SPELLINGS, *AMBIGUOUS))
_LEVELS = ("snr", "intensity", "rcs", "power", "amplitude")
_SIZES = ("width", "length")
_NOT_RADARS = ("curvature", "steering", "steer", "lane", "jerk", "effort", "joint", "wheel", "throttle", "brake")
_MOST_OF_THEM = 0.6
Direction: TypeAlias = Literal["forward", "backward", "left", "right", "up", "down"]
_WORDS: Mapping[str, Direction] = {
    "forward": "forward", "forwards": "forward", "ahead": "forward", "front": "forward", "longitudinal": "forward",
    "boresight": "forward", "backward": "backward", "backwards": "backward", "behind": "backward",
    "left": "left", "right": "right", "up": "up", "upward": "up", "upwards": "up", "down": "down", "downward": "down",
    "downwards": "down",
}  # fmt: skip
_OPPOSITE: Mapping[Direction, Direction] = {
    "forward": "backward", "backward": "forward", "left": "right", "right": "left", "up": "down", "down": "up"
}  # fmt: skip
_ANY = "|".join(sorted(_WORDS, key=len, reverse=True))
_BETWEEN = (
    r"(?:\W+(?:is|are|values?|means?|points?|pointing|axis|direction|side|to|towards|the|of|in|on|sensor|angles?))*\W*"
)
_POSITIVE_SIDE = re.compile(rf"(?P<sign>positive|pos\.|negative|neg\.|\+){_BETWEEN}\b(?P<side>{_ANY})\b", re.IGNORECASE)
_SIDE_POSITIVE = re.compile(rf"\b(?P<side>{_ANY})\b{_BETWEEN}(?P<sign>positive|negative|\+)", re.IGNORECASE)
_LEADS_TO = r"(?:\s*(?:is|points?|pointing|=|:|->|to|towards|the|,|-|\(|\+)\s*)*\s*"
_AXIS = re.compile(rf"(?<![\w.])(?P<axis>[xyz])(?:[ -]?axis)?{_LEADS_TO}\b(?P<side>{_ANY})\b", re.IGNORECASE)
_LEFTWARD = re.compile(r"counter-?\s?clockwise|anti-?\s?clockwise|\bccw\b", re.IGNORECASE)
_RIGHTWARD = re.compile(r"(?<!counter)(?<!counter[- ])(?<!anti)(?<!anti[- ])clockwise|\bcw\b", re.IGNORECASE)
_NEAREST_M, _FARTHEST_M = 4.0, 500.0
"""No recording of a radar ends nearer than the first, and no automotive radar sees farther than the second [m]."""
_USUAL_M = 300.0
"""Of several units that fit, the one is likelier in which nothing lies farther away than this."""
_NEAREST_METRES = 1.0
"""Values in metres are believed to be metres from here on: in cm or mm they would all lie within a finger's width."""
_FASTEST_MPS = 150.0
_ENOUGH = 20
_WIDEST_RAD = math.pi / 2 + 0.1
_ALIKE_RAD = 0.02
_BY_WORD = {word: unit for word, unit in UNITS_BY_SPELLING.items() if unit.dimension != "time"}
_UNIT_WORDS = "|".join(sorted((re.escape(word) for word in _BY_WORD), key=len, reverse=True))
_FACTOR = r"(?:(?P<number>\d+\s*/\s*\d+|\d*\.?\d+(?:e-?\d+)?)\s*\*?\s*)?"
_ALONE = re.compile(rf"{_FACTOR}(?P<unit>{_UNIT_WORDS})", re.IGNORECASE)
_BRACKETS = re.compile(rf"[\[(<{{]\s*(?:in\s+|unit:?\s*)?{_FACTOR}(?P<unit>{_UNIT_WORDS})\s*[\])>}},;]", re.IGNORECASE)
_SAID = re.compile(
    rf"\b(?:in|units?|lsb|scale|factor|resolution|of|per bit)\b\s*(?:is|of|in|:|=)*\s*{_FACTOR}(?P<unit>{_UNIT_WORDS})(?![\w/])",
    re.IGNORECASE,
)
_SCALE = re.compile(
    r"\b(?:lsb|scale|factor|resolution|mult[a-z]+)\D{0,12}(?P<number>\d*\.\d+(?:e-?\d+)?)", re.IGNORECASE
)
_LONG_WORDS = "|".join(sorted((re.escape(word) for word in _BY_WORD if len(word) > 2), key=len, reverse=True))
_LONG_WORD = re.compile(rf"(?<![\w/])(?P<unit>{_LONG_WORDS})(?![\w/])", re.IGNORECASE)
_LIMITS = r"\b(?:max\w*|min\w*|up to|accuracy|precision|limited to{})\b[^,;\])]*"
_OF_FLOATS, _OF_INTEGERS = (re.compile(_LIMITS.format(more), re.IGNORECASE) for more in ("|resolution|step", ""))


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


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


_AXIS_WORDS = _words("x y z long lat vertical height altitude dx dy dz px py pz dlong dlat vx vy vz vlong vlat")


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


def positive_side(comment: str) -> Direction | None:
    """Return the direction in which the values of a field grow, as its comment states it; None if it does not.

    Args:
        comment: such as "azimuth, positive to the left" or "clockwise".
    """
    match = _POSITIVE_SIDE.search(comment) or _SIDE_POSITIVE.search(comment)
    if match:
        side = _WORDS[match["side"].lower()]
        return _OPPOSITE[side] if match["sign"].lower().startswith("neg") else side
    if _LEFTWARD.search(comment):
        return "left"
    return "right" if _RIGHTWARD.search(comment) else None


def axis_side(comment: str) -> Direction | None:
    """Return the direction of an axis that its own comment names alone, such as "forward" or "[m] to the right"."""
    stated = positive_side(comment)
    if stated:
        return stated
    found = {_WORDS[word.lower()] for word in re.findall(rf"\b({_ANY})\b", comment, re.IGNORECASE)}
    return found.pop() if len(found) == 1 else None


def axes_in(remarks: str) -> Mapping[str, Direction]:
    """Return the directions of x, y and z that comments state, such as "x right, y forward, z up".

    Args:
        remarks: the comments of a message or of its elements.
    """
    found: dict[str, Direction] = {}
    for match in _AXIS.finditer(remarks):
        found.setdefault(match["axis"].lower(), _WORDS[match["side"].lower()])
    return found


def angle_in(comment: str) -> Literal["azimuth", "elevation"] | None:
    """Return which angle a comment names; None if none or both."""
    azimuth = re.search(r"azimuth|horizontal|\bbearing\b", comment, re.IGNORECASE)
    elevation = re.search(r"elevation|vertical", comment, re.IGNORECASE)
    if bool(azimuth) == bool(elevation):
        return None
    return "azimuth" if azimuth else "elevation"


@dataclass(frozen=True, slots=True)
class Finding:
    """A unit found by values.

    Attributes:
        unit: the most plausible one.
        certain: whether no other one is plausible.
        why: in a few words.
    """

    unit: Unit
    certain: bool
    why: str


def _unit(word: str) -> Unit:
    unit = unit_of_word(word)
    assert unit is not None
    return unit


def farthest(*columns: Values) -> float:
    """Return the length below which 99 % of the positions or ranges lie; 0 without values."""
    lengths = np.sqrt(sum(np.square(column) for column in columns)) if columns else np.zeros(0)
    lengths = lengths[np.isfinite(lengths) & (lengths > 0)]
    return float(np.quantile(lengths, 0.99)) if len(lengths) else 0.0


def length_unit(largest: float, *, integer: bool) -> Finding:
    """Find the unit of lengths by the largest.

    Args:
        largest: see farthest.
        integer: an integer in any unit may have a factor that nothing states, so it is never certain.
    """
    fitting = [
        _unit(word)
        for word, nearest in (("m", _NEAREST_METRES), ("cm", _NEAREST_M), ("mm", _NEAREST_M))
        if nearest <= largest * _unit(word).scale <= _FARTHEST_M
    ]
    if not fitting:
        return Finding(_unit("m"), False, "no value tells the unit")
    why = f"values up to {largest:.4g}"
    usual = [unit for unit in fitting if largest * unit.scale <= _USUAL_M]
    return Finding((usual or fitting)[0], len(fitting) == 1 and not integer, why)


def angle_unit(angles: Values, *, integer: bool) -> Finding:
    """Find the unit of angles by the largest one."""
    angles = np.abs(angles[np.isfinite(angles)])
    angles = angles[angles > 0]
    largest = float(angles.max(initial=0.0))
    why = f"angles up to {largest:.4g}"
    if integer:
        factor = 1.0 if largest <= 180 else 0.1 if largest <= 1800 else 0.01
        return Finding(_unit("deg").times(factor), False, why)
    if largest > 2 * math.pi:
        return Finding(_unit("deg") if largest <= 360 else _unit("cdeg"), largest <= 360, f"{why} cannot be radians")
    if len(angles) >= _ENOUGH and largest <= _WIDEST_RAD:
        return Finding(_unit("rad"), True, f"no angle above {largest:.2f} in {len(angles)} returns")
    return Finding(_unit("rad") if largest <= math.pi else _unit("deg"), False, f"only {why}")


def speed_unit(speeds: Values, *, integer: bool) -> Finding:
    """Find the unit of speeds; values alone never make it certain."""
    speeds = np.abs(speeds[np.isfinite(speeds)])
    largest = float(np.quantile(speeds, 0.99)) if len(speeds) else 0.0
    word = "cm/s" if integer and largest > _FASTEST_MPS else "m/s"
    return Finding(_unit(word), False, f"values up to {largest:.4g}")


def forward_axis(x: Values, y: Values) -> str:
    """Return "x" or "y" if only its values are never negative while the other's have both signs; else ""."""
    sound = np.isfinite(x) & np.isfinite(y) & ((x != 0) | (y != 0))
    x, y = x[sound], y[sound]
    if len(x) < _ENOUGH:
        return ""
    behind, sideways = np.mean(x < 0), np.mean(y < 0)
    if behind <= 0.01 and 0.1 <= sideways <= 0.9:
        return "x"
    return "y" if sideways <= 0.01 and 0.1 <= behind <= 0.9 else ""


@dataclass(frozen=True, slots=True)
class PolarAgreement:
    """How polar columns agree with Cartesian ones.

    Attributes:
        angle: the angle's unit.
        forward: the axis at angle 0, "x" or "y".
        toward: 1 if the angle grows towards the positive other axis, -1 if away from it.
        ranges_per_length: length of x, y, z per range, 1 if they have the same unit.
    """

    angle: Unit
    forward: str
    toward: int
    ranges_per_length: float


def agreement(angle: Values, distance: Values | None, x: Values, y: Values, z: Values | None) -> PolarAgreement | None:
    """Find the unit, sign and axis order in which an azimuth matches x and y; None if none matches clearly."""
    telling = np.isfinite(angle) & np.isfinite(x) & np.isfinite(y) & (np.abs(angle) > 0) & ((x != 0) | (y != 0))
    if np.count_nonzero(telling) < _ENOUGH // 2:
        return None
    angle, a, b = angle[telling], x[telling], y[telling]
    fits: list[tuple[float, Unit, str, int]] = []
    for word in ("rad", "deg", "mrad", "cdeg"):
        for forward, own in (("x", np.arctan2(b, a)), ("y", np.arctan2(a, b))):
            for toward in (1, -1):
                apart = np.angle(np.exp(1j * (toward * _unit(word).scale * angle - own)))
                fits.append((float(np.median(np.abs(apart))), _unit(word), forward, toward))
    fits.sort(key=lambda fit: fit[0])
    best, second = fits[0], fits[1]
    if best[0] > _ALIKE_RAD or second[0] < 3 * max(best[0], 1e-3):
        return None
    ratio = 1.0
    if distance is not None:
        lengths = np.sqrt(x**2 + y**2 + (0 if z is None else z**2))
        both = np.isfinite(lengths) & np.isfinite(distance) & (lengths > 0) & (distance > 0)
        ratio = float(np.median(lengths[both] / distance[both])) if both.any() else 1.0
    return PolarAgreement(best[1], best[2], best[3], ratio)


def unit_in(comment: str, dimension: Dimension, *, integer: bool = False) -> Unit | None:
    """Return the unit of a dimension that a comment states; None if it states none.

    Understood are the unit alone ("m", "0.01 deg"), in brackets ("range [cm]"), after words such as "in" or "unit:", and long
    words such as "degrees" anywhere. A number counts as a factor only where it cannot be a limit or an accuracy.

    Args:
        comment: of the field.
        dimension: what the unit must measure.
        integer: the field is an integer, whose resolution is its unit.
    """
    text = (_OF_INTEGERS if integer else _OF_FLOATS).sub("", comment).strip(" .,;")
    pieces = [_ALONE.fullmatch(piece.strip()) for piece in re.split("[,;]", text)]
    matches = [*pieces, *_BRACKETS.finditer(text), *_SAID.finditer(text)]
    for match in matches:
        unit = _BY_WORD[match["unit"].casefold()] if match else None
        if match and unit and unit.dimension == dimension:
            return _with_scale(unit.times(_number(match["number"])), text)
    for match in _LONG_WORD.finditer(text):
        unit = _BY_WORD[match["unit"].casefold()]
        if unit.dimension == dimension:
            return _with_scale(unit, text)
    return None


def _with_scale(unit: Unit, text: str) -> Unit:
    """Apply a factor that the comment states apart from the unit, such as "[m], scale 0.1"."""
    factor = _SCALE.search(text)
    return unit.times(float(factor["number"])) if factor and not unit.name[0].isdigit() else unit


def _number(text: str | None) -> float:
    if not text:
        return 1.0
    above, _, below = text.partition("/")
    return float(above) / float(below) if below and float(below) else float(above)
