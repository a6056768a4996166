"""Decide which column of a radar is which quantity in which unit, or refuse with the --map to type.

The one place for it: messages, clouds, tables of CSV and JSON. --map, the registry's layouts, names and comments state what
columns are, values show it. What nothing states is an assumption; where a table's values fit two units alike, it is refused.
"""

import math
import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, TypeAlias, TypeVar

import numpy as np

from calib_core.arrays import Values
from calib_core.errors import OptionError, RecordingError
from calib_core.recordings.containers.sources import CONFIRM_ALL, Assumption
from calib_core.recordings.field_words import (
    OPPOSITE,
    Direction,
    MappedColumn,
    Meaning,
    Unit,
    angle_in,
    axes_in,
    axis_side,
    column_meaning,
    dimension_of,
    has_word,
    is_plain,
    meaning_of,
    positive_side,
    unit_in,
    unit_of_word,
    units_for,
    words_in,
    words_of,
)
from calib_core.recordings.radar.column_plan import (
    NOTHING_STATED,
    ColumnAssumption,
    ColumnPlan,
    ColumnReading,
    RadarAxes,
    StatedReading,
)
from calib_core.recordings.radar.registry import NO_QUANTITY, Decoder, MessageKind, find_decoder

_T = TypeVar("_T")
Rules: TypeAlias = Literal["message", "ros", "table"]
"""Who defines units and axes that no column states: nobody, ROS (REP 103), or nobody and the names are those of a table."""
FARTHEST_M = 1000.0
"""No radar returns lie farther away."""
_CLOUD_KINDS: tuple[MessageKind, ...] = ("cloud", "channels")
_SIZES = ("width", "length")
_NOT_RADARS = ("curvature", "steering", "steer", "lane", "jerk", "effort", "joint", "wheel", "throttle", "brake")
_MOST_OF_THEM = 0.6
_NEAREST_M, _FARTHEST_M = 4.0, 500.0
"""No recording of a radar ends nearer than the first, and no automotive radar sees farther than the second [m]."""
_USUAL_M = 300.0
"""Of several units that fit, the one is likelier in which nothing lies farther away than this."""
_NEAREST_METRES = 1.0
"""Values in meters are believed to be meters from here on: in cm or mm they would all lie within a finger's width."""
_FASTEST_MPS = 150.0
_FEW = 5
_ENOUGH = 20
_WIDEST_RAD = math.pi / 2 + 0.1
_WIDE_RAD = 1.75
"""Larger angles are in radians only if the radar sees more than a hemisphere, and may be a few degrees [rad]."""
_ALIKE_RAD = 0.02
_MOST_SENSORS = 8
_AXIS_WORDS = words_in("x y z long lat vertical height altitude dx dy dz px py pz dlong dlat vx vy vz vlong vlat")
_AXES = {"x": "y", "y": "x"}
_OF_POSITIONS = words_in("pose position pos point")
_PLANES = {"forward": 0, "backward": 0, "left": 1, "right": 1, "up": 2, "down": 2}
_AS_MAPPED = {
    "forward": ("x", ""), "backward": ("x", "-"), "left": ("y", ""), "right": ("y", "-"), "up": ("z", ""), "down": ("z", "-"),
}  # fmt: skip
_POLAR = ("range", "azimuth", "elevation")
_INVALID_POSITION = ("invalid_distance", "invalid_range", "invalid_azimuth", "invalid_elevation")
_INVALID_DOPPLER = ("invalid_range_rate", "invalid_doppler", "invalid_velocity")
VALID = ("valid", "is_valid", "b_valid", "measured", "is_measured")
"""Flags that are 0 where a slot of a list holds no return."""
_LONGEST_NAME = 500
"""No name of a column is longer; the patterns take the cube of the length of what is none."""
_IN_BRACKETS = re.compile(r"(?P<name>.*?)\s*[\[(<]\s*(?P<unit>[^\])>]*?)\s*[\])>]\s*")
_ROS = "ROS defines it (REP 103)"
_COMMENT = "comment in the definition"
_NOUNS: Mapping[Rules, str] = {"message": "message", "ros": "message", "table": "file"}


@dataclass(frozen=True, slots=True, eq=False)
class DescribedColumn:
    """One number of a return, as the message or table describes it.

    Attributes:
        name: dotted, or as the table writes it.
        integer: whether its values are integers.
        comment: of the definition; in a table its unit in brackets, if it has one.
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
class ColumnMatch:
    """A column and what it means.

    Attributes:
        column: the column.
        meaning: of its name.
        unit: that its name or comment states; None if neither does.
        why: where the unit is stated; "" if it is not.
        plain: a table's column with the name of the documentation, whose axes are those of the documentation.
        mapped: the --map that chose it; None if its name did.
        named: whether its name says so.
    """

    column: DescribedColumn
    meaning: Meaning
    unit: Unit | None
    why: str
    plain: bool = False
    mapped: MappedColumn | None = None
    named: bool = True

    @property
    def sign(self) -> int:
        """-1 where --map turns its sign; its values are turned already."""
        return self.mapped.sign if self.mapped else 1

    @property
    def name(self) -> str:
        """The column's name."""
        return self.column.name

    @property
    def quantity(self) -> str:
        """What it measures."""
        return self.meaning.quantity

    @property
    def order(self) -> tuple[int, bool, int, int, str]:
        """The order of preference: plain names first; it does not depend on the order of the fields."""
        return self.meaning.rank, not self.column.filled, len(words_of(self.name)), len(self.name), self.name

    @property
    def stem(self) -> tuple[str, ...]:
        """The words of the name other than the axis, which x, y and z of one position share."""
        return tuple(word for word in words_of(self.name) if word not in _AXIS_WORDS)


@dataclass(frozen=True, slots=True, eq=False)
class ColumnChoice:
    """The columns in use by quantity.

    Attributes:
        matched: by quantity.
        sigma: standard deviations by quantity.
        vague: angles whose names fit azimuth and elevation alike, if they had to be told apart.
        other_azimuths: columns with further hypotheses.
        unused_heights: columns that may hold the elevation or height of a polar position, if none is sure to.
        rivals: of quantities of a position, other columns with as plain a name.
    """

    matched: dict[str, ColumnMatch]
    sigma: dict[str, ColumnMatch]
    vague: tuple[ColumnMatch, ...] = ()
    other_azimuths: tuple[str, ...] = ()
    unused_heights: tuple[str, ...] = ()
    rivals: Mapping[str, str] = field(default_factory=dict)


def guess_columns(
    columns: Sequence[DescribedColumn],
    remarks: str = "",
    *,
    rules: Rules = "message",
    stated: StatedReading = NOTHING_STATED,
    decoder: Decoder | None = None,
) -> ColumnPlan | None:
    """Plan the columns of a radar by names, comments and values; None if they do not look like a radar's.

    Args:
        columns: the numbers of one return.
        remarks: comments of the definition that belong to no field.
        rules: what defines the units and axes that the columns do not state.
        stated: what the user states.
        decoder: the layout of the registry that the message has; None if it has none.

    Raises:
        RecordingError: the values of a table fit two units alike; the message has the --map that says which.
        OptionError: the user maps half a position, or the time of a message.
    """
    chosen = choose(columns, rules, stated, decoder)
    matched = chosen.matched
    if rules == "message" and not decoder and not stated.column_map and not _looks_like_radar(matched):
        return None
    cartesian, polar = {"x", "y"} <= matched.keys(), {"range", "azimuth"} <= matched.keys()
    unfilled = cartesian and not (matched["x"].column.filled or matched["y"].column.filled)
    guess = _UnitInference(chosen, remarks, rules, stated, decoder)
    if cartesian and not (polar and unfilled):
        plan = guess.cartesian()
    elif polar:
        plan = guess.polar()
    else:
        _refuse_half_a_position(stated, matched, rules)
        return None
    return guess.flags(guess.amplitude(guess.speed(guess.noise(plan))), columns)


def _refuse_half_a_position(stated: StatedReading, matched: Collection[str], rules: Rules) -> None:
    """Refuse a --map of a message that has no position with it.

    Raises:
        OptionError: it has not.
    """
    given = {one.quantity for one in stated.column_map}
    if not given or rules == "table":
        return
    whole = next((pair for pair in (("x", "y"), _POLAR[:2]) if not given.isdisjoint(pair)), ())
    for quantity in whole:
        if quantity not in matched:
            raise OptionError(
                f"--map: {quantity} is not known; add --map {quantity}=COLUMN:{units_for(quantity)[0].flag}"
            )
    raise OptionError("--map: say where the position is: x and y, or range and azimuth")


def _looks_like_radar(matched: Mapping[str, ColumnMatch]) -> bool:
    """Return whether there is a position, and something that only radars measure."""
    if {"range", "azimuth"} <= matched.keys():
        return True
    if not {"x", "y"} <= matched.keys():
        return False
    amplitude = "amplitude" in matched and matched["amplitude"].meaning.rank != 1
    plain = matched["x"].meaning.rank == 0 and _OF_POSITIONS.issuperset(matched["x"].stem)
    speed = "doppler" in matched and (plain or matched["doppler"].meaning.kind == "radial")
    return amplitude or speed or {"vx", "vy"} <= matched.keys()


def choose(
    columns: Sequence[DescribedColumn],
    rules: Rules = "message",
    stated: StatedReading = NOTHING_STATED,
    decoder: Decoder | None = None,
) -> ColumnChoice:
    """Choose a column for each quantity."""
    matches = _matches(columns, rules, stated, decoder)
    matches.sort(key=lambda one: one.order)
    matched: dict[str, ColumnMatch] = {}
    sigma: dict[str, ColumnMatch] = {}
    for one in matches:
        if one.meaning.sigma:
            sigma.setdefault(one.quantity, one)
        elif not one.meaning.second and one.meaning.kind != "vague":
            matched.setdefault(one.quantity, one)
    first = [one for one in matches if not one.meaning.sigma and not one.meaning.second]
    matched |= _columns_of_one_position(first, ("x", "y", "z")) | _columns_of_one_position(first, ("vx", "vy", "vz"))
    numbered = [one for one in matches if one.meaning.numbered and one.quantity == "azimuth" and not one.meaning.sigma]
    azimuth = matched.get("azimuth")
    second = [one for one in numbered if one.meaning.kind != "vague" or (azimuth is not None and one.meaning.second)]
    has_first = azimuth is not None or {"x", "y"} <= matched.keys()
    others = tuple(one.name for one in second if has_first and one is not azimuth)
    stating = any(one.mapped and one.quantity in _POLAR for one in matches)
    vague = [one for one in first if one.meaning.kind == "vague" and not stating]
    assigned = _assign_vague_angles(vague, matched)
    used = [value.name for value in matched.values()]
    unused = tuple(one.name for one in vague if one.name not in used)
    heights = tuple(one.name for one in first if one.quantity == "z" and one.column.filled)
    rivals: dict[str, str] = {}
    for one in first if rules == "table" else ():
        own = matched[one.quantity]
        if one is not own and one.quantity in ("x", "y", "z", *_POLAR) and (one.unit is None) == (own.unit is None):
            rivals[one.quantity] = ", ".join(filter(None, (rivals.get(one.quantity), one.name)))
    return ColumnChoice(matched, sigma, assigned, others, () if "elevation" in matched else (*unused, *heights), rivals)


def _matches(
    columns: Sequence[DescribedColumn], rules: Rules, stated: StatedReading, decoder: Decoder | None
) -> list[ColumnMatch]:
    """Return the columns that --map and the registry choose, and of other quantities those whose names mean something."""
    given = {one.column: one for one in stated.column_map}
    taken = {value.quantity for value in given.values()}
    ruled = {} if decoder is None else {name.lower(): what for what, name in decoder.columns.items()}
    own = {name: what for name, what in ruled.items() if what not in taken}
    taken.update(own.values())
    if not taken.isdisjoint(_POLAR[:2]) and taken.isdisjoint("xy"):
        taken |= set("xyz")  # it is said what to use
    of_table = rules == "table"
    meanings = _meanings_in_table(columns, stated) if of_table else _meanings_in_message(columns, rules, decoder)
    found = []
    for column, meaning in zip(columns, meanings, strict=True):
        one, quantity, named = given.get(column.name), own.get(column.name.lower(), ""), True
        if one or quantity:
            quantity = one.quantity if one else quantity
            bare = quantity.removeprefix("sigma_")
            named = bare in (ruled.get(column.name.lower()), meaning.quantity if meaning else "")
            unit = _unit(one.unit) if one and one.unit else meaning.unit if meaning and named else None
            meaning = Meaning(bare, -1, unit, sigma=bare != quantity)
            column = replace(column, values=one.sign * column.values) if one else column
        elif meaning is None or f"{'sigma_' * meaning.sigma}{meaning.quantity}" in taken:
            continue
        why = f"--map {one.words}" if one else "name"
        if meaning.unit is None and not of_table:
            unit = unit_in(column.comment, dimension_of(meaning.quantity), integer=column.integer)
            meaning, why = replace(meaning, unit=unit), _COMMENT
        plain = one is not None or is_plain(split_unit(column.name)[0], meaning)
        found.append(ColumnMatch(column, meaning, meaning.unit, why if meaning.unit else "", plain, one, named))
    return found


def _meanings_in_message(
    columns: Sequence[DescribedColumn], rules: Rules, decoder: Decoder | None
) -> list[Meaning | None]:
    """Return what the names of fields mean; nothing if one of them is not a radar's."""
    foreign = rules == "message" and not decoder and any(has_word(column.name, *_NOT_RADARS) for column in columns)
    of_objects = any(has_word(column.name, *_SIZES) for column in columns)
    found: list[Meaning | None] = []
    for column, name in _without_common_word(columns):
        meaning = None if foreign else meaning_of(name) or meaning_of(column.name)
        if meaning and meaning.kind == "vague" and (angle := angle_in(column.comment)):
            meaning = replace(meaning, kind=angle)
        found.append(None if of_objects and has_word(column.name, "height") else meaning)
    return found


def _without_common_word(columns: Sequence[DescribedColumn]) -> list[tuple[DescribedColumn, str]]:
    """Return the columns with their names without a first word that most of them share."""
    firsts = Counter(words_of(column.name)[:1] for column in columns)
    (common, count), *_ = firsts.most_common(1) or [((), 0)]
    shared = len(columns) > 2 and count >= _MOST_OF_THEM * len(columns) and common and meaning_of(common[0]) is None
    return [
        (c, "_".join(words_of(c.name)[1:]) if shared and words_of(c.name)[:1] == common else c.name) for c in columns
    ]


def _meanings_in_table(columns: Sequence[DescribedColumn], stated: StatedReading) -> list[Meaning | None]:
    """Return what the names of a table's columns mean; a stated unit is preferred to a plainer name."""
    degrees, found = stated.axes.degrees if stated.axes else None, []
    for column in columns:
        meaning = table_meaning(column.name, column.comment)
        if meaning is not None:
            unit = meaning.unit
            if unit is None and degrees is not None and not meaning.sigma and meaning.quantity in _POLAR[1:]:
                unit = _unit("deg" if degrees else "rad")
            plain = is_plain(split_unit(column.name)[0], meaning)
            meaning = replace(meaning, unit=unit, rank=meaning.rank + (not plain) + 10 * (unit is None))
        found.append(meaning)
    return found


def table_meaning(written: str, unit_below: str = "") -> Meaning | None:
    """Return what a column of a table means, with its unit; None if nothing, or if its unit is not one of the quantity's.

    Args:
        written: its name, with or without a unit in brackets.
        unit_below: from a line of units under the header.
    """
    name, stated = split_unit(written)
    found, stated = column_meaning(name), stated or unit_below
    if found is None or not stated or found.unit:
        return found
    unit = unit_of_word(stated)
    return replace(found, unit=unit) if unit and unit.dimension == dimension_of(found.quantity) else None


def unknown_unit(written: str, unit_below: str = "") -> tuple[str, str] | None:
    """Return the quantity and the unit of a column such as x_ft or "x [ft]" whose unit is unknown; None for any other."""
    name, stated = split_unit(written)
    stated, words = stated or unit_below, re.split(r"[^A-Za-z0-9]+", name)
    if not stated and len(words) == 2 and column_meaning(name) is None:
        name, stated = words
    meaning = column_meaning(name) if stated else None
    if meaning and not is_plain(name, meaning) and name != split_unit(written)[0]:
        return None
    known = meaning is None or (not stated.isdigit() and table_meaning(name, stated) is not None)
    return None if meaning is None or known else (meaning.quantity, stated.lower())


def split_unit(written: str) -> tuple[str, str]:
    """Return the name of a table's column without its marks, and its unit in brackets, "" without one."""
    text = written[:_LONGEST_NAME].strip().strip("#%\"'\ufeff ").strip()
    bracketed = _IN_BRACKETS.fullmatch(text)
    return (bracketed["name"], bracketed["unit"].strip()) if bracketed else (text, "")


def _columns_of_one_position(matches: Sequence[ColumnMatch], axes: tuple[str, str, str]) -> dict[str, ColumnMatch]:
    """Choose x and y (and z) of one position, not of two."""
    stems: dict[tuple[str, ...], dict[str, ColumnMatch]] = {}
    for matched in matches:
        if matched.quantity in axes:
            stems.setdefault(matched.stem, {}).setdefault(matched.quantity, matched)
    whole = [group for group in stems.values() if axes[0] in group and axes[1] in group]
    return min(whole, key=lambda group: (not group[axes[0]].column.filled, group[axes[0]].order), default={})


def _assign_vague_angles(vague: Sequence[ColumnMatch], matched: dict[str, ColumnMatch]) -> tuple[ColumnMatch, ...]:
    """Take phi, theta, angle and the like for azimuth and elevation; return them if there was more than one."""
    if not vague or "azimuth" in matched:
        return ()
    if len(vague) == 1 or "elevation" in matched:
        matched["azimuth"] = vague[0]
        return ()
    first, second = vague[:2]
    if _span(second) > 1.5 * _span(first):
        first, second = second, first  # radars see wider than high
    matched["azimuth"], matched["elevation"] = first, second
    return first, second


def _span(match: ColumnMatch) -> float:
    values = match.column.values[np.isfinite(match.column.values)]
    return float(np.ptp(values)) if len(values) else 0.0


class _UnitInference:
    """The units, directions and assumptions of chosen columns."""

    def __init__(
        self, chosen: ColumnChoice, remarks: str, rules: Rules, stated: StatedReading, decoder: Decoder | None
    ) -> None:
        self.matched, self.chosen, self.remarks, self.decoder = chosen.matched, chosen, remarks, decoder
        self.directed = stated.axes is not None and stated.axes.directed
        self.rule = f"layout '{decoder.name}'" if decoder else _ROS
        self.rules, self.of_table, self.noun = rules, rules == "table", _NOUNS[rules]
        self.agreed = _agreement(chosen.matched)

    def _is_ruled(self, group: Sequence[ColumnMatch]) -> bool:
        """Return whether the registry or ROS defines the units and axes of columns."""
        return (self.decoder is not None or self.rules == "ros") and all(one.named for one in group)

    def _known_by(self, unit: str, direction: str = "") -> str:
        """Return what states the unit and the direction of a column."""
        if unit == self.rule and direction.partition(": ")[2] in ("", self.rule):
            return self.rule
        return "; ".join(filter(None, (f"unit: {unit}", direction)))

    def cartesian(self) -> ColumnPlan:
        """Plan a position from x, y and perhaps z."""
        group = tuple(self.matched[axis] for axis in "xyz" if axis in self.matched)
        standard = self._is_ruled(group) or all(one.column.standard for one in group)
        directions, reasons, about_axes = self._directions(group, standard=standard)
        sides = () if self.of_table else directions
        units, why, about = self._lengths(group, standard=standard, proven=self._by_range(), sides=sides)
        readings = [
            ColumnReading(
                one.quantity, one.name, unit.name, direction, self._known_by(one.why or why, f"direction: {reason}")
            )
            for one, unit, direction, reason in zip(group, units, directions, reasons, strict=False)
        ]
        scales = _three([one.sign * unit.scale for one, unit in zip(group, units, strict=True)], 1.0)
        claimed = [one if one and one.meaning.kind != "vague" else None for one in map(self.matched.get, _POLAR)]
        angle = self._claimed_angle(readings)
        usual = (units[0], angle, claimed[1].unit if claimed[1] and claimed[1].unit else angle)
        return ColumnPlan(
            position=tuple(one.name for one in group),
            polar=False,
            scales=scales,
            directions=directions,
            claimed=_three([one.name if one else None for one in claimed], None),
            claimed_scales=_three(
                [((one and one.unit) or unit).scale for one, unit in zip(claimed, usual, strict=False)], 1.0
            ),
            other_azimuths=self.chosen.other_azimuths,
            readings=tuple(readings),
            assumptions=(*_present(about, about_axes), *self._rival_assumptions(group, units)),
        )

    def _claimed_angle(self, readings: list[ColumnReading]) -> Unit:
        """Return the unit of an azimuth beside x and y that states none; say of a table's what shows it."""
        azimuth = self.matched.get("azimuth")
        if self.agreed is None:
            by_size = self.of_table and azimuth is not None
            return _angle_unit(azimuth.column.values, integer=False).unit if by_size and azimuth else _unit("rad")
        if self.of_table and azimuth and azimuth.unit is None:
            why = "unit: it agrees with the positions"
            readings.append(ColumnReading("azimuth", azimuth.name, self.agreed.angle.name, "", why))
        return self.agreed.angle

    def polar(self) -> ColumnPlan:
        """Plan a position from range, azimuth and perhaps elevation."""
        distance, azimuth, elevation = self.matched["range"], self.matched["azimuth"], self.matched.get("elevation")
        (unit,), why, about = self._lengths((distance,), standard=self.decoder is not None and distance.named)
        angles = tuple(_present(azimuth, elevation))
        angle, why_angle, about_angle = self._angle(angles)
        sign, why_sign, about_sign = self._azimuth_sign(azimuth, angle)
        units = [one.unit or angle for one in angles]
        degrees = "deg" in angle.name
        base = _unit("deg" if degrees else "rad").scale
        scales = [one.sign * (unit.scale / base) for one, unit in zip(angles, units, strict=True)]
        down = elevation is not None and positive_side(elevation.column.comment) == "down"
        if down:
            scales[-1] = -scales[-1]
        side = f"to the {'left' if sign > 0 else 'right'}"
        readings = [
            ColumnReading("range", distance.name, unit.name, "", self._known_by(why)),
            ColumnReading("azimuth", azimuth.name, units[0].name, side, self._known_by(why_angle, f"sign: {why_sign}")),
        ]
        if elevation is not None:
            side, why = ("downwards", _COMMENT) if down else ("upwards", self.rule if self.decoder else "as usual")
            why = self._known_by(why_angle, f"sign: {why}")
            readings.append(ColumnReading("elevation", elevation.name, units[-1].name, side, why))
        vague, unused = self._vague_assumption(), self._unused_assumption()
        return ColumnPlan(
            position=tuple(one.name for one in (distance, *angles)),
            polar=True,
            degrees=degrees,
            azimuth_sign=float(sign),
            scales=_three([distance.sign * unit.scale, *scales], 1.0),
            claimed=(distance.name, azimuth.name, elevation.name if elevation else None),
            claimed_scales=(unit.scale, scales[0], scales[-1]),
            other_azimuths=self.chosen.other_azimuths,
            readings=tuple(readings),
            assumptions=(
                *_present(about, about_angle, about_sign, vague, unused),
                *self._rival_assumptions((distance, *angles), (unit, *units)),
            ),
        )

    def _lengths(
        self,
        group: tuple[ColumnMatch, ...],
        *,
        standard: bool,
        proven: "Finding | None" = None,
        sides: tuple[str, ...] = (),
    ) -> tuple[list[Unit], str, ColumnAssumption | None]:
        """Return the unit of each column of a position or range, what states it, and what is assumed."""
        stated = next((one.unit for one in group if one.unit), None)
        scales = ((one.unit or stated or _unit("m")).scale for one in group)
        largest = farthest(*(one.column.values * scale for one, scale in zip(group, scales, strict=True)))
        but = (
            f"they would reach {largest:.4g} m, which is too far" if largest > FARTHEST_M and not self.of_table else ""
        )
        integer = any(one.column.integer for one in group)
        finding = proven or _length_unit(farthest(*(one.column.values for one in group)), integer=integer)
        certain = finding is proven or (finding.certain and not self.of_table and all(one.named for one in group))
        ruled = _unit("m") if standard and not but else None
        unit, why, about = self._decided("length-unit", group, finding, ruled, certain=certain, but=but, sides=sides)
        return [one.unit or unit for one in group], why, about

    def _decided(
        self,
        key: str,
        group: tuple[ColumnMatch, ...],
        finding: "Finding",
        ruled: Unit | None,
        *,
        certain: bool,
        but: str = "",
        sides: tuple[str, ...] = (),
    ) -> tuple[Unit, str, ColumnAssumption | None]:
        """Return the unit of columns, what states it, and what is assumed.

        Args:
            key: of the assumption.
            group: the columns, of which one may state the unit.
            finding: by their values.
            ruled: the unit by the registry or ROS; None if neither defines it.
            certain: whether the values leave no doubt.
            but: how the values contradict a stated unit; "" if they do not.
            sides: where x, y and z point.
        """
        stated = next((one for one in group if one.unit), None)
        unit, names = (stated.unit if stated else None) or ruled, ", ".join(one.name for one in group)
        if unit is not None:
            why = stated.why if stated else self.rule
            text = f"{_are(names)} taken as {unit.name} ({why}), although {but}"
            return unit, why, self._unit_assumption(key, text, group, unit, sides) if but else None
        if certain:
            return finding.unit, finding.why, None
        self._refuse_either(group, finding)
        text = self._by_values(names, finding)
        return finding.unit, "assumed", self._unit_assumption(key, text, group, finding.unit, sides)

    def _by_values(self, names: str, finding: "Finding") -> str:
        """Say which unit is assumed."""
        return f"{_are(names)} taken as {finding.unit.name} ({finding.why}); the {self.noun} does not state the unit"

    def _refuse_either(self, group: Sequence[ColumnMatch], finding: "Finding") -> None:
        """Refuse a table whose values fit two units alike."""
        if self.of_table and finding.rival is not None:
            maps = (" ".join(_map(match, unit) for match in group) for unit in (finding.unit, finding.rival))
            names, why = ", ".join(match.name for match in group), finding.why.removesuffix(" cannot be radians")
            raise RecordingError(
                f"the unit of {names} is not stated, and {why} may be {finding.unit.name} or {finding.rival.name}: "
                f"say which with {' or '.join(maps)}"
            )

    def _unit_assumption(
        self, key: str, text: str, group: Sequence[ColumnMatch], unit: Unit, sides: tuple[str, ...] = ()
    ) -> ColumnAssumption:
        """Return the assumption of a unit; of a position that has directions, confirmed in the radar's own axes."""
        targets = [_AS_MAPPED[side] for side in sides[: len(group)]] if sides else [(one.quantity, "") for one in group]
        maps = " ".join(_map(one, unit, *target) for one, target in zip(group, targets, strict=True))
        quantities = tuple(one.quantity for one in group)
        return _assume(key, text, maps if unit.flag else CONFIRM_ALL, quantities, angle_unit=key == "angle-unit")

    def _by_range(self) -> "Finding | None":
        """Find the unit of x, y and z by a range whose unit is stated."""
        distance = self.matched.get("range")
        if distance is None or distance.unit is None or not (self.of_table or self.agreed):
            return None
        lengths = np.sqrt(sum(np.square(self.matched[axis].column.values) for axis in "xyz" if axis in self.matched))
        with np.errstate(all="ignore"):
            ratio = distance.column.values * distance.unit.scale / lengths
        ratio = ratio[np.isfinite(ratio) & (ratio > 0)]
        for unit in units_for("range") if len(ratio) >= _FEW else ():
            if np.median(np.abs(ratio / unit.scale - 1.0)) < 0.05:
                return Finding(unit, True, f"their length equals {distance.name}")
        return None

    def _directions(
        self, group: tuple[ColumnMatch, ...], *, standard: bool
    ) -> tuple[tuple[str, str, str], list[str], ColumnAssumption | None]:
        """Return where x, y and z point, what states each, and what is assumed."""
        if all(one.mapped for one in group[:2]) and not self.of_table:
            return ("forward", "left", "up"), ["--map"] * 3, None
        if self.of_table:
            return self._documented_directions(group)
        if self.decoder:
            return ("forward", "left", "up"), [self.rule] * 3, None
        said = dict(axes_in(self.remarks)) | {
            one.quantity: side for one in group if (side := axis_side(one.column.comment)) is not None
        }
        whole = _whole(said)
        if whole:
            return (
                whole,
                [_COMMENT, _COMMENT, _COMMENT if "z" in said else "as usual"],
                _up_assumption(group, said, whole),
            )
        if standard:
            return ("forward", "left", "up"), [self.rule] * 3, None
        forward, why = self._forward(group, said)
        lateral = _AXES[forward]
        side, why_side = self._side(lateral, forward, said)
        sides: dict[str, Direction] = {forward: said.get(forward, "forward"), lateral: side}
        reasons = {forward: why, lateral: why_side or "assumed"}
        directions = (sides["x"], sides["y"], "up")
        if why != "assumed" and why_side:
            return directions, [reasons["x"], reasons["y"], "as usual"], _up_assumption(group, said, directions)
        x, y = (one.name for one in group[:2])
        known = f" (forward: {why})" if why != "assumed" else ""
        text = (
            f"{x} is taken as {directions[0]} and {y} as {directions[1]}{known}; the message does not state whether "
            f"{(x, y)[lateral == 'y']} grows to the left or to the right"
        )
        about = _assume("axes", text, f"--radar-axes {','.join(directions)}", ("x", "y"), axes=True)
        return directions, [reasons["x"], reasons["y"], "as usual"], about

    def _documented_directions(
        self, group: tuple[ColumnMatch, ...]
    ) -> tuple[tuple[str, str, str], list[str], ColumnAssumption | None]:
        """Return the axes of the documentation, unless the values of a table show that x points to the right."""
        x, y = group[:2]
        directions, why = ("forward", "left", "up"), ["as documented"] * 3
        if self.directed:
            return directions, why, None
        if forward_axis(x.column.values, y.column.values) == "y":
            directions = ("right", "forward", "up")
            text = f"{y.name} is never negative and {x.name} has both signs; read as {x.name} to the right, {y.name} forward"
            return directions, ["assumed"] * 3, _assume("axes", text, "--radar-axes right,forward,up", (), axes=True)
        other = tuple(one.quantity for one in (x, y) if not one.plain)
        if not other:
            return directions, why, None
        text = f"the directions of {x.name} and {y.name} are not stated; taken as forward and to the left"
        return directions, ["assumed"] * 3, _assume("axes", text, "--radar-axes forward,left,up", other, axes=True)

    def _forward(self, group: tuple[ColumnMatch, ...], said: Mapping[str, Direction]) -> tuple[str, str]:
        """Return the forward axis, and what states it."""
        for axis in ("x", "y"):
            if said.get(axis) in ("forward", "backward"):
                return axis, _COMMENT
            if said.get(axis) in ("left", "right"):
                return _AXES[axis], _COMMENT
        if group[0].meaning.kind in ("longitudinal", "lateral"):
            return "x", "name"
        if self.agreed is not None:
            return self.agreed.forward, "its azimuth is 0 there"
        axis = forward_axis(group[0].column.values, group[1].column.values)
        return (axis, "its values are never negative") if axis else ("x", "assumed")

    def _side(self, lateral: str, forward: str, said: Mapping[str, Direction]) -> tuple[Direction, str]:
        """Return where the lateral axis points, and what states it; "" if nothing does."""
        if said.get(lateral) in ("left", "right"):
            return said[lateral], _COMMENT
        azimuth = self.matched.get("azimuth")
        turn = positive_side(azimuth.column.comment) if azimuth else None
        if self.agreed is not None and azimuth and turn in ("left", "right"):
            return (turn if self.agreed.toward > 0 else OPPOSITE[turn]), f"{azimuth.name} grows to the {turn}"
        return ("left" if forward == "x" else "right"), ""

    def _angle(self, angles: tuple[ColumnMatch, ...]) -> tuple[Unit, str, ColumnAssumption | None]:
        """Return the unit of angles, what states it, and what is assumed."""
        stated = next((angle for angle in angles if angle.unit), None)
        finding = _angle_unit(angles[0].column.values, integer=angles[0].column.integer)
        but = ""
        if stated and stated.unit:
            unstated = [angle for angle in angles if angle.unit is None]
            if unstated and stated.unit.name not in ("rad", "deg"):
                self._refuse_either(unstated, Finding(stated.unit, False, f"values beside {stated.name}", _unit("deg")))
            if not (self.of_table or stated.mapped) and _implausible(angles[0], stated.unit, finding):
                but = f"the values look like {finding.unit.name}: {finding.why}"
        certain = finding.certain and not (self.of_table and finding.unit.name == "rad")
        decoder = self.decoder if all(angle.named for angle in angles) else None
        ruled = _unit("deg" if decoder.degrees else "rad") if decoder else None
        return self._decided("angle-unit", angles, finding, ruled, certain=certain, but=but)

    def _azimuth_sign(self, azimuth: ColumnMatch, angle: Unit) -> tuple[int, str, ColumnAssumption | None]:
        if azimuth.mapped:
            return 1, f"--map {azimuth.mapped.words}", None
        if self.decoder:
            return self.decoder.azimuth_sign, self.rule, None
        side = positive_side(azimuth.column.comment)
        if side not in ("left", "right") and "azimuth" in self.remarks.lower():
            line = next(line for line in self.remarks.splitlines() if "azimuth" in line.lower())
            side = positive_side(line)
        if side in ("left", "right"):
            return (1 if side == "left" else -1), _COMMENT, None
        name = azimuth.name
        if self.of_table and self.directed:
            return 1, "--radar-axes", None
        if self.of_table and azimuth.unit and name == f"azimuth_{azimuth.unit.flag}":
            return 1, "as documented", None
        text = f"{name} is taken as growing to the left; the {self.noun} does not state it"
        confirm = _map(azimuth, angle)
        confirm += "" if self.of_table else f" (azimuth=-{name}{_flag(angle)} if it grows to the right)"
        return 1, "assumed", _assume("azimuth-sign", text, confirm, ("azimuth",), axes=True)

    def _unused_assumption(self) -> ColumnAssumption | None:
        if not self.chosen.unused_heights:
            return None
        names = ", ".join(self.chosen.unused_heights)
        text = f"the returns are taken as level with the radar; {names} may hold their elevation or height, and is not used"
        return _assume("field-meaning", text, CONFIRM_ALL, ("elevation",))

    def _vague_assumption(self) -> ColumnAssumption | None:
        if not self.chosen.vague:
            return None
        first, second = (one.name for one in self.chosen.vague)
        text = (
            f"{first} is taken as the azimuth and {second} as the elevation; the message does not state which is which"
        )
        return _assume(
            "field-meaning", text, f"--map azimuth={first} --map elevation={second}", ("azimuth", "elevation")
        )

    def _rival_assumptions(self, group: Sequence[ColumnMatch], units: Sequence[Unit]) -> list[ColumnAssumption]:
        """State which of two columns of a table with the same meaning is used."""
        return [
            _assume(
                "field-meaning",
                f"{one.name} is read as the {one.quantity}, not {rivals}",
                _map(one, unit),
                (one.quantity,),
            )
            for one, unit in zip(group, units, strict=True)
            if (rivals := self.chosen.rivals.get(one.quantity))
        ]

    def noise(self, plan: ColumnPlan) -> ColumnPlan:
        """Add the standard deviations of range and angles."""
        matches = [self.chosen.sigma.get(name) for name in _POLAR]
        by_rule = self.rules != "message" or self.decoder is not None
        if not any(matches) or not (plan.polar or by_rule or any(one and one.mapped for one in matches)):
            return plan
        base = _unit("deg" if plan.degrees else "rad").scale
        usual = (
            (plan.scales[0], abs(plan.scales[1]) * base, abs(plan.scales[2]) * base)
            if plan.polar
            else plan.claimed_scales
        )
        own = [
            (matched.unit.scale if matched and matched.unit else scale)
            for matched, scale in zip(matches, usual, strict=True)
        ]
        assumed, names = [], ", ".join(one.name for one in _present(*matches))
        for name, one, scale in zip(_POLAR, matches, own, strict=True):
            if one and not one.unit and self.of_table:
                unit = next((unit for unit in units_for(name) if math.isclose(unit.scale, scale)), units_for(name)[0])
                text = f"{one.name} is taken as {unit.name}; the file does not state the unit"
                assumed.append(_assume("noise-unit", text, _map(one, unit, f"sigma_{name}"), (f"sigma_{name}",)))
        return replace(
            plan,
            sigma=_three([matched.name if matched else None for matched in matches], None),
            sigma_scales=(own[0], own[1] / base, own[2] / base),
            readings=(
                *plan.readings,
                *([ColumnReading("noise", names, "", "", self.rule)] if by_rule and not self.of_table else ()),
            ),
            assumptions=(*plan.assumptions, *assumed),
        )

    def speed(self, plan: ColumnPlan) -> ColumnPlan:
        """Add the speed."""
        doppler = self.matched.get("doppler")
        group = (
            (doppler,) if doppler else tuple(self.matched[name] for name in ("vx", "vy", "vz") if name in self.matched)
        )
        if doppler is None and ((plan.polar and not self.of_table) or not {"vx", "vy"} <= self.matched.keys()):
            return plan
        names = tuple(one.name for one in group)
        in_ros_frame = self._is_ruled(group) and plan.scales[0] == 1.0
        others = ("vx", "vy", "vz") if self.of_table else ()
        speeds = (*group, *(self.matched[name] for name in others if name in self.matched))
        stated = next((speed for speed in speeds if speed.unit), None)
        assumptions = plan.assumptions
        if stated and stated.unit:
            unit, why = stated.unit, self.rule if self.decoder and not stated.mapped else stated.why
        elif in_ros_frame or all(one.column.standard for one in group):
            unit, why = _unit("mps"), self.rule
        else:
            finding = _speed_unit(group[0].column.values, integer=group[0].column.integer)
            unit, why = finding.unit, "assumed"
            confirm = _map(group[0], unit) if doppler and unit.flag else CONFIRM_ALL
            text = self._by_values(", ".join(names), finding)
            assumptions = (*assumptions, _assume("speed-unit", text, confirm, ("doppler",)))
        quantity, sign = ("doppler", "either: only its size matters") if doppler else ("velocity", "as the position's")
        return replace(
            plan,
            doppler=names[0] if doppler else None,
            velocity=() if doppler else names[: len(plan.position)],
            doppler_scale=group[0].sign * unit.scale,
            readings=(*plan.readings, ColumnReading(quantity, ", ".join(names), unit.name, sign, self._known_by(why))),
            assumptions=assumptions,
        )

    def amplitude(self, plan: ColumnPlan) -> ColumnPlan:
        """Add the amplitude."""
        one = self.matched.get("amplitude")
        if one is None:
            return plan
        if self.decoder and self.decoder.amplitude == NO_QUANTITY and one.meaning.kind == "amplitude":
            return plan  # another level
        unit = one.unit.name if one.unit else "not stated"
        why = one.why if one.unit else "only differences between returns matter; they are taken as dB"
        if one.unit is None and self._is_ruled((one,)):
            unit, why = "dB", self.rule
        return replace(
            plan,
            amplitude=one.name,
            amplitude_scale=one.sign
            * (self.decoder.amplitude_scale if self.decoder else one.unit.scale if one.unit else 1.0),
            readings=(*plan.readings, ColumnReading("amplitude", one.name, unit, "", why)),
        )

    def flags(self, plan: ColumnPlan, columns: Sequence[DescribedColumn]) -> ColumnPlan:
        """Use the flags of invalid values, and mention several sensors, second hypotheses and what the layout leaves open."""
        names = {column.name.lower(): column.name for column in columns}
        flags = [column for column in columns if column.name.lower().rpartition(".")[2] in VALID]
        needed = [flag.name for flag in flags if len(flag.values) and set(flag.values.tolist()) in ({0.0, 1.0}, {1.0})]
        needed = needed if self.decoder is None else [names[name.lower()] for name in self.decoder.needed]
        readings = [ColumnReading("valid", flag, "", "", "returns where it is 0 are skipped") for flag in needed]
        readings += [ColumnReading("other azimuth", name, "", "", "alternative") for name in plan.other_azimuths]
        about = _layout_assumption(self.decoder, polar=plan.polar) if self.decoder else None
        mapped = {quantity for quantity, one in self.matched.items() if one.mapped}
        return replace(
            plan,
            needed=tuple(needed),
            spoils_position=tuple(names[name] for name in _INVALID_POSITION if name in names),
            spoils_doppler=tuple(names[name] for name in _INVALID_DOPPLER if name in names),
            readings=(*plan.readings, *readings),
            assumptions=(
                *plan.assumptions,
                *_sensor_assumptions(columns if self.decoder is None else ()),
                *(one for one in _present(about) if not mapped.issuperset(one.quantities)),
            ),
            decoder=self.decoder.name if self.decoder else "",
            shared_with_lidars=self.decoder is not None and self.decoder.shared_with_lidars,
        )


def _layout_assumption(decoder: Decoder, *, polar: bool) -> ColumnAssumption | None:
    """Return what the layout's documentation leaves open."""
    if not decoder.assumed:
        return None
    mapped = tuple(re.findall(r"--map (\w+)=", decoder.confirm))
    key = "field-meaning" if mapped else "azimuth-sign" if polar else "axes"
    quantities = mapped or (("azimuth",) if polar else ("x", "y"))
    unit = "degrees" in decoder.confirm or "radians" in decoder.confirm
    about = Assumption(key, "", f"{decoder.name}: {decoder.assumed}", decoder.confirm)
    return ColumnAssumption(about, quantities, "--radar-axes" in decoder.confirm, unit)


def _sensor_assumptions(columns: Sequence[DescribedColumn]) -> list[ColumnAssumption]:
    found = []
    for column in columns:
        words, values = set(words_of(column.name)), sorted(set(column.values.tolist()))
        numbered = words & {"sensor", "radar"} and words & {"id", "idx", "index", "number"}
        if numbered and 1 < len(values) <= _MOST_SENSORS:
            ids = ", ".join(f"{value:g}" for value in values)
            text = (
                f"'{column.name}' has the values {ids}, and all their returns are taken as one sensor's, in one frame"
            )
            found.append(_assume("field-meaning", text, CONFIRM_ALL, ()))
    return found


def _whole(said: Mapping[str, Direction]) -> tuple[str, str, str] | None:
    """Return the directions of x, y and z if comments state those of x and y; z is up if nothing else is said."""
    if "x" not in said or "y" not in said:
        return None
    found = (said["x"], said["y"], said.get("z", "up"))
    return found if len({_PLANES[side] for side in found}) == 3 else None


def _up_assumption(
    group: tuple[ColumnMatch, ...], said: Mapping[str, Direction], directions: tuple[str, str, str]
) -> ColumnAssumption | None:
    """Return the assumption that z points up, unless a comment says so or x and y make it so in a right-handed frame."""
    if len(group) < 3 or "z" in said or np.linalg.det(RadarAxes(directions).matrix) > 0:
        return None
    text = (
        f"{group[2].name} is taken as up; in a right-handed frame with x {directions[0]} and y {directions[1]} it would point "
        "down, and the message does not state it"
    )
    return _assume("axes", text, f"--radar-axes {','.join(directions)}", ("x", "y", "z"), axes=True)


def _assume(
    key: str, text: str, confirm: str, quantities: tuple[str, ...], *, axes: bool = False, angle_unit: bool = False
) -> ColumnAssumption:
    """Return an assumption whose topic is not known yet."""
    return ColumnAssumption(Assumption(key, "", text, confirm), quantities, axes, angle_unit)


def _map(match: ColumnMatch, unit: Unit, quantity: str = "", minus: str = "") -> str:
    """Return the --map that states what a column is, for a shell."""
    minus = "-" if match.sign < 0 else minus
    return f"--map {_shell(f'{quantity or match.quantity}={minus}{match.name}{_flag(unit)}')}"


def _flag(unit: Unit) -> str:
    """Return how --map spells a unit; "" if it has no name there."""
    return f":{unit.flag}" if unit.flag else ""


def _shell(text: str) -> str:
    return text if all(letter.isalnum() or letter in "=:_-.+/" for letter in text) else f"'{text}'"


def _are(names: str) -> str:
    """Return the names with the verb that fits their number."""
    return f"{names} {'are' if ',' in names else 'is'}"


def _present(*found: _T | None) -> list[_T]:
    return [one for one in found if one is not None]


def _three(found: Sequence[_T], rest: _T) -> tuple[_T, _T, _T]:
    """Return three values for range, azimuth and elevation."""
    first, second, third = (*found, rest, rest, rest)[:3]
    return first, second, third


def _unit(word: str) -> Unit:
    unit = unit_of_word(word)
    assert unit is not None
    return unit


@dataclass(frozen=True, slots=True)
class Finding:
    """A unit found by values.

    Attributes:
        unit: the most plausible one.
        certain: whether no other one is plausible.
        why: in a few words.
        rival: one that fits as well; None if there is none.
    """

    unit: Unit
    certain: bool
    why: str
    rival: Unit | None = None


def farthest(*columns: Values) -> float:
    """Return the length below which 99 % of the positions or ranges lie; 0 without values."""
    lengths = np.sqrt(sum(np.square(column) for column in columns)) if columns else np.zeros(0)
    lengths = lengths[np.isfinite(lengths) & (lengths > 0)]
    return float(np.quantile(lengths, 0.99)) if len(lengths) else 0.0


def _length_unit(largest: float, *, integer: bool) -> Finding:
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
        rival = _unit("mm") if largest > _FARTHEST_M else None
        return Finding(
            _unit("m"), False, "no value tells the unit" if rival is None else f"values up to {largest:.4g}", rival
        )
    usual = next((unit for unit in fitting if largest * unit.scale <= _USUAL_M), fitting[0])
    rival = fitting[0] if fitting[0] is not usual else None
    return Finding(usual, len(fitting) == 1 and not integer, f"values up to {largest:.4g}", rival)


def _angle_unit(angles: Values, *, integer: bool) -> Finding:
    """Find the unit of angles by the largest one."""
    angles = np.abs(angles[np.isfinite(angles)])
    angles = angles[angles > 0]
    largest = float(angles.max(initial=0.0))
    why = f"angles up to {largest:.4g}"
    if integer:
        factor = 1.0 if largest <= 180 else 0.1 if largest <= 1800 else 0.01
        return Finding(_unit("deg").times(factor), False, why)
    if largest > 2 * math.pi:
        unit, rival = (_unit("deg"), None) if largest <= 360 else (_unit("cdeg"), _unit("deg"))
        return Finding(unit, rival is None, f"{why} cannot be radians", rival)
    if len(angles) >= _ENOUGH and largest <= _WIDEST_RAD:
        return Finding(_unit("rad"), True, f"no angle above {largest:.2f} in {len(angles)} returns")
    if largest <= math.pi:
        return Finding(_unit("rad"), False, f"only {why}", _unit("deg") if largest > _WIDE_RAD else None)
    return Finding(_unit("deg"), False, f"only {why}")


def _implausible(angle: ColumnMatch, unit: Unit, finding: Finding) -> bool:
    """Return whether an angle's values contradict its stated unit."""
    values = angle.column.values[np.isfinite(angle.column.values)]
    too_wide = float(np.abs(values).max(initial=0.0)) * unit.scale > 2 * np.pi + 0.01
    return too_wide or (finding.certain and unit.name in ("rad", "deg") and unit.name != finding.unit.name)


def _speed_unit(speeds: Values, *, integer: bool) -> Finding:
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
        toward: 1 if the angle grows toward the positive other axis, -1 if away from it.
    """

    angle: Unit
    forward: str
    toward: int


def _agreement(matched: Mapping[str, ColumnMatch]) -> PolarAgreement | None:
    """Find the unit, sign and axis order in which an azimuth matches x and y; None if none matches clearly."""
    if not {"x", "y", "azimuth"} <= matched.keys():
        return None
    angle, x, y = (matched[name].column.values for name in ("azimuth", "x", "y"))
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
    return PolarAgreement(best[1], best[2], best[3])


def plan_described(
    kind: MessageKind,
    columns: Sequence[DescribedColumn],
    arrays: Iterable[str] = (),
    remarks: str = "",
    stated: StatedReading = NOTHING_STATED,
) -> ColumnPlan | None:
    """Plan the columns of a message by the registry, by the names that ROS defines, or by its own description.

    Args:
        kind: what the fields are fields of.
        columns: the numbers of a return, with their values in a sample.
        arrays: names of fixed arrays of numbers, and of strings.
        remarks: comments of the definition that belong to no field.
        stated: what the user states.

    Raises:
        OptionError: the user maps half a position, or the time.
    """
    time = next((one for one in stated.column_map if one.quantity == "time"), None)
    if time is not None:
        raise OptionError(
            f"--map {time.words}: messages carry their time in their headers; choose the clock with --clock"
        )
    spelt = {name.lower(): name for name in (*arrays, *(column.name for column in columns))}
    decoder = find_decoder(kind, spelt.values())
    rules: Rules = "ros" if kind in _CLOUD_KINDS else "message"
    plan = guess_columns(columns, remarks, rules=rules, stated=stated, decoder=decoder)
    if plan is None:
        return None
    mapped = any(one.quantity in ("x", "y", "z", *_POLAR) for one in stated.column_map)
    if decoder is not None and decoder.covariance and not mapped:
        noise = ColumnReading("noise", spelt[decoder.covariance.lower()], "", "", f"layout '{decoder.name}'")
        plan = replace(plan, covariance=noise.column, readings=(*plan.readings, noise))
    return plan if stated.axes is None else plan.read_as(stated.axes)


def plan_names(kind: MessageKind, names: Iterable[str], stated: StatedReading = NOTHING_STATED) -> ColumnPlan | None:
    """Plan the columns of a message by their names alone."""
    return plan_described(kind, [DescribedColumn(name, False, "", np.zeros(0)) for name in names], stated=stated)
