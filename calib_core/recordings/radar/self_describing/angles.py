"""A polar position: the unit of its range and angles and the side to which its azimuth grows, with what states each."""

import numpy as np

from calib_core.recordings.assumptions import CONFIRM_ALL
from calib_core.recordings.field_words.units import Unit, unit_of_word
from calib_core.recordings.radar.column_plan import ColumnAssumption, ColumnPlan, ColumnReading
from calib_core.recordings.radar.self_describing.candidates import Chosen, Picked
from calib_core.recordings.radar.self_describing.comments import positive_side
from calib_core.recordings.radar.self_describing.lengths import are, assume, flag_unit, length_unit_of
from calib_core.recordings.radar.self_describing.values import Finding, angle_unit

_COMMENT = "comment in the definition"


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
