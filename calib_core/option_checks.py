"""Checks of options: the type and range of each, for whoever sets them: a script, the page or the command line."""

import dataclasses
import math
import numbers
import typing
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, TypeAlias

from calib_core.errors import OptionError
from calib_core.options import RETIRED_METHODS, CalibrationOptions, CameraPositionPrior

OptionKind: TypeAlias = Literal["number", "integer", "yes-no", "choice", "camera-position"]

UNITS = {"_mps": "m/s", "_px": "px", "_deg": "deg", "_rad": "rad", "_db": "dB", "_m": "m", "_s": "s"}


@dataclass(frozen=True, slots=True)
class OptionField:
    """One option.

    Attributes:
        path: its name, such as "noise.sigma_px".
        owner: the dataclass it belongs to.
        field: with its text and range.
        type: of its value.
    """

    path: str
    owner: type
    field: dataclasses.Field[Any]
    type: Any


def checked_options(options: CalibrationOptions) -> CalibrationOptions:
    """Return the options unchanged if every value is valid.

    Raises:
        OptionError: a number is not finite or out of range, a choice is unknown, or two options contradict each other.
    """
    if not isinstance(options, CalibrationOptions):
        raise OptionError(f"options: expected CalibrationOptions, got {type(options).__name__}")
    for leaf in option_fields().values():
        group = leaf.path.rpartition(".")[0]
        value = getattr(getattr(options, group) if group else options, leaf.field.name)
        for name, number in _numbers(leaf.path, value):
            low, high = RANGES[name]
            if not (math.isfinite(number) and low <= number <= high):
                raise OptionError(
                    f"option {name}: {number:g} is out of range; allowed: {low:g} to {high:g}{_unit_after(name)}"
                )
        _check_type(leaf, value)
    if options.gating.min_range_m >= options.gating.max_range_m:
        raise OptionError(
            f"option gating.min_range_m: {options.gating.min_range_m:g} m is not below "
            f"gating.max_range_m, {options.gating.max_range_m:g} m; make it smaller"
        )
    if options.refining.intrinsics:
        _check_refining(options)
    return options


def _check_refining(options: CalibrationOptions) -> None:
    """Refuse to refine the intrinsics where they cannot be.

    Raises:
        OptionError: the method takes them as they are, or every standard deviation is 0.
    """
    if not options.models_noise:
        raise OptionError(
            f"option refining.intrinsics: the method {options.method} takes the intrinsics as they are and cannot refine "
            "them; use the method default, or turn refining off"
        )
    refining = options.refining
    if not (refining.focal_length_sigma or refining.principal_point_sigma_px or refining.distortion_sigma):
        raise OptionError(
            "option refining.intrinsics: every standard deviation of refining is 0, so there is nothing to refine; state "
            "how far off the focal length, the principal point or the distortion may be"
        )


_WANTED: Mapping[str, tuple[type, str]] = {
    "number": (numbers.Real, "a number"),
    "integer": (numbers.Integral, "a whole number"),
    "yes-no": (bool, "True or False"),
}


def _check_type(leaf: OptionField, value: object) -> None:
    """Refuse a value of another type than the option's, or none of its choices.

    Raises:
        OptionError: names the option and the value.
    """
    kind = kind_of(leaf)
    if kind == "choice" and value not in typing.get_args(leaf.type):
        fault = f"'{value}' was of older versions only" if value in RETIRED_METHODS else f"unknown value '{value}'"
        raise OptionError(f"option {leaf.path}: {fault}; choose {' or '.join(typing.get_args(leaf.type))}")
    if kind == "camera-position":
        words = "a CameraPositionPrior or None"
        fits = value is None or isinstance(value, CameraPositionPrior)
    elif kind in _WANTED:
        wanted, words = _WANTED[kind]
        fits = isinstance(value, wanted) and (kind == "yes-no" or not isinstance(value, bool))
    else:
        return
    if not fits:
        raise OptionError(f"option {leaf.path}: expected {words}, got {value!r}")


@cache
def option_fields() -> Mapping[str, OptionField]:
    """Return every option that can be set on its own, by path; a camera position is set as a whole."""
    leaves: dict[str, OptionField] = {}
    top = typing.get_type_hints(CalibrationOptions)
    for field in dataclasses.fields(CalibrationOptions):
        group = top[field.name]
        if not dataclasses.is_dataclass(group):
            leaves[field.name] = OptionField(field.name, CalibrationOptions, field, group)
            continue
        hints = typing.get_type_hints(group)
        for option in dataclasses.fields(group):
            path = f"{field.name}.{option.name}"
            leaves[path] = OptionField(path, typing.cast(type, group), option, hints[option.name])
    return leaves


def _ranges() -> Iterator[tuple[str, tuple[float, float]]]:
    """Yield the range of every number, under the name that `_numbers` gives it."""
    for leaf in option_fields().values():
        if kind_of(leaf) in ("number", "integer"):
            yield leaf.path, (leaf.field.metadata["low"], leaf.field.metadata["high"])
        elif kind_of(leaf) == "camera-position":
            for part in dataclasses.fields(CameraPositionPrior):
                yield f"{leaf.path}.{part.name}", (part.metadata["low"], part.metadata["high"])


@cache
def kind_of(leaf: OptionField) -> OptionKind:
    """Return what kind of value an option takes."""
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
    elif isinstance(value, numbers.Real) and not isinstance(value, bool):
        yield path, float(value)


def unit_of_name(name: str) -> str:
    """Return the unit that a name ends with, such as "m/s" for max_speed_mps; "" without one."""
    return next((unit for suffix, unit in UNITS.items() if name.endswith(suffix)), "")


def _unit_after(path: str) -> str:
    unit = unit_of_name(path)
    return f" {unit}" if unit else ""


RANGES: Mapping[str, tuple[float, float]] = dict(_ranges())
"""The smallest and largest allowed value of each number, from the options' fields."""
