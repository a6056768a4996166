"""Options by name: parsing, range checks and descriptions, for the page, the journal and the command line.

An option's name is its path in CalibrationOptions, such as "gating.max_range_m".
"""

import dataclasses
import difflib
import inspect
import math
import typing
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Literal, TypeAlias

import msgspec

from calib_core.errors import OptionError
from calib_core.options import CalibrationOptions, CameraPositionPrior

__all__ = [
    "RANGES",
    "OptionChange",
    "OptionDescription",
    "OptionGroup",
    "OptionKind",
    "changed_options",
    "changes_from_tree",
    "checked_options",
    "option_groups",
    "options_from_tree",
]

OptionKind: TypeAlias = Literal["number", "integer", "yes-no", "choice", "camera-position"]
OptionValue: TypeAlias = bool | int | float | str | CameraPositionPrior | None

_UNITS = {"_mps": "m/s", "_px": "px", "_deg": "deg", "_rad": "rad", "_db": "dB", "_m": "m", "_s": "s"}


@dataclass(frozen=True, slots=True)
class OptionChange:
    """One option and its new value.

    Attributes:
        path: the option's name, such as "noise.sigma_px".
        value: of the option's type.
    """

    path: str
    value: OptionValue


@dataclass(frozen=True, slots=True)
class OptionDescription:
    """What a user needs to know to set one option.

    Attributes:
        path: the option's name, such as "noise.sigma_px".
        label: the name as words, without the unit.
        unit: "" if it has none.
        hint: one sentence, from the option's field.
        kind: which input field to draw.
        choices: the values of a "choice".
        low: smallest allowed value; None if unlimited.
        high: largest allowed value; None if unlimited.
        default: the value if it is not set.
    """

    path: str
    label: str
    unit: str
    hint: str
    kind: OptionKind
    choices: tuple[str, ...]
    low: float | None
    high: float | None
    default: OptionValue


@dataclass(frozen=True, slots=True)
class OptionGroup:
    """Related options; the first group has no name and contains the method.

    Attributes:
        name: such as "noise"; "" for the top level.
        hint: one sentence, from the group's docstring.
        options: in source order.
    """

    name: str
    hint: str
    options: tuple[OptionDescription, ...]


@dataclass(frozen=True, slots=True)
class _Leaf:
    path: str
    owner: type
    field: dataclasses.Field[Any]
    type: Any


def changes_from_tree(tree: object) -> tuple[OptionChange, ...]:
    """Parse a partial, nested JSON object of options.

    Raises:
        OptionError: a name is unknown (the nearest one is suggested) or a value has the wrong type.
    """
    return tuple(_changes(tree, ""))


def options_from_tree(tree: object) -> CalibrationOptions:
    """Parse a nested JSON object of options; missing ones get their defaults.

    Raises:
        OptionError: an option is unknown, of the wrong type or out of range.
    """
    return changed_options(CalibrationOptions(), changes_from_tree(tree))


def changed_options(options: CalibrationOptions, changes: Sequence[OptionChange]) -> CalibrationOptions:
    """Set some options and leave the others unchanged.

    Raises:
        OptionError: an option is unknown or out of range.
    """
    for change in changes:
        if change.path not in _leaves():
            raise _unknown(change.path)
        group, _, name = change.path.rpartition(".")
        named: dict[str, Any] = {name: change.value}
        if group:
            named = {group: replace(getattr(options, group), **named)}
        options = replace(options, **named)
    return checked_options(options)


def checked_options(options: CalibrationOptions) -> CalibrationOptions:
    """Return the options unchanged if every value is valid.

    Raises:
        OptionError: a number is not finite or out of range, a choice is unknown, or two options contradict each other.
    """
    for leaf in _leaves().values():
        group = leaf.path.rpartition(".")[0]
        value = getattr(getattr(options, group) if group else options, leaf.field.name)
        if _kind(leaf) == "choice" and value not in typing.get_args(leaf.type):
            choices = " or ".join(typing.get_args(leaf.type))
            raise OptionError(f"option {leaf.path}: unknown value '{value}'; choose {choices}")
        for name, number in _numbers(leaf.path, value):
            low, high = RANGES[name]
            if not (math.isfinite(number) and low <= number <= high):
                raise OptionError(
                    f"option {name}: {number:g} is out of range; allowed: {low:g} to {high:g}{_unit_of(name)}"
                )
    if options.gating.min_range_m >= options.gating.max_range_m:
        raise OptionError(
            f"option gating.min_range_m: {options.gating.min_range_m:g} m is not below "
            f"gating.max_range_m, {options.gating.max_range_m:g} m; make it smaller"
        )
    return options


@cache
def option_groups() -> tuple[OptionGroup, ...]:
    """Describe every option: label and unit from its name, hint and range from its field."""
    groups: dict[str, list[OptionDescription]] = {}
    owners: dict[str, type] = {}
    for leaf in _leaves().values():
        group = leaf.path.rpartition(".")[0]
        owners[group] = leaf.owner
        low, high = RANGES.get(leaf.path, (None, None))
        groups.setdefault(group, []).append(
            OptionDescription(
                path=leaf.path,
                label=_label(leaf.field.name),
                unit=_unit(leaf.field.name),
                hint=leaf.field.metadata["help"],
                kind=_kind(leaf),
                choices=typing.get_args(leaf.type) if _kind(leaf) == "choice" else (),
                low=low,
                high=high,
                default=typing.cast(OptionValue, leaf.field.default),
            )
        )
    ordered = sorted(groups.items(), key=lambda item: item[0] != "")
    return tuple(OptionGroup(name, inspect.getdoc(owners[name]) or "", tuple(group)) for name, group in ordered)


def _changes(tree: object, prefix: str) -> Iterator[OptionChange]:
    if not isinstance(tree, Mapping):
        raise OptionError(f"options{f' {prefix[:-1]}' if prefix else ''}: expected an object of names and values")
    groups = {path.partition(".")[0] for path in _leaves() if "." in path}
    for name, value in tree.items():
        path = f"{prefix}{name}"
        if not prefix and name in groups:
            yield from _changes(value, f"{path}.")
        elif path in _leaves():
            try:
                yield OptionChange(path, msgspec.convert(value, _leaves()[path].type))
            except msgspec.ValidationError as error:
                raise OptionError(f"option {path}: {str(error)[:1].lower()}{str(error)[1:]}") from error
        else:
            raise _unknown(path)


def _unknown(path: str) -> OptionError:
    known = sorted(_leaves())
    near = difflib.get_close_matches(path, known, n=1)
    if not near:
        by_name = {name.rpartition(".")[2]: name for name in known}
        near = [by_name[name] for name in difflib.get_close_matches(path.rpartition(".")[2], by_name, n=1)]
    advice = f"did you mean '{near[0]}'?" if near else f"known: {', '.join(known)}"
    return OptionError(f"unknown option '{path[:80]}'; {advice}")


@cache
def _leaves() -> Mapping[str, _Leaf]:
    """Return every option that can be set on its own, by path; a camera position is set as a whole."""
    leaves: dict[str, _Leaf] = {}
    top = typing.get_type_hints(CalibrationOptions)
    for field in dataclasses.fields(CalibrationOptions):
        group = top[field.name]
        if not dataclasses.is_dataclass(group):
            leaves[field.name] = _Leaf(field.name, CalibrationOptions, field, group)
            continue
        hints = typing.get_type_hints(group)
        for option in dataclasses.fields(group):
            path = f"{field.name}.{option.name}"
            leaves[path] = _Leaf(path, typing.cast(type, group), option, hints[option.name])
    return leaves


def _ranges() -> Iterator[tuple[str, tuple[float, float]]]:
    """Yield the range of every number, under the name that `_numbers` gives it."""
    for leaf in _leaves().values():
        if _kind(leaf) in ("number", "integer"):
            yield leaf.path, (leaf.field.metadata["low"], leaf.field.metadata["high"])
        elif _kind(leaf) == "camera-position":
            for part in dataclasses.fields(CameraPositionPrior):
                yield f"{leaf.path}.{part.name}", (part.metadata["low"], part.metadata["high"])


def _kind(leaf: _Leaf) -> OptionKind:
    if typing.get_origin(leaf.type) is Literal:
        return "choice"
    if leaf.type == CameraPositionPrior | None:
        return "camera-position"
    return {bool: "yes-no", int: "integer", float: "number"}[leaf.type]  # type: ignore[return-value]


def _numbers(path: str, value: object) -> Iterator[tuple[str, float]]:
    """Yield the numbers in an option's value, each with the name of its range."""
    if isinstance(value, CameraPositionPrior):
        for number in value.position_m:
            yield f"{path}.position_m", number
        yield f"{path}.sigma_m", value.sigma_m
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield path, value


def _unit(name: str) -> str:
    return next((unit for suffix, unit in _UNITS.items() if name.endswith(suffix)), "")


def _unit_of(path: str) -> str:
    unit = _unit(path)
    return f" {unit}" if unit else ""


def _label(name: str) -> str:
    suffix = next((suffix for suffix in _UNITS if name.endswith(suffix)), "")
    return name.removesuffix(suffix).replace("_", " ")


RANGES: Mapping[str, tuple[float, float]] = dict(_ranges())
"""The smallest and largest allowed value of each number, from the options' fields."""
