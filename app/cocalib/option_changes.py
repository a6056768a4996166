"""Options by name: parsing, range checks and descriptions, for the page, the journal and the command line.

An option's name is its path in CalibrationOptions, such as "gating.max_range_m".
"""

import difflib
import inspect
import typing
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any, TypeAlias

import msgspec

from calib_core.errors import OptionError
from calib_core.options import (
    HOW_MEASURED,
    RANGES,
    UNITS,
    CalibrationOptions,
    CameraPositionPrior,
    OptionKind,
    checked_options,
    kind_of,
    option_fields,
    unit_of_name,
)

OptionValue: TypeAlias = bool | int | float | str | CameraPositionPrior | None


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
        measured: of a camera position, how it was measured, in words, and the sigma [m] that it then has.
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
    measured: Mapping[str, float] = field(default_factory=dict)


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
    groups: dict[str, dict[str, Any]] = {"": {}}
    for change in changes:
        if change.path not in option_fields():
            raise unknown_option(change.path, sorted(option_fields()))
        group, _, name = change.path.rpartition(".")
        groups.setdefault(group, {})[name] = change.value
    ungrouped = groups.pop("")
    changed = {group: replace(getattr(options, group), **values) for group, values in groups.items()}
    options = replace(options, **ungrouped, **changed)
    return checked_options(options)


@cache
def option_groups() -> tuple[OptionGroup, ...]:
    """Describe every option: label and unit from its name, hint and range from its field."""
    groups: dict[str, list[OptionDescription]] = {}
    owners: dict[str, type] = {}
    for leaf in option_fields().values():
        group = leaf.path.rpartition(".")[0]
        owners[group] = leaf.owner
        low, high = RANGES.get(leaf.path, (None, None))
        groups.setdefault(group, []).append(
            OptionDescription(
                path=leaf.path,
                label=_label(leaf.field.name),
                unit=unit_of_name(leaf.field.name),
                hint=leaf.field.metadata["help"],
                kind=kind_of(leaf),
                choices=typing.get_args(leaf.type) if kind_of(leaf) == "choice" else (),
                low=low,
                high=high,
                default=typing.cast(OptionValue, leaf.field.default),
                measured=_ways_to_measure() if kind_of(leaf) == "camera-position" else {},
            )
        )
    ordered = sorted(groups.items(), key=lambda item: item[0] != "")
    return tuple(OptionGroup(name, inspect.getdoc(owners[name]) or "", tuple(group)) for name, group in ordered)


def _ways_to_measure() -> dict[str, float]:
    return {"with a tape": CameraPositionPrior().sigma_m, **dict(HOW_MEASURED.values())}


def _changes(tree: object, prefix: str) -> Iterator[OptionChange]:
    if not isinstance(tree, Mapping):
        raise OptionError(f"options{f' {prefix[:-1]}' if prefix else ''}: expected an object of names and values")
    groups = {path.partition(".")[0] for path in option_fields() if "." in path}
    for name, value in tree.items():
        path = f"{prefix}{name}"
        if not prefix and name in groups:
            yield from _changes(value, f"{path}.")
        elif path in option_fields():
            try:
                yield OptionChange(path, msgspec.convert(value, option_fields()[path].type))
            except msgspec.ValidationError as error:
                raise OptionError(f"option {path}: {str(error)[:1].lower()}{str(error)[1:]}") from error
        else:
            raise unknown_option(path, sorted(option_fields()))


def unknown_option(path: str, known: Sequence[str]) -> OptionError:
    """Return the error for a name that no option has, with the nearest one, be it in another group."""
    by_end = {name.rpartition(".")[2]: name for name in known}
    ends = difflib.get_close_matches(path.rpartition(".")[2], by_end, n=1)
    near = difflib.get_close_matches(path, known, n=1) or [by_end[end] for end in ends]
    groups = ", ".join(dict.fromkeys(name.partition(".")[0] for name in known))
    return OptionError(
        f"unknown option '{path[:80]}'; " + (f"did you mean {near[0]}?" if near else f"known groups: {groups}")
    )


def _label(name: str) -> str:
    suffix = next((suffix for suffix in UNITS if name.endswith(suffix)), "")
    return name.removesuffix(suffix).replace("_", " ")
