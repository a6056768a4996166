"""A Cartesian position: its unit and its axes, with what states each."""

import numpy as np

from calib_core.recordings.field_words.units import Unit, unit_of_word
from calib_core.recordings.radar.axes import RadarAxes
from calib_core.recordings.radar.column_plan import ColumnAssumption, ColumnPlan, ColumnReading
from calib_core.recordings.radar.self_describing.candidates import Chosen, Picked
from calib_core.recordings.radar.self_describing.comments import Direction, axes_in, axis_side, positive_side
from calib_core.recordings.radar.self_describing.lengths import assume, length_unit_of
from calib_core.recordings.radar.self_describing.values import Finding, PolarAgreement, agreement, forward_axis

_COMMENT = "comment in the definition"
_ROS = "ROS defines it (REP 103)"
_AXES = {"x": "y", "y": "x"}
_PLANES = {"forward": 0, "backward": 0, "left": 1, "right": 1, "up": 2, "down": 2}
_OPPOSITE: dict[Direction, Direction] = {"left": "right", "right": "left", "forward": "backward", "backward": "forward"}


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
