"""Still returns as a witness: a radar that turned about its vertical, or did not, among people and cars that move.

The radar's turned scans are simulated, not rotated afterwards: its bins stay where they are.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.measurements import NS_PER_S, RadarScans, TimeNs
from calib_core.radar import RadarErrors
from calib_core.synthetic.presets import PRESETS
from calib_core.synthetic.scans import labelled_scans
from calib_core.synthetic.scene.stage import Stage, set_stage
from calib_core.watching.baseline import BASELINE_SCHEMA, Baseline
from calib_core.watching.still_returns import still_places
from calib_core.watching.traffic import Watched
from calib_core.watching.watching import Stretch, Watch
from calib_core.watching.witnesses import SeenTurn

__all__ = ["report"]

_KINDS = (
    "people/awr1843",
    "people/imaging",
    "cars-near/imaging",
    "robot/imaging",
    "robot/awr1843",
    "cars-near/awr1843",
)
_BASELINE_S, _STRETCH_S, _STRETCHES = 60, 30, 2
_TURN_DEG = 0.3
_YAW = 2


def report(seed: int, count: int) -> Iterator[str]:
    """Yield what still returns say of each recording: how many places, whether a turn is seen, and its size."""
    yield f"{_BASELINE_S} s of baseline, {_STRETCHES} stretches; radar turned by {_TURN_DEG} deg of azimuth"
    for number in range(count):
        kind = _KINDS[number % len(_KINDS)]
        preset, _, radar = kind.partition("/")
        traffic = replace(PRESETS[preset].traffic, duration_s=float(_BASELINE_S + _STRETCHES * _STRETCH_S))
        stage = set_stage(replace(PRESETS[preset], radar=radar, seed=seed + number, traffic=traffic))
        scans = _scans(stage, 0.0)
        places = still_places(scans.between(*_span(scans, 0, _BASELINE_S)))
        baseline = Baseline(BASELINE_SCHEMA, "0" * 64, "simulated", TimeNs(0), TimeNs(1), (1, 1), still_returns=places)
        words = []
        for name, seen in (("still", _seen(baseline, scans)), ("turned", _seen(baseline, _scans(stage, _TURN_DEG)))):
            if seen is None:
                words.append(f"{name}: says nothing")
                continue
            size, sigma = np.rad2deg(seen.rotation_rad[_YAW]), np.rad2deg(seen.sigma_rad[_YAW])
            found = "seen" if seen.turned[_YAW] else "not seen"
            others = ", another axis too" if seen.turned[:_YAW].any() else ""
            words.append(f"{name}: {size:+.2f} ± {sigma:.2f} deg, {found}{others}")
        yield f"{kind}, seed {seed + number}, {len(places)} places: {'; '.join(words)}"


def _scans(stage: Stage, turn_deg: float) -> RadarScans:
    turn = RigidTransform(rotation_exp(np.deg2rad([0.0, 0.0, turn_deg])), np.zeros(3))
    turned = replace(stage, rig=replace(stage.rig, radar_from_world=turn @ stage.rig.radar_from_world))
    return RadarScans.from_scans([scan for scan, _ in labelled_scans(turned, turned.antennas[0])])


def _span(scans: RadarScans, first_s: float, end_s: float) -> tuple[TimeNs, TimeNs]:
    start = int(scans.times_ns[0])
    return TimeNs(start + round(first_s * NS_PER_S)), TimeNs(start + round(end_s * NS_PER_S) - 1)


def _seen(baseline: Baseline, scans: RadarScans) -> SeenTurn | None:
    camera = Camera("pinhole", 1, 1, np.eye(3))
    watch = Watch(baseline, Watched(RigidTransform(np.eye(3), np.zeros(3)), camera, RadarErrors()))
    for number in range(_STRETCHES):
        first_s = _BASELINE_S + number * _STRETCH_S
        start, end = _span(scans, first_s, first_s + _STRETCH_S)
        verdict = watch.add(Stretch(start, TimeNs(end + 1), None, scans.between(start, end), None, still=True))
    return verdict.returns
