"""Units, signs and axes of a position, Cartesian or polar, with what states each."""

import numpy as np

from calib_core.recordings.assumptions import CONFIRM_ALL, Assumption
from calib_core.recordings.radar.column_plan import ColumnAssumption, ColumnPlan, ColumnReading
from calib_core.recordings.radar.self_describing.candidates import Chosen, Picked
from calib_core.recordings.radar.self_describing.comments import Direction, axes_in, axis_side, positive_side
from calib_core.recordings.radar.self_describing.units import Unit, unit_of_word
from calib_core.recordings.radar.self_describing.values import (
    Finding,
    PolarAgreement,
    agreement,
    angle_unit,
    farthest,
    forward_axis,
    length_unit,
)

__all__ = ["assume", "cartesian_part", "flag_unit", "polar_part"]

_FARTHEST_M = 1000.0
_COMMENT = "comment in the definition"
_ROS = "ROS defines it (REP 103)"
_AXES = {"x": "y", "y": "x"}
_PLANES = {"forward": 0, "backward": 0, "left": 1, "right": 1, "up": 2, "down": 2}
_AS_MAPPED = {
    "forward": ("x", ""), "backward": ("x", "-"), "left": ("y", ""), "right": ("y", "-"), "up": ("z", ""), "down": ("z", "-"),
}  # fmt: skip
_OPPOSITE: dict[Direction, Direction] = {"left": "right", "right": "left", "forward": "backward", "backward": "forward"}


def assume(
    key: str, text: str, confirm: str, quantities: tuple[str, ...], *, axes: bool = False, angle_unit: bool = False
) -> ColumnAssumption:
    """Return an assumption whose topic is not known yet."""
    return ColumnAssumption(Assumption(key, "", text, confirm), quantities, axes, angle_unit)


def flag_unit(unit: Unit) -> str:
    """Return how --map spells a unit; "" if it has no name there."""
    name = unit.name.replace("/", "").lower()
    return {"ms": ":mps", "kmh": ":kmh", "cms": ":cmps"}.get(name, f":{name}" if name.isalpha() else "")


def _metre() -> Unit:
    unit = unit_of_word("m")
    assert unit is not None
    return unit


def _are(names: str) -> str:
    return f"{names} {'are' if ',' in names else 'is'}"


# -- lengths


def _length(
    group: tuple[Picked, ...], *, standard: bool, proven: Finding | None = None, sides: tuple[str, ...] = ()
) -> tuple[list[Unit], str, ColumnAssumption | None]:
    """Return the unit of each column of a position or range, what states it, and what is assumed."""
    stated = next((one for one in group if one.unit), None)
    usual = stated.unit if stated and stated.unit else _metre()
    units = [one.unit or usual for one in group]
    largest = farthest(*(one.column.values * unit.scale for one, unit in zip(group, units, strict=True)))
    names = ", ".join(one.column.name for one in group)
    if stated or standard:
        why = stated.why if stated else _ROS
        if largest <= _FARTHEST_M:
            return units, why, None
        text = f"{names} would reach {largest:.4g} m in {usual.name} ({why}), which is too far; the unit is taken all the same"
        return units, why, _about_length(text, group, usual, sides)
    found = proven or length_unit(
        farthest(*(one.column.values for one in group)), integer=any(one.column.integer for one in group)
    )
    units = [found.unit] * len(group)
    if found.certain:
        return units, found.why, None
    text = f"{_are(names)} taken as {found.unit.name} ({found.why}); the message does not state the unit"
    return units, "assumed", _about_length(text, group, found.unit, sides)


def _about_length(text: str, group: tuple[Picked, ...], unit: Unit, sides: tuple[str, ...]) -> ColumnAssumption:
    """Return the assumption of a length's unit; for a position, confirmed in the radar's own axes."""
    quantities = tuple(one.meaning.quantity for one in group)
    targets = [_AS_MAPPED[side] for side in sides[: len(group)]] if sides else [(name, "") for name in quantities]
    maps = " ".join(
        f"--map {quantity}={minus}{one.column.name}{flag_unit(unit)}"
        for (quantity, minus), one in zip(targets, group, strict=True)
    )
    return assume("length-unit", text, maps if flag_unit(unit) else CONFIRM_ALL, quantities)


# -- Cartesian


def cartesian_part(chosen: Chosen, remarks: str, *, in_ros_frame: bool) -> ColumnPlan:
    """Plan a position from x, y and perhaps z."""
    group = tuple(chosen.picked[axis] for axis in "xyz" if axis in chosen.picked)
    standard = in_ros_frame or all(one.column.standard for one in group)
    polar = _polar_of(chosen)
    directions, reasons, about_axes = _directions(group, remarks, polar, chosen, standard=standard)
    units, why, about = _length(group, standard=standard, proven=_by_range(chosen, polar), sides=directions)
    readings = [
        ColumnReading(one.meaning.quantity, one.column.name, unit.name, direction, f"unit: {why}; direction: {reason}")
        for one, unit, direction, reason in zip(group, units, directions, reasons, strict=False)
    ]
    scales = tuple(unit.scale for unit in units) + (1.0,) * (3 - len(units))
    distance, angle = chosen.picked.get("range"), chosen.picked.get("azimuth")
    return ColumnPlan(
        position=tuple(one.column.name for one in group),
        polar=False,
        scales=(scales[0], scales[1], scales[2]),
        directions=directions,
        claimed=(distance.column.name if distance else None, angle.column.name if angle else None, None),
        claimed_scales=(_claimed_range(chosen, units[0]), polar.angle.scale if polar else 1.0, 1.0),
        second_azimuth=chosen.second_azimuth.column.name if chosen.second_azimuth else None,
        readings=tuple(readings),
        assumptions=tuple(one for one in (about, about_axes) if one),
    )


def _claimed_range(chosen: Chosen, unit: Unit) -> float:
    distance = chosen.picked.get("range")
    return (distance.unit or unit).scale if distance else 1.0


def _polar_of(chosen: Chosen) -> PolarAgreement | None:
    """Compare the message's azimuth with its x and y."""
    picked = chosen.picked
    if "azimuth" not in picked:
        return None
    distance, z = picked.get("range"), picked.get("z")
    x, y = picked["x"].column.values, picked["y"].column.values
    return agreement(
        picked["azimuth"].column.values,
        distance.column.values if distance else None,
        x,
        y,
        z.column.values if z else None,
    )


def _by_range(chosen: Chosen, polar: PolarAgreement | None) -> Finding | None:
    """Find the unit of x and y by a range whose unit is stated."""
    distance = chosen.picked.get("range")
    if polar is None or distance is None or distance.unit is None:
        return None
    for word in ("m", "cm", "mm"):
        unit = unit_of_word(word)
        if unit and abs(polar.ranges_per_length * unit.scale / distance.unit.scale - 1) < 0.05:
            return Finding(unit, True, f"their length equals {distance.column.name}")
    return None


def _directions(
    group: tuple[Picked, ...], remarks: str, polar: PolarAgreement | None, chosen: Chosen, *, standard: bool
) -> tuple[tuple[str, str, str], list[str], ColumnAssumption | None]:
    """Return where x, y and z point, what states each, and what is assumed."""
    said = dict(axes_in(remarks)) | {
        one.meaning.quantity: side for one in group if (side := axis_side(one.column.comment)) is not None
    }
    whole = _whole(said)
    if whole:
        return whole, [_COMMENT, _COMMENT, _COMMENT if "z" in said else "as usual"], None
    if standard:
        return ("forward", "left", "up"), [_ROS] * 3, None
    forward, why = _forward(group, said, polar)
    lateral = _AXES[forward]
    side, why_side = _side(lateral, forward, said, polar, chosen)
    sides: dict[str, Direction] = {forward: said.get(forward, "forward"), lateral: side}
    reasons = {forward: why, lateral: why_side or "assumed"}
    directions = (sides["x"], sides["y"], "up")
    if why != "assumed" and why_side:
        return directions, [reasons["x"], reasons["y"], "as usual"], None
    x, y = (one.column.name for one in group[:2])
    known = f" (forward: {why})" if why != "assumed" else ""
    text = (
        f"{x} is taken as {directions[0]} and {y} as {directions[1]}{known}; the message does not state whether "
        f"{(x, y)[lateral == 'y']} grows to the left or to the right"
    )
    about = assume("axes", text, f"--radar-axes {','.join(directions)}", ("x", "y"), axes=True)
    return directions, [reasons["x"], reasons["y"], "as usual"], about


def _whole(said: dict[str, Direction]) -> tuple[str, str, str] | None:
    """Return the directions of x, y and z if comments state those of x and y; z is up if nothing else is said."""
    if "x" not in said or "y" not in said:
        return None
    found = (said["x"], said["y"], said.get("z", "up"))
    return found if len({_PLANES[side] for side in found}) == 3 else None


def _forward(group: tuple[Picked, ...], said: dict[str, Direction], polar: PolarAgreement | None) -> tuple[str, str]:
    """Return the forward axis, and what states it."""
    for axis in ("x", "y"):
        if said.get(axis) in ("forward", "backward"):
            return axis, _COMMENT
        if said.get(axis) in ("left", "right"):
            return _AXES[axis], _COMMENT
    if group[0].meaning.named_axis:
        return "x", "name"
    if polar is not None:
        return polar.forward, "its azimuth is 0 there"
    axis = forward_axis(group[0].column.values, group[1].column.values)
    return (axis, "its values are never negative") if axis else ("x", "assumed")


def _side(
    lateral: str, forward: str, said: dict[str, Direction], polar: PolarAgreement | None, chosen: Chosen
) -> tuple[Direction, str]:
    """Return where the lateral axis points, and what states it; "" if nothing does."""
    if said.get(lateral) in ("left", "right"):
        return said[lateral], _COMMENT
    turn = positive_side(chosen.picked["azimuth"].column.comment) if "azimuth" in chosen.picked else None
    if polar is not None and turn in ("left", "right"):
        return (
            turn if polar.toward > 0 else _OPPOSITE[turn]
        ), f"{chosen.picked['azimuth'].column.name} grows to the {turn}"
    return ("left" if forward == "x" else "right"), ""


# -- polar


def polar_part(chosen: Chosen, remarks: str) -> ColumnPlan:
    """Plan a position from range, azimuth and perhaps elevation."""
    distance, azimuth, elevation = (chosen.picked.get(name) for name in ("range", "azimuth", "elevation"))
    assert distance is not None
    assert azimuth is not None
    (unit,), why, about = _length((distance,), standard=False)
    angles = tuple(one for one in (azimuth, elevation) if one is not None)
    angle, why_angle, about_angle = _angle(angles)
    sign, why_sign, about_sign = _azimuth_sign(azimuth, angle, remarks)
    units = [one.unit or angle for one in angles]
    degrees = "deg" in angle.name
    base = unit_of_word("deg" if degrees else "rad")
    assert base is not None
    scales = [one.scale / base.scale for one in units]
    side = "left" if sign > 0 else "right"
    readings = [
        ColumnReading("range", distance.column.name, unit.name, "", f"unit: {why}"),
        ColumnReading(
            "azimuth", azimuth.column.name, units[0].name, f"to the {side}", f"unit: {why_angle}; sign: {why_sign}"
        ),
    ]
    if elevation is not None:
        readings.append(
            ColumnReading(
                "elevation", elevation.column.name, units[-1].name, "upwards", f"unit: {why_angle}; sign: as usual"
            )
        )
    sigma = [chosen.sigma.get(name) for name in ("range", "azimuth", "elevation")]
    usual = (unit.scale, *(scale * base.scale for scale in (scales[0], scales[-1])))
    own = [(one.unit.scale if one and one.unit else scale) for one, scale in zip(sigma, usual, strict=True)]
    return ColumnPlan(
        position=tuple(one.column.name for one in (distance, *angles)),
        polar=True,
        degrees=degrees,
        azimuth_sign=float(sign),
        scales=(unit.scale, scales[0], scales[1] if len(scales) > 1 else 1.0),
        claimed=(distance.column.name, azimuth.column.name, elevation.column.name if elevation else None),
        claimed_scales=(unit.scale, scales[0], scales[-1]),
        sigma=(_name(sigma[0]), _name(sigma[1]), _name(sigma[2])),
        sigma_scales=(own[0], own[1] / base.scale, own[2] / base.scale),
        second_azimuth=chosen.second_azimuth.column.name if chosen.second_azimuth else None,
        readings=tuple(readings),
        assumptions=tuple(one for one in (about, about_angle, about_sign, _about_vague(chosen)) if one),
    )


def _name(one: Picked | None) -> str | None:
    return one.column.name if one else None


def _angle(angles: tuple[Picked, ...]) -> tuple[Unit, str, ColumnAssumption | None]:
    """Return the unit of angles, what states it, and what is assumed."""
    stated = next((one for one in angles if one.unit), None)
    names = ", ".join(one.column.name for one in angles)
    found = angle_unit(angles[0].column.values, integer=angles[0].column.integer)
    if stated and stated.unit:
        unit = stated.unit
        if not _implausible(angles[0], unit, found):
            return unit, stated.why, None
        text = f"{_are(names)} taken as {unit.name} ({stated.why}), although the values look like {found.unit.name}: {found.why}"
        return unit, stated.why, _about_angle(text, angles, unit)
    if found.certain:
        return found.unit, found.why, None
    text = f"{_are(names)} taken as {found.unit.name} ({found.why}); the message does not state the unit"
    return found.unit, "assumed", _about_angle(text, angles, found.unit)


def _implausible(angle: Picked, unit: Unit, found: Finding) -> bool:
    """Return whether an angle's values contradict its stated unit."""
    values = angle.column.values[np.isfinite(angle.column.values)]
    too_wide = float(np.abs(values).max(initial=0.0)) * unit.scale > 2 * np.pi + 0.01
    return too_wide or (found.certain and unit.name in ("rad", "deg") and unit.name != found.unit.name)


def _about_angle(text: str, angles: tuple[Picked, ...], unit: Unit) -> ColumnAssumption:
    maps = " ".join(f"--map {one.meaning.quantity}={one.column.name}{flag_unit(unit)}" for one in angles)
    maps = maps if flag_unit(unit) else CONFIRM_ALL
    return assume("angle-unit", text, maps, tuple(one.meaning.quantity for one in angles), angle_unit=True)


def _azimuth_sign(azimuth: Picked, angle: Unit, remarks: str) -> tuple[int, str, ColumnAssumption | None]:
    side = positive_side(azimuth.column.comment)
    if side not in ("left", "right") and "azimuth" in remarks.lower():
        line = next(line for line in remarks.splitlines() if "azimuth" in line.lower())
        side = positive_side(line)
    if side in ("left", "right"):
        return (1 if side == "left" else -1), _COMMENT, None
    name = azimuth.column.name
    return 1, "assumed", assume(
        "azimuth-sign",
        f"{name} is taken as growing to the left; the message does not state it",
        f"--map azimuth={name}{flag_unit(angle)} (azimuth=-{name}{flag_unit(angle)} if it grows to the right)",
        ("azimuth",),
        axes=True,
    )  # fmt: skip


def _about_vague(chosen: Chosen) -> ColumnAssumption | None:
    if not chosen.vague:
        return None
    first, second = (one.column.name for one in chosen.vague)
    return assume(
        "field-meaning",
        f"{first} is taken as the azimuth and {second} as the elevation; the message does not state which is which",
        f"--map azimuth={first} --map elevation={second}",
        ("azimuth", "elevation"),
    )
