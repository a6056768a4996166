"""Plan the columns of a message that no registry knows."""

from collections.abc import Sequence
from dataclasses import replace

from calib_core.recordings.assumptions import CONFIRM_ALL
from calib_core.recordings.field_words.words import words_of
from calib_core.recordings.radar.column_plan import ColumnAssumption, ColumnPlan, ColumnReading
from calib_core.recordings.radar.self_describing.angles import polar_part
from calib_core.recordings.radar.self_describing.candidates import Chosen, DescribedColumn, choose
from calib_core.recordings.radar.self_describing.lengths import assume
from calib_core.recordings.radar.self_describing.positions import cartesian_part
from calib_core.recordings.radar.self_describing.speeds import speed_part

_MOST_SENSORS = 8
_INVALID_POSITION = ("invalid_distance", "invalid_range", "invalid_azimuth", "invalid_elevation")
_INVALID_DOPPLER = ("invalid_range_rate", "invalid_doppler", "invalid_velocity")


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
