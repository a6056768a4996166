"""Choose the columns to use: by the registry, by the names that ROS defines, or by what the message says about itself."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cache
from typing import get_args

from calib_core.plugins import load_plugins, warn_skipped
from calib_core.recordings.assumptions import Assumption
from calib_core.recordings.radar.column_guess import (
    FARTHEST_M,
    DescribedColumn,
    Rules,
    farthest,
    fill_in,
    guess_columns,
)
from calib_core.recordings.radar.column_plan import ColumnAssumption, ColumnPlan, ColumnReading
from calib_core.recordings.radar.columns import plan_columns
from calib_core.recordings.radar.registry import DECODERS, Decoder, MessageKind

_CLOUDS = ("cloud", "channels")
GROUP = "cocalib.radar_layouts"


def find_decoder(kind: MessageKind, names: Iterable[str]) -> Decoder | None:
    """Return the layout that requires the most of these fields; None if none matches.

    Args:
        kind: what the fields are fields of.
        names: as the message spells them; nested ones dotted, arrays included.
    """
    have = {name.lower() for name in names}
    fitting = [d for d in all_decoders() if d.kind == kind and have.issuperset(field.lower() for field in d.fields)]
    return max(fitting, key=lambda decoder: len(decoder.fields), default=None)


def plan_for(kind: MessageKind, names: Iterable[str], arrays: Iterable[str] = ()) -> ColumnPlan | None:
    """Plan the columns of a message by the registry or by their names alone; None if there is no position.

    Args:
        kind: what the fields are fields of.
        names: of single numbers, as the message spells them; nested ones dotted.
        arrays: names of fixed arrays of numbers, and of strings.
    """
    names, arrays = tuple(names), tuple(arrays)
    decoder = find_decoder(kind, (*names, *arrays))
    plan = plan_columns(names)
    if decoder is None:
        return plan
    spelt = {name.lower(): name for name in (*arrays, *names)}
    if plan is None:
        plan = ColumnPlan(position=(), polar=True)
    if decoder.polar:
        polar = tuple(spelt[name.lower()] for name in decoder.polar)
        claimed = (polar[0], polar[1], polar[2] if len(polar) == 3 else None)
        plan = replace(plan, position=polar, polar=True, claimed=claimed)
    return replace(
        plan,
        degrees=decoder.degrees or plan.degrees,
        azimuth_sign=float(decoder.azimuth_sign),
        doppler=spelt[decoder.doppler.lower()] if decoder.doppler else plan.doppler,
        velocity=() if decoder.doppler else plan.velocity,
        amplitude=spelt[decoder.amplitude_field.lower()] if decoder.amplitude_field else plan.amplitude,
        amplitude_scale=decoder.amplitude_scale,
        covariance=spelt[decoder.covariance.lower()] if decoder.covariance else None,
        needed=tuple(spelt[name.lower()] for name in decoder.needed),
        decoder=decoder.name,
        assumptions=_assumptions(decoder, polar=bool(plan.polar)),
        shared_with_lidars=decoder.shared_with_lidars,
    )


def _assumptions(decoder: Decoder, *, polar: bool) -> tuple[ColumnAssumption, ...]:
    """Return what the layout's documentation leaves open."""
    if not decoder.assumed:
        return ()
    mapped = tuple(re.findall(r"--map (\w+)=", decoder.confirm))
    key = "field-meaning" if mapped else "azimuth-sign" if polar else "axes"
    quantities = mapped or (("azimuth",) if polar else ("x", "y"))
    axes = "--radar-axes" in decoder.confirm
    unit = "degrees" in decoder.confirm or "radians" in decoder.confirm
    about = Assumption(key, "", f"{decoder.name}: {decoder.assumed}", decoder.confirm)
    return (ColumnAssumption(about, quantities, axes, unit),)


def plan_described(
    kind: MessageKind, columns: Sequence[DescribedColumn], arrays: Iterable[str] = (), remarks: str = ""
) -> ColumnPlan | None:
    """Plan the columns of a message by the registry, by the names that ROS defines, or by its own description.

    Args:
        kind: what the fields are fields of.
        columns: the numbers of a return, with their values in a sample.
        arrays: names of fixed arrays of numbers, and of strings.
        remarks: comments of the definition that belong to no field.
    """
    names, arrays = [column.name for column in columns], tuple(arrays)
    exact = plan_columns(names)
    if kind in _CLOUDS and exact is not None and not exact.polar and _is_too_far(exact, columns):
        return guess_columns(columns, remarks, rules="ros", known=True)
    if find_decoder(kind, (*names, *arrays)):
        return plan_for(kind, names, arrays)
    if kind in _CLOUDS and exact is not None and {"x", "y"} <= {name.lower() for name in exact.position}:
        return fill_in(exact, columns)
    known = exact is not None and exact.looks_like_radar
    rules: Rules = "ros" if kind in _CLOUDS else "message"
    return guess_columns(columns, remarks, rules=rules, known=known or kind in _CLOUDS)


def _is_too_far(plan: ColumnPlan, columns: Sequence[DescribedColumn]) -> bool:
    """Return whether positions would be farther away than any radar sees if they were metres."""
    return farthest(*(column.values for column in columns if column.name in plan.position)) > FARTHEST_M


def plan_like(first: ColumnPlan, kind: MessageKind, names: Iterable[str]) -> ColumnPlan | None:
    """Plan a later message of a topic: its own columns, with the user's axes of the first plan."""
    names = tuple(names)
    if first.described or first.mapped:
        return first if set(first.columns) <= set(names) else None
    plan = plan_for(kind, names)
    if plan is None:
        return None
    plan = replace(plan, claiming=first.claiming, azimuth_from=first.azimuth_from)
    return plan.read_as(first.axes) if first.axes else plan


def column_readings(plan: ColumnPlan) -> tuple[ColumnReading, ...]:
    """Return what was taken for what: as the message describes itself, or as the registry or ROS defines its layout."""
    if plan.described:
        return plan.readings
    why = f"layout '{plan.decoder}'" if plan.decoder else "ROS defines it (REP 103)"
    angle, side = ("deg" if plan.degrees else "rad"), ("to the left" if plan.azimuth_sign > 0 else "to the right")
    directions = plan.axes.directions if plan.axes else plan.directions
    place = [("xyz"[axis], "m", directions[axis]) for axis in range(3)]
    if plan.polar:
        place = [("range", "m", ""), ("azimuth", angle, side), ("elevation", angle, "upwards")]
    rows = [
        ColumnReading(what, name, unit, sign, why)
        for name, (what, unit, sign) in zip(plan.position, place, strict=False)
    ]
    speed = plan.doppler or ", ".join(plan.velocity)
    rows += [ColumnReading("doppler" if plan.doppler else "velocity", speed, "m/s", "", why)] if speed else []
    rows += [ColumnReading("amplitude", plan.amplitude, "dB", "", why)] if plan.amplitude else []
    noise = plan.covariance or ", ".join(name for name in plan.sigma if name)
    rows += [ColumnReading("noise", noise, "", "", why)] if noise else []
    rows += [ColumnReading("other azimuth", name, "", "", "alternative") for name in plan.other_azimuths]
    mapped = {row.quantity for row in plan.readings}
    return (*(row for row in rows if row.quantity not in mapped), *plan.readings)


@cache
def all_decoders() -> tuple[Decoder, ...]:
    """Return every layout: ours, then those of installed packages, which are loaded once, on first use."""
    known = list(DECODERS)
    for plugin in load_plugins(GROUP, Decoder):
        fault = _fault(plugin.value, known)
        if fault:
            warn_skipped(plugin.distribution, f"the radar layout {plugin.value.name!r} {fault}")
        else:
            known.append(plugin.value)
    return tuple(known)


def _fault(added: Decoder, known: Iterable[Decoder]) -> str:
    """Return why a layout cannot be used, "" if it can."""
    if added.kind not in get_args(MessageKind):
        return f"has the unknown kind {added.kind!r}; known: {', '.join(get_args(MessageKind))}"
    if not added.polar and plan_columns(added.fields) is None:
        return "has no position: its fields have neither x, y, z nor a range and an azimuth, and it has no polar"
    for one in known:
        if one.name == added.name:
            return "has the same name as another layout"
        if one.kind == added.kind and _folded(one.fields) == _folded(added.fields):
            return f"is recognised by the same fields as {one.name!r}; it needs one more field to differ"
    return ""


def _folded(names: Iterable[str]) -> set[str]:
    return {name.lower() for name in names}
