"""The recordings of the table; none of these settings was looked at while the search for targets was written."""

from collections.abc import Mapping
from dataclasses import replace

from calib_core.synthetic.options import SimulationOptions, Surroundings
from calib_core.synthetic.presets import PRESETS
from calib_core.synthetic.rig import RigOptions

__all__ = ["CASES"]

_PEOPLE, _ROBOT, _NEAR, _FAR = (PRESETS[name] for name in ("people", "robot", "cars-near", "cars-far"))
_OTHER_RIG = RigOptions(radar_height_m=1.6, radar_tilt_deg=13.0, camera_offset_m=(-0.05, -0.15, 0.12))


def _with(base: SimulationOptions, **traffic: float) -> SimulationOptions:
    return replace(base, traffic=replace(base.traffic, **traffic))  # type: ignore[arg-type]


CASES: Mapping[str, SimulationOptions] = {
    "1 walker": _with(_PEOPLE, walkers=1),
    "2 walkers, imaging radar": replace(_with(_PEOPLE, walkers=2), radar="imaging"),
    "5 walkers": _with(_PEOPLE, walkers=5),
    "3 walkers, other rig": replace(_PEOPLE, rig=_OTHER_RIG),
    "2 walkers in the field, cars parked": replace(
        _with(_PEOPLE, walkers=2), scene="field", surroundings=Surroundings(parked_cars=3, fence=True)
    ),
    "4 passers-by in the field, reflector carried": replace(
        PRESETS["default"], scene="field", placements=4, surroundings=Surroundings(passers_by=4)
    ),
    "2 walkers in the aisle": replace(_with(_PEOPLE, walkers=2), scene="aisle"),
    "2 robots in the aisle": _with(_ROBOT, robots=2),
    "1 car, 10 to 40 m": _with(_NEAR, cars=1, nearest_m=10.0, farthest_m=40.0),
    "4 cars, 5 to 20 m": _with(_NEAR, cars=4),
    "6 cars, 20 to 80 m": _with(_FAR, cars=6, farthest_m=80.0),
}
"""Options by what the table calls them; the seed is set for each draw."""
