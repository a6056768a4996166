"""A smooth angle error of the radar: does the stated 95 % hold, and do new placements project to where they are clicked?"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.accuracy.cases import Case, tape_measured
from benchmarks.accuracy.defects.shared_errors import (
    ERRORS,
    Shared,
    coverage_cells,
    measure_shared,
    shared_key,
    silent_claim,
)
from benchmarks.accuracy.efficiency import inside
from benchmarks.accuracy.figures import at_least, at_most, low, share, stated_over_rmse, tally
from benchmarks.accuracy.methods import as_printed, best_threshold_px
from benchmarks.accuracy.outcomes import inside as flags_inside
from benchmarks.accuracy.outcomes import sold
from benchmarks.accuracy.rows import Claim, Figures, Kept, Row, Section
from benchmarks.simulated_pairs import FIELD, SimulatedPairs, simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.diagnostics.angle_map import learn_angle_map
from calib_core.geometry import RigidTransform
from calib_core.options import CalibrationOptions
from calib_core.radar import cartesian_from_polar, polar_from_cartesian
from calib_core.results import Calibration

_TRIALS = 64  # times two radars, with and without a tape: 256 a share
_AIMS = {0.0: 95.0, 0.25: 93.0, 0.49: 90.0, 0.81: 90.0}
_HELD_OUT = 100
_SMOOTH_DEG = (0.3, 0.8)  # rms of azimuth and elevation
_OWN = (0.005, np.deg2rad(0.08), np.deg2rad(0.22))  # range [m], azimuth, elevation: independent error of each placement
_VALLEY_RAD = 0.25
_WAVES = 200
_LAYOUT = replace(FIELD, separation_m=0.05)


def measure_smooth(count: int, trial: int) -> Figures:
    """Solve one trial by both methods and evaluate placements that neither has used.

    Args:
        count: pairs to solve with.
        trial: its number.
    """
    rng = np.random.default_rng([2024, trial])
    true = simulate_pairs(count + _HELD_OUT, rng=rng, layout=_LAYOUT)
    own, shared = _angle_errors(rng, true)
    everything, true = _measured_off_by(true, own + shared), _measured_off_by(true, own)
    simulated = _first(everything, count)
    case = Case("ti", count)
    outcome = calibrate_pairs(simulated.pairs, simulated.camera, CalibrationOptions(solving=tape_measured(case.tape_m)))
    ours = outcome if isinstance(outcome, Calibration) else None
    paper = as_printed(simulated, best_threshold_px(case, float(simulated.camera.matrix_px[0, 0])))
    return {
        "inside": inside(simulated, ours),
        "held_out_px": None if ours is None else _aed_px(everything, count, ours.reproject),
        "mapped_px": None if ours is None else _aed_px(everything, count, _with_map(ours)),
        "paper_px": _held_out_px(everything, count, paper),
        "best_px": _held_out_px(true, count, everything.camera_from_radar),
    }


def _with_map(calibration: Calibration) -> Callable[[np.ndarray], np.ndarray]:
    """Return the projection with the learnt angle errors removed, if the map says that this helps."""
    learnt = learn_angle_map(calibration)
    if learnt is None or not learnt.pays:
        return calibration.reproject
    return lambda points: calibration.camera.project(
        calibration.camera_from_radar @ learnt.corrected(calibration.radar_errors.corrected(points))
    )


def _angle_errors(rng: np.random.Generator, simulated: SimulatedPairs) -> tuple[np.ndarray, np.ndarray]:
    """Draw each placement's own error and the error shared by neighbours: (n, 3) range [m], azimuth, elevation [rad]."""
    directions = polar_from_cartesian(simulated.points_radar_m)[:, 1:]
    own = np.array(_OWN) * rng.standard_normal((len(directions), 3))
    smooth = np.zeros_like(own)
    for axis, rms_deg in enumerate(_SMOOTH_DEG, start=1):
        smooth[:, axis] = _smooth(rng, directions, np.deg2rad(rms_deg))
    return own, smooth


def _measured_off_by(simulated: SimulatedPairs, off: np.ndarray) -> SimulatedPairs:
    """Shift every radar position from its true one by (n, 3) range [m], azimuth and elevation [rad]."""
    measured = cartesian_from_polar(polar_from_cartesian(simulated.points_radar_m) + off)
    pairs = tuple(
        replace(pair, candidates=(replace(pair.candidates[0], position_radar_m=point),))
        for pair, point in zip(simulated.pairs, measured, strict=True)
    )
    return replace(simulated, pairs=pairs)


def _smooth(rng: np.random.Generator, directions: np.ndarray, rms_rad: float) -> np.ndarray:
    """Draw a smooth function of azimuth and elevation (n, 2): a Gaussian process as a sum of random waves."""
    waves, phases = rng.standard_normal((_WAVES, 2)) / _VALLEY_RAD, rng.uniform(0.0, 2.0 * np.pi, _WAVES)
    return np.asarray(
        rms_rad * np.sqrt(2.0 / _WAVES) * np.cos(directions @ waves.T + phases) @ rng.standard_normal(_WAVES)
    )


def _first(simulated: SimulatedPairs, count: int) -> SimulatedPairs:
    return replace(
        simulated,
        pairs=simulated.pairs[:count],
        points_radar_m=simulated.points_radar_m[:count],
        pixels_px=simulated.pixels_px[:count],
        outlier=simulated.outlier[:count],
        true_candidate=simulated.true_candidate[:count],
    )


def _held_out_px(everything: SimulatedPairs, count: int, pose: RigidTransform | None) -> float | None:
    """Return the AED under a pose, over the placements after the first ones."""
    if pose is None:
        return None
    return _aed_px(everything, count, lambda points: everything.camera.project(pose @ points))


def _aed_px(everything: SimulatedPairs, count: int, project: Callable[[np.ndarray], np.ndarray]) -> float:
    rest = everything.pairs[count:]
    points = np.array([pair.candidates[0].position_radar_m for pair in rest])
    away_px = project(points) - np.array([pair.pixel_px for pair in rest])
    return float(np.nanmean(np.linalg.norm(away_px, axis=1)))


_CASES = {
    part: tuple(Shared(noise, 20, tape_m, smooth_share=part) for noise in ("ti", "imaging") for tape_m in (0.01, None))
    for part in _AIMS
}
ROWS = tuple(
    Row(shared_key(case), _TRIALS, partial(measure_shared, case), draws)
    for draws, case in enumerate((case for part in _AIMS if part for case in _CASES[part]), start=20)
)
"""Those with a smooth error; the others are rows of the errors that all pairs share."""


def section(kept: Kept) -> Section:
    """Judge each share."""
    claims, rows, outside, sharp = [], [], [], []
    for part, cases in _CASES.items():
        for case in cases:
            trials = kept.get(shared_key(case), ())
            if len(trials) < 2:
                continue
            held, name = share(flags_inside(trials)), f"{case.noise} {'free' if case.tape_m is None else 'tape'}"
            aims = {"aim inside": f"{_AIMS[part]:g} %", "inside": at_least(held, _AIMS[part])}
            rows.append({"smooth": f"{part:.0%}", "row": name} | coverage_cells(trials) | aims)
            outside += [f"{100.0 * part:.0f} % smooth, {name} ({held.value:.0f} %)"] if low(held) else []
            ratios = [] if part else [stated_over_rmse(trials, *names) for names in ERRORS]
            sharp += [(name, f"{one.value:.2f}", at_most(one, _SHARPNESS)) for one in ratios]
        trials = [one for case in cases for one in kept.get(shared_key(case), ())]
        if trials:
            claims += _claims(part, trials)
    claims += [tally(f"none smooth: mean stated sigma at most {_SHARPNESS} times the RMSE", sharp)] if sharp else []
    title = "Smooth angle errors: does the stated 95 % hold?"
    return Section(title, _TEXT, tuple(claims), tuple(rows), tuple(outside))


_SHARPNESS = 1.3


def _claims(part: float, trials: Sequence[Figures]) -> list[Claim]:
    held, relied, aim = share(flags_inside(trials)), sold(trials), _AIMS[part]
    of_sold = share(flags_inside(trials)[relied])
    return [
        Claim(
            f"{100.0 * part:.0f} % smooth: {aim:g} % inside", f"{held.percent} of {len(trials)}", at_least(held, aim)
        ),
        Claim("of those good or usable: 95 %", f"{of_sold.percent} of {int(relied.sum())}", at_least(of_sold, 95.0)),
        silent_claim("none of them silent", trials),
    ]


_TEXT = """20 pairs, one in ten wrong, with the errors that all pairs share; the noise of the radar's angles is as stated in
sum, but a part of its variance is a Gaussian process over direction, with a length drawn from 10 to 40 deg. Equal numbers of
both radars, with and without a camera position measured to 1 cm."""
