"""How often is a warning given where nothing but the stated errors is wrong?"""

from collections.abc import Sequence
from functools import partial
from itertools import product

import numpy as np

from benchmarks.accuracy.defects.pair_defects import random_rig_apart
from benchmarks.accuracy.defects.shared_errors import Shared, draw_shared, measure_shared
from benchmarks.accuracy.figures import MET, UNDECIDED, Measured, at_most, share, worst
from benchmarks.accuracy.outcomes import codes_in, outcome_figures
from benchmarks.accuracy.rows import Claim, Figures, Kept, Part, Row, Section
from benchmarks.simulated_pairs import NoiseName, SystematicErrors, draw_systematic_errors, simulate_pairs, study_camera
from calib_core.calibration import calibrate_pairs
from calib_core.options import CalibrationOptions

__all__ = ["HANDEDNESS_CODES", "ROWS", "measure_apart", "measure_clean_draw", "section"]

_TRIALS = 84  # times twelve rows: 1,008
_APART_TRIALS, _APART_M = 100, 3.0
_AIM = 2.0  # percent
_TRUE_SCALE = 0.01
_NOISES: tuple[NoiseName, ...] = ("ti", "imaging")
HANDEDNESS_CODES = ("handedness-assumed", "handedness-open")
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
    *(Row(_key(case), _TRIALS, partial(measure_clean_draw, case)) for case in _CASES),
    *(Row(_apart_key(noise), _APART_TRIALS, partial(measure_apart, noise)) for noise in _NOISES),
)


def section(kept: Kept) -> Section:
    """Write the tables: the share of each code over all clean draws, and where it is highest."""
    by_case = {case: kept.get(_key(case), ()) for case in _CASES}
    everything = [figures for trials in by_case.values() for figures in trials]
    title = "Nothing wrong: how often is there a warning?"
    if not everything:
        return Section(title, _TEXT, (), (_claim([], 0, 0),))
    cells, verdicts = [], []
    for code in sorted({code for figures in everything for code in codes_in(figures)}):
        measured = _share(everything, code)
        verdict = "" if code in HANDEDNESS_CODES else at_most(measured, _AIM)
        verdicts += [verdict] if verdict else []
        most = max((case for case in _CASES if by_case[case]), key=lambda case: _share(by_case[case], code).value)
        where = f"{_told(most)}: {_share(by_case[most], code).value:.0f} %"
        aim = "stated by itself" if code in HANDEDNESS_CODES else f"{_AIM:g} %"
        cells.append((f"`{code}`", str(len(everything)), measured.percent, aim, verdict, where))
    fewest = min(len(trials) for trials in by_case.values())
    parts = (
        Part("", ("warning", "draws", "share", "aim", "", "most often in"), tuple(cells)),
        Part("Sensors 3 m apart, distance not told", ("noise", "draws", "warnings"), _apart_cells(kept)),
    )
    return Section(title, _TEXT, parts, (_claim(verdicts, len(everything), fewest),))


def _share(trials: Sequence[Figures], code: str) -> Measured:
    return share(np.array([float(code in codes_in(figures)) for figures in trials]))


def _told(case: Shared) -> str:
    return f"{case.noise}, {case.pairs}, {'free' if case.tape_m is None else 'tape'}"


def _claim(verdicts: list[str], draws: int, fewest: int) -> Claim:
    aim = "each warning, handedness apart, in at most 2 % of 1,000 clean draws"
    if not draws:
        return Claim(aim, "not run", "not run")
    verdict = worst(verdicts) if verdicts else MET
    above = sum(one != MET for one in verdicts)
    if verdict == MET and fewest < _TRIALS:
        verdict = UNDECIDED
    return Claim(aim, f"{above} of {len(verdicts)} warnings that occur are above; {draws:,} draws", verdict)


def _apart_cells(kept: Kept) -> tuple[tuple[str, ...], ...]:
    cells = []
    for noise in _NOISES:
        trials = kept.get(_apart_key(noise), ())
        codes = sorted({code for figures in trials for code in codes_in(figures)})
        shown = ", ".join(f"`{code}` {_share(trials, code).value:.0f} %" for code in codes) or "none"
        if trials:
            cells.append((noise, str(len(trials)), shown))
    return tuple(cells)


_TEXT = """Field scene on flat ground, no wrong pairs, 12, 20 and 40 pairs, camera position free or given to 1 cm, shared errors
drawn from the priors, default options. A warning of scaled angles is not counted where a scale of more than 1 % was drawn: it
is true. On flat ground without a camera position the handedness is an open question, so the two codes about it have no aim.
"Most often in" is the cell with the highest share."""
