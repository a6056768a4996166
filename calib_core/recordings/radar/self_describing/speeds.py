"""The radial speed of a return, or the velocity it follows from."""

from dataclasses import replace

from calib_core.recordings.assumptions import CONFIRM_ALL
from calib_core.recordings.field_words.units import unit_of_word
from calib_core.recordings.radar.column_plan import ColumnPlan, ColumnReading
from calib_core.recordings.radar.self_describing.candidates import Chosen, Picked
from calib_core.recordings.radar.self_describing.lengths import assume, flag_unit
from calib_core.recordings.radar.self_describing.values import speed_unit

_EITHER = "either: only its size matters"


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
