"""Plan the columns of a message that no registry knows."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calib_core.recordings.assumptions import CONFIRM_ALL, Assumption
from calib_core.recordings.field_words import Unit, unit_of_word, words_of
from calib_core.recordings.radar.axes import RadarAxes
from calib_core.recordings.radar.column_plan import ColumnAssumption, ColumnPlan, ColumnReading
from calib_core.recordings.radar.described_columns import (
    Chosen,
    DescribedColumn,
    Direction,
    Finding,
    Picked,
    PolarAgreement,
    agreement,
    angle_unit,
    axes_in,
    axis_side,
    choose,
    farthest,
    forward_axis,
    length_unit,
    positive_side,
    speed_unit,
)

FARTHEST_M = 1000.0
"""No radar returns lie farther away."""


_AS_MAPPED = {
    "forward": ("x", ""), "backward": ("x", "-"), "left": ("y", ""), "right": ("y", "-"), "up": ("z", ""), "down": ("z", "-"),
}  # fmt: skip


_ROS = "ROS defines it (REP 103)"


_AXES = {"x": "y", "y": "x"}


_PLANES = {"forward": 0, "backward": 0, "left": 1, "right": 1, "up": 2, "down": 2}


_OPPOSITE: dict[Direction, Direction] = {"left": "right", "right": "left", "forward": "backward", "backward": "forward"}


_MOST_SENSORS = 8


_INVALID_POSITION = ("invalid_distance", "invalid_range", "invalid_azimuth", "invalid_elevation")


_INVALID_DOPPLER = ("invalid_range_rate", "invalid_doppler", "invalid_velocity")


_EITHER = "either: only its size matters"


_COMMENT = "comment in the definition"


def describe_columns(
    columns: Sequence[DescribedColumn], remarks: str = "", *, in_ros_frame: bool = False, known: bool = False
) -> ColumnPlan | None:
    """Plan the columns of a radar's message by names, comments and values; None if it does not look like a radar's.

    Args:
        columns: the numbers of one return.
        remarks: comments of the definition that belong to no field.
        in_ros_frame: positions are in the sensor's ROS frame, whose unit and axes ROS defines (PointCloud2).
        known: it is a radar's, or anything with positions will do.
    """
    chosen = choose(columns)
    if not known and not _looks_like_radar(chosen):
        return None
    cartesian = "x" in chosen.picked and "y" in chosen.picked
    polar = "range" in chosen.picked and "azimuth" in chosen.picked
    unfilled = cartesian and not (chosen.picked["x"].column.filled or chosen.picked["y"].column.filled)
    if cartesian and not (polar and unfilled):
        plan = cartesian_part(chosen, remarks, in_ros_frame=in_ros_frame)
    elif polar:
        plan = polar_part(chosen, remarks)
    else:
        return None
    metres = in_ros_frame and plan.scales[0] == 1.0
    return _flags(_amplitude(speed_part(plan, chosen, in_ros_frame=metres), chosen), columns)


def _looks_like_radar(chosen: Chosen) -> bool:
    """Return whether there is a position, and something that only radars measure."""
    picked = chosen.picked
    cartesian, polar = {"x", "y"} <= picked.keys(), {"range", "azimuth"} <= picked.keys()
    if polar:
        return True
    amplitude = "amplitude" in picked and picked["amplitude"].meaning.rank != 1
    return cartesian and (
        amplitude or ("doppler" in picked and picked["doppler"].meaning.radial) or {"vx", "vy"} <= picked.keys()
    )


def fill_in(plan: ColumnPlan, columns: Sequence[DescribedColumn]) -> ColumnPlan:
    """Add the speed and the amplitude that a plan made by plain names lacks, and a second hypothesis of the azimuth."""
    chosen = choose(columns)
    speed = chosen.picked.get("doppler")
    if plan.doppler is None and not plan.velocity and speed is not None and speed.meaning.radial:
        plan = replace(plan, doppler=speed.column.name, doppler_scale=speed.unit.scale if speed.unit else 1.0)
    level = chosen.picked.get("amplitude")
    if plan.amplitude is None and level is not None:
        plan = replace(plan, amplitude=level.column.name, amplitude_scale=level.unit.scale if level.unit else 1.0)
    return replace(plan, other_azimuths=chosen.other_azimuths)


def _amplitude(plan: ColumnPlan, chosen: Chosen) -> ColumnPlan:
    one = chosen.picked.get("amplitude")
    if one is None:
        return plan
    unit = one.unit.name if one.unit else "not stated"
    why = one.why if one.unit else "only differences between returns matter; they are taken as dB"
    return replace(
        plan,
        amplitude=one.column.name,
        amplitude_scale=one.unit.scale if one.unit else 1.0,
        readings=(*plan.readings, ColumnReading("amplitude", one.column.name, unit, "", why)),
    )


def _flags(plan: ColumnPlan, columns: Sequence[DescribedColumn]) -> ColumnPlan:
    """Use the flags of invalid values, and mention several sensors and second hypotheses."""
    names = {column.name.lower(): column for column in columns}
    flags = [column for column in columns if column.name.lower().rpartition(".")[2] in ("valid", "is_valid", "b_valid")]
    needed = [flag for flag in flags if len(flag.values) and set(flag.values.tolist()) in ({0.0, 1.0}, {1.0})]
    readings = [ColumnReading("valid", flag.name, "", "", "returns where it is 0 are skipped") for flag in needed]
    readings += [ColumnReading("other azimuth", name, "", "", "alternative") for name in plan.other_azimuths]
    return replace(
        plan,
        needed=tuple(flag.name for flag in needed),
        spoils_position=tuple(names[name].name for name in _INVALID_POSITION if name in names),
        spoils_doppler=tuple(names[name].name for name in _INVALID_DOPPLER if name in names),
        readings=(*plan.readings, *readings),
        assumptions=(*plan.assumptions, *_about_sensors(columns)),
        described=True,
    )


def _about_sensors(columns: Sequence[DescribedColumn]) -> list[ColumnAssumption]:
    found = []
    for column in columns:
        words, values = set(words_of(column.name)), sorted(set(column.values.tolist()))
        numbered = words & {"sensor", "radar"} and words & {"id", "idx", "index", "number"}
        if numbered and 1 < len(values) <= _MOST_SENSORS:
            ids = ", ".join(f"{value:g}" for value in values)
            found.append(
                assume(
                    "field-meaning",
                    f"'{column.name}' has the values {ids}, and all their returns are taken as one sensor's, in one frame",
                    CONFIRM_ALL,
                    (),
                )
            )
    return found


def assume(
    key: str, text: str, confirm: str, quantities: tuple[str, ...], *, axes: bool = False, angle_unit: bool = False
) -> ColumnAssumption:
    """Return an assumption whose topic is not known yet."""
    return ColumnAssumption(Assumption(key, "", text, confirm), quantities, axes, angle_unit)


def flag_unit(unit: Unit) -> str:
    """Return how --map spells a unit; "" if it has no name there."""
    return f":{unit.flag}" if unit.flag else ""


def _metre() -> Unit:
    unit = unit_of_word("m")
    assert unit is not None
    return unit


def are(names: str) -> str:
    """Return the names with the verb that fits their number."""
    return f"{names} {'are' if ',' in names else 'is'}"


def length_unit_of(
    group: tuple[Picked, ...], *, standard: bool, proven: Finding | None = None, sides: tuple[str, ...] = ()
) -> tuple[list[Unit], str, ColumnAssumption | None]:
    """Return the unit of each column of a position or range, what states it, and what is assumed."""
    stated = next((one for one in group if one.unit), None)
    usual = stated.unit if stated and stated.unit else _metre()
    units = [one.unit or usual for one in group]
    largest = farthest(*(one.column.values * unit.scale for one, unit in zip(group, units, strict=True)))
    names = ", ".join(one.column.name for one in group)
    if stated or (standard and largest <= FARTHEST_M):
        why = stated.why if stated else _ROS
        if largest <= FARTHEST_M:
            return units, why, None
        text = f"{names} would reach {largest:.4g} m in {usual.name} ({why}), which is too far; the unit is taken all the same"
        return units, why, _about_length(text, group, usual, sides)
    found = proven or length_unit(
        farthest(*(one.column.values for one in group)), integer=any(one.column.integer for one in group)
    )
    units = [found.unit] * len(group)
    if found.certain:
        return units, found.why, None
    text = f"{are(names)} taken as {found.unit.name} ({found.why}); the message does not state the unit"
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


def cartesian_part(chosen: Chosen, remarks: str, *, in_ros_frame: bool) -> ColumnPlan:
    """Plan a position from x, y and perhaps z."""
    group = tuple(chosen.picked[axis] for axis in "xyz" if axis in chosen.picked)
    standard = in_ros_frame or all(one.column.standard for one in group)
    polar = _polar_of(chosen)
    directions, reasons, about_axes = _directions(group, remarks, polar, chosen, standard=standard)
    units, why, about = length_unit_of(group, standard=standard, proven=_by_range(chosen, polar), sides=directions)
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
        other_azimuths=chosen.other_azimuths,
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
        return whole, [_COMMENT, _COMMENT, _COMMENT if "z" in said else "as usual"], _about_up(group, said, whole)
    if standard:
        return ("forward", "left", "up"), [_ROS] * 3, None
    forward, why = _forward(group, said, polar)
    lateral = _AXES[forward]
    side, why_side = _side(lateral, forward, said, polar, chosen)
    sides: dict[str, Direction] = {forward: said.get(forward, "forward"), lateral: side}
    reasons = {forward: why, lateral: why_side or "assumed"}
    directions = (sides["x"], sides["y"], "up")
    if why != "assumed" and why_side:
        return directions, [reasons["x"], reasons["y"], "as usual"], _about_up(group, said, directions)
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


def _about_up(
    group: tuple[Picked, ...], said: dict[str, Direction], directions: tuple[str, str, str]
) -> ColumnAssumption | None:
    """Return the assumption that z points up, unless a comment says so or x and y make it so in a right-handed frame."""
    if len(group) < 3 or "z" in said or np.linalg.det(RadarAxes(directions).matrix) > 0:
        return None
    name = group[2].column.name
    text = (
        f"{name} is taken as up; in a right-handed frame with x {directions[0]} and y {directions[1]} it would point down, "
        "and the message does not state it"
    )
    return assume("axes", text, f"--radar-axes {','.join(directions)}", ("x", "y", "z"), axes=True)


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


def polar_part(chosen: Chosen, remarks: str) -> ColumnPlan:
    """Plan a position from range, azimuth and perhaps elevation."""
    distance, azimuth, elevation = (chosen.picked.get(name) for name in ("range", "azimuth", "elevation"))
    assert distance is not None
    assert azimuth is not None
    (unit,), why, about = length_unit_of((distance,), standard=False)
    angles = tuple(one for one in (azimuth, elevation) if one is not None)
    angle, why_angle, about_angle = _angle(angles)
    sign, why_sign, about_sign = _azimuth_sign(azimuth, angle, remarks)
    units = [one.unit or angle for one in angles]
    degrees = "deg" in angle.name
    base = unit_of_word("deg" if degrees else "rad")
    assert base is not None
    scales = [one.scale / base.scale for one in units]
    down = elevation is not None and positive_side(elevation.column.comment) == "down"
    if down:
        scales[-1] = -scales[-1]
    side = "left" if sign > 0 else "right"
    readings = [
        ColumnReading("range", distance.column.name, unit.name, "", f"unit: {why}"),
        ColumnReading(
            "azimuth", azimuth.column.name, units[0].name, f"to the {side}", f"unit: {why_angle}; sign: {why_sign}"
        ),
    ]
    if elevation is not None:
        side, why = ("downwards", _COMMENT) if down else ("upwards", "as usual")
        why = f"unit: {why_angle}; sign: {why}"
        readings.append(ColumnReading("elevation", elevation.column.name, units[-1].name, side, why))
    sigma = [chosen.sigma.get(name) for name in ("range", "azimuth", "elevation")]
    usual = (unit.scale, *(abs(scale) * base.scale for scale in (scales[0], scales[-1])))
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
        other_azimuths=chosen.other_azimuths,
        readings=tuple(readings),
        assumptions=tuple(
            one for one in (about, about_angle, about_sign, _about_vague(chosen), _about_unused(chosen)) if one
        ),
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
        text = f"{are(names)} taken as {unit.name} ({stated.why}), although the values look like {found.unit.name}: {found.why}"
        return unit, stated.why, _about_angle(text, angles, unit)
    if found.certain:
        return found.unit, found.why, None
    text = f"{are(names)} taken as {found.unit.name} ({found.why}); the message does not state the unit"
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


def _about_unused(chosen: Chosen) -> ColumnAssumption | None:
    if not chosen.unused_heights:
        return None
    names = ", ".join(chosen.unused_heights)
    text = f"the returns are taken as level with the radar; {names} may hold their elevation or height, and is not used"
    return assume("field-meaning", text, CONFIRM_ALL, ("elevation",))


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


def speed_part(plan: ColumnPlan, chosen: Chosen, *, in_ros_frame: bool) -> ColumnPlan:
    """Add the speed to the plan of a position."""
    doppler = chosen.picked.get("doppler")
    velocity = tuple(chosen.picked[name] for name in ("vx", "vy", "vz") if name in chosen.picked)
    if doppler is not None:
        return _with_speed(replace(plan, doppler=doppler.column.name), (doppler,), "doppler", in_ros_frame)
    if len(velocity) < 2 or plan.polar or [one.meaning.quantity for one in velocity[:2]] != ["vx", "vy"]:
        return plan
    names = tuple(one.column.name for one in velocity)[: len(plan.position)]
    return _with_speed(replace(plan, velocity=names), velocity, "velocity", in_ros_frame)


def _with_speed(plan: ColumnPlan, group: tuple[Picked, ...], quantity: str, in_ros_frame: bool) -> ColumnPlan:
    stated = next((one for one in group if one.unit), None)
    names = ", ".join(one.column.name for one in group)
    metres = unit_of_word("mps")
    assert metres is not None
    assumptions = plan.assumptions
    if stated and stated.unit:
        unit, why = stated.unit, stated.why
    elif in_ros_frame or all(one.column.standard for one in group):
        unit, why = metres, "ROS defines it (REP 103)"
    else:
        found = speed_unit(group[0].column.values, integer=group[0].column.integer)
        unit, why = found.unit, "assumed"
        confirm = (
            f"--map doppler={group[0].column.name}{flag_unit(unit)}"
            if quantity == "doppler" and flag_unit(unit)
            else CONFIRM_ALL
        )
        verb = "is" if len(group) == 1 else "are"
        text = f"{names} {verb} taken as {unit.name} ({found.why}); the message does not state the unit"
        assumptions = (*assumptions, assume("speed-unit", text, confirm, ("doppler",)))
    sign = _EITHER if quantity == "doppler" else "as the position's"
    reading = ColumnReading(quantity, names, unit.name, sign, f"unit: {why}")
    return replace(plan, doppler_scale=unit.scale, readings=(*plan.readings, reading), assumptions=assumptions)
