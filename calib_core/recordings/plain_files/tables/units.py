"""Find the units and axes that a table does not state: from its values where they decide, otherwise as a stated assumption."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.recordings.assumptions import Assumption
from calib_core.recordings.field_words import MappedColumn
from calib_core.recordings.plain_files.source import PlainOptions
from calib_core.recordings.plain_files.tables.columns import TableColumn, TableColumns, units_of

_SAMPLED_ROWS = 20_000
_LENGTHS = ("x", "y", "z", "range")
_SPEEDS = ("doppler", "vx", "vy", "vz")
_FEW = 5
_ENOUGH = 20
_MIN_ANGLE_RAD = 0.02
_FARTHEST_M = 500.0
_NAMES = {"m": "metres", "cm": "centimetres", "mm": "millimetres", "rad": "radians", "deg": "degrees", "mps": "m/s"}


@dataclass(frozen=True, slots=True, eq=False)
class TableUnits:
    """What to do with the columns of a table.

    Attributes:
        scales: (k,) factors to m, rad, m/s and dB, with the sign of --map.
        x_is_right: whether x points to the right and y forward.
        assumptions: what neither the file nor its values state.
        remarks: what the values state, one phrase each.
    """

    scales: np.ndarray
    x_is_right: bool
    assumptions: tuple[Assumption, ...]
    remarks: tuple[str, ...]


def settle_units(columns: TableColumns, values: np.ndarray, topic: str, options: PlainOptions) -> TableUnits:
    """Settle the units of all columns.

    Args:
        columns: the columns in use.
        values: (n, k) as written.
        topic: for the assumptions.
        options: the user's.
    """
    step = max(1, len(values) // _SAMPLED_ROWS)
    sample = {column.quantity: values[::step, number] for number, column in enumerate(columns.values)}
    found = _Settling(columns, sample, topic)
    for column in columns.values:
        if column.quantity in ("azimuth", "elevation") and not column.unit:
            found.units[column.quantity] = options.angle_unit
    found.lengths()
    found.angles()
    found.speeds()
    found.rivals()
    x_is_right = False if options.axes_given else found.axes()
    scales = [
        column.sign
        * units_of(column.quantity)[found.units.get(column.quantity) or next(iter(units_of(column.quantity)))]
        for column in columns.values
    ]
    return TableUnits(np.array(scales), x_is_right, tuple(found.assumptions), tuple(found.remarks))


class _Settling:
    """The units found so far."""

    def __init__(self, columns: TableColumns, sample: dict[str, np.ndarray], topic: str) -> None:
        self.columns = columns
        self.sample = sample
        self.topic = topic
        self.units = {column.quantity: column.unit for column in columns.values}
        self.assumptions: list[Assumption] = []
        self.remarks: list[str] = []

    def _open(self, quantities: Sequence[str]) -> list[TableColumn]:
        """Return the columns of these quantities whose unit is not known yet."""
        found = (self.columns.of(quantity) for quantity in quantities)
        return [column for column in found if column is not None and not self.units[column.quantity]]

    def _assume(self, key: str, columns: Sequence[TableColumn], unit: str, why: str) -> None:
        for column in columns:
            self.units[column.quantity] = unit
        names = ", ".join(column.written for column in columns)
        text = f"{names} {'have' if len(columns) > 1 else 'has'} no unit; read as {_NAMES.get(unit, unit)}, {why}"
        self.assumptions.append(Assumption(key, self.topic, text, _map_words(columns, unit)))

    def _state(self, columns: Sequence[TableColumn], unit: str, why: str) -> None:
        for column in columns:
            self.units[column.quantity] = unit
        self.remarks.append(f"{', '.join(column.written for column in columns)} in {_NAMES.get(unit, unit)}, {why}")

    def _in_si(self, quantity: str) -> np.ndarray | None:
        """Return the sample of a quantity whose unit is known [m, rad]."""
        column, unit = self.columns.of(quantity), self.units.get(quantity)
        return None if column is None or not unit else column.sign * self.sample[quantity] * units_of(quantity)[unit]

    def lengths(self) -> None:
        """Settle x, y, z and range, by each other where one of them states its unit."""
        for column in self._open(_LENGTHS):
            like = next((self.units[q] for q in ("x", "y", "z") if self.units.get(q)), "")
            if column.quantity in "xyz" and like:
                self._state([column], like, "as its neighbours")
        unknown = self._open(_LENGTHS)
        if not unknown:
            return
        cartesian = [column for column in unknown if column.quantity != "range"]
        unit = self._by_length(bool(cartesian))
        if unit and len({column.quantity == "range" for column in unknown}) == 1:
            self._state(unknown, unit, f"since {'the range' if cartesian else 'the position'} agrees")
            return
        largest = max(float(np.nanmax(np.abs(self.sample[c.quantity]), initial=0.0)) for c in unknown)
        unit = next((name for name in ("m", "cm", "mm") if largest * units_of("x")[name] <= _FARTHEST_M), "mm")
        self._assume("length-unit", unknown, unit, f"since the largest value is {largest:g}")

    def _by_length(self, cartesian: bool) -> str:
        """Return the unit in which the range equals the length of x, y, z; "" if there is none."""
        if not {"x", "y", "range"} <= self.sample.keys():
            return ""
        length = np.sqrt(sum(self.sample[q] ** 2 for q in "xyz" if q in self.sample))
        a, b = (length, self.sample["range"]) if cartesian else (self.sample["range"], length)
        known = self._in_si("range") if cartesian else self._in_si("x")
        if known is None:
            return ""
        factor = 1.0 if cartesian else units_of("x")[self.units["x"]]
        with np.errstate(all="ignore"):
            ratio = (known if cartesian else b * factor) / a
        ratio = ratio[np.isfinite(ratio) & (ratio > 0)]
        if len(ratio) < _FEW:
            return ""
        for unit, scale in units_of("x").items():
            if np.median(np.abs(ratio / scale - 1.0)) < 0.02:
                return unit
        return ""

    def angles(self) -> None:
        """Settle azimuth and elevation, by x, y, z or by their size where these decide."""
        for quantity, own in (("azimuth", self._own_azimuth()), ("elevation", self._own_elevation())):
            for column in self._open([quantity]):
                self._angle(column, own)
        for column in self._open(("sigma_range", "sigma_azimuth", "sigma_elevation")):
            self._assume(
                "noise-unit",
                [column],
                self.units.get(column.quantity.removeprefix("sigma_"), "") or "rad",
                "as the value itself",
            )

    def _angle(self, column: TableColumn, own: np.ndarray | None) -> None:
        values = self.sample[column.quantity]
        largest = float(np.nanmax(np.abs(values), initial=0.0))
        if own is not None and (unit := _matching_unit(values * column.sign, own)):
            self._state([column], unit, "since it agrees with the positions")
        elif largest > 2.0 * math.pi + 0.01:
            self._state([column], "deg", f"since its values reach {largest:.1f}")
        elif column.quantity == "elevation" and self.units.get("azimuth") in ("deg", "rad"):
            self._assume("angle-unit", [column], self.units["azimuth"], "as the azimuth")
        else:
            unit = "deg" if largest > 1.75 else "rad"
            self._assume("angle-unit", [column], unit, f"since its largest value is {largest:.2f}")

    def _own_azimuth(self) -> np.ndarray | None:
        x, y = self._in_si("x"), self._in_si("y")
        return None if x is None or y is None else np.arctan2(y, x)

    def _own_elevation(self) -> np.ndarray | None:
        x, y, z = (self._in_si(axis) for axis in "xyz")
        return None if x is None or y is None or z is None else np.arctan2(z, np.hypot(x, y))

    def speeds(self) -> None:
        """Settle speeds: nothing in a table decides their unit."""
        unknown = self._open(_SPEEDS)
        stated = next((self.units[q] for q in _SPEEDS if self.units.get(q)), "")
        if unknown and stated:
            self._state(unknown, stated, "as the other speed")
        elif unknown:
            self._assume("speed-unit", unknown, "mps", "the usual unit of radars")

    def rivals(self) -> None:
        """State which of two columns of the same quantity is used."""
        for quantity, others in self.columns.rivals.items():
            column = self.columns.of(quantity)
            if column is not None:
                text = f"{column.written} is read as the {quantity}, not {others}"
                self.assumptions.append(
                    Assumption("field-meaning", self.topic, text, _map_words([column], self.units[quantity]))
                )

    def axes(self) -> bool:
        """Settle the axes; return whether x points to the right."""
        x, y = self.columns.of("x"), self.columns.of("y")
        if x is None or y is None:
            self._azimuth_sign()
            return False
        ahead, aside = y.sign * self.sample["y"], x.sign * self.sample["x"]
        some = np.isfinite(ahead) & np.isfinite(aside) & (ahead != 0)
        if np.count_nonzero(some) >= _ENOUGH:
            left = float(np.mean(aside[some] < 0))
            if np.mean(ahead[some] > 0) > 0.995 and 0.1 < left < 0.9:
                why = f"{y.written} is never negative and {x.written} has both signs"
                text = f"{why}; read as {x.written} to the right, {y.written} forward"
                self.assumptions.append(Assumption("axes", self.topic, text, "--radar-axes right,forward,up"))
                return True
        if (y.rank > 0 and not y.mapped) or (x.rank > 0 and not x.mapped):
            text = f"the directions of {x.written} and {y.written} are not stated; read as forward and to the left"
            self.assumptions.append(Assumption("axes", self.topic, text, "--radar-axes forward,left,up"))
        return False

    def _azimuth_sign(self) -> None:
        column = self.columns.of("azimuth")
        if column is not None and not column.is_documented and not column.mapped:
            text = f"{column.written} is read as the azimuth, positive to the left; the file does not state its sign"
            self.assumptions.append(
                Assumption("azimuth-sign", self.topic, text, _map_words([column], self.units[column.quantity]))
            )


def _matching_unit(values: np.ndarray, own: np.ndarray) -> str:
    """Return the unit in which angles agree with those of the positions, in either sign; "" if none does."""
    telling = np.isfinite(values) & (np.abs(own) > _MIN_ANGLE_RAD)
    if np.count_nonzero(telling) < _FEW:
        return ""
    apart = {
        unit: min(float(np.median(np.abs(sign * scale * values[telling] - own[telling]))) for sign in (1, -1))
        for unit, scale in units_of("azimuth").items()
    }
    best = min(apart, key=apart.__getitem__)
    return best if apart[best] < 0.02 and all(apart[u] > 3 * apart[best] + 1e-9 for u in apart if u != best) else ""


def _map_words(columns: Sequence[TableColumn], unit: str) -> str:
    words = (MappedColumn(column.quantity, column.written, unit, column.sign).words for column in columns)
    return " ".join(f"--map {_shell(text)}" for text in words)


def _shell(text: str) -> str:
    return text if all(letter.isalnum() or letter in "=:_-.+/" for letter in text) else f"'{text}'"
