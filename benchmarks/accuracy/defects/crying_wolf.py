"""How often is a warning given where nothing but the stated errors is wrong?"""

from collections.abc import Sequence
from functools import partial
from itertools import product

import numpy as np

from benchmarks.accuracy.defects.pair_defects import random_rig_apart
from benchmarks.accuracy.defects.shared_errors import Shared, draw_shared, measure_shared
from benchmarks.accuracy.figures import Measured, at_most, share, tally
from benchmarks.accuracy.outcomes import codes_in, outcome_figures
from benchmarks.accuracy.rows import Figures, Kept, Row, Section
from benchmarks.simulated_pairs import NoiseName, SystematicErrors, draw_systematic_errors, simulate_pairs, study_camera
from calib_core.calibration import calibrate_pairs
from calib_core.options import CalibrationOptions

_TRIALS = 28  # times twelve rows: 336
_APART_TRIALS, _APART_M = 20, 3.0
_AIM = 2.0  # percent
_TRUE_SCALE = 0.01
_NOISES: tuple[NoiseName, ...] = ("ti", "imaging")
_CASES = tuple(
    Shared(noise, pairs, tape_m, 0.0) for tape_m, noise, pairs in product((0.01, None), _NOISES, (12, 20, 40))
)
_FIRST = 50_000  # other draws than those of the table of coverage


def measure_clean_draw(case: Shared, trial: int) -> Figures:
    """Solve one set whose only errors are noise and those that the options state."""
    systematic = draw_shared(case, _FIRST + trial).systematic
    return _without_true(measure_shared(case, _FIRST + trial), systematic)


def measure_apart(noise: NoiseName, trial: int) -> Figures:
    """Solve one set of a rig whose sensors are 3 m apart, without telling the distance."""
    rng = np.random.default_rng([2032, trial])
    rig = random_rig_apart(rng, camera=study_camera(), distance_m=_APART_M)
    simulated = simulate_pairs(20, rng=rng, noise=noise, rig=rig, systematic=draw_systematic_errors(rng))
    outcome = calibrate_pairs(simulated.pairs, simulated.camera, CalibrationOptions())
    return _without_true(outcome_figures(outcome, simulated.camera_from_radar), simulated.systematic)


def _without_true(figures: Figures, systematic: SystematicErrors) -> Figures:
    """Leave out a warning that is true: of scaled angles, if a scale of more than 1 % was drawn."""
    if max(abs(systematic.azimuth_scale), abs(systematic.elevation_scale)) <= _TRUE_SCALE:
        return figures
    return {name: value for name, value in figures.items() if codes_in({name: value}) != {"angle-scale"}}


def _key(case: Shared) -> str:
    return f"false-{case.key}"


def _apart_key(noise: NoiseName) -> str:
    return f"false-apart-{noise}"


ROWS = (
    *(Row(_key(case), _TRIALS, partial(measure_clean_draw, case), draws) for draws, case in enumerate(_CASES)),
    *(
        Row(_apart_key(noise), _APART_TRIALS, partial(measure_apart, noise), draws)
        for draws, noise in enumerate(_NOISES)
    ),
)


def section(kept: Kept) -> Section:
    """Judge the share of each code over all clean draws, and where it is highest."""
    by_case = {_told(case): kept[_key(case)] for case in _CASES if kept.get(_key(case))}
    everything = [figures for trials in by_case.values() for figures in trials]
    apart = [figures for noise in _NOISES for figures in kept.get(_apart_key(noise), ())]
    rows, judged = [], []
    for code in sorted({code for figures in (*everything, *apart) for code in codes_in(figures)}):
        for name, trials in (*by_case.items(), ("all", everything), ("sensors 3 m apart", apart)):
            if not trials:
                continue
            measured = _share(trials, code)
            rows.append({"warning": code, "sets of": name, "sets": str(len(trials)), "share": measured.percent})
            rows[-1] |= {"aim": f"{_AIM:g} %", "verdict": at_most(measured, _AIM)}
            if name in ("all", "sensors 3 m apart"):
                where = f"`{code}`" if name == "all" else f"`{code}`, 3 m apart"
                judged.append((where, f"{measured.value:.1f} %", rows[-1]["verdict"]))
    claims = (tally(f"each warning that occurs in at most {_AIM:g} % of {len(everything)} sets", judged),)
    return Section("Nothing wrong: how often is there a warning?", _TEXT, claims, tuple(rows))


def _share(trials: Sequence[Figures], code: str) -> Measured:
    return share(np.array([float(code in codes_in(figures)) for figures in trials]))


def _told(case: Shared) -> str:
    return f"{case.noise} {case.pairs} {'free' if case.tape_m is None else 'tape'}"


_TEXT = """12, 20 and 40 pairs, none wrong, with the errors that all pairs share; and 20 pairs of sensors 3 m apart, which is
not told. A warning of scaled angles is not counted where a scale of more than 1 % was drawn: it is true."""
