"""One click is dragged across the picture: does the pose follow without jumps?"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from benchmarks.accuracy.cases import tape_measured
from benchmarks.accuracy.figures import MET, MISSED, UNDECIDED, column
from benchmarks.accuracy.rows import Claim, Figures, Kept, Part, Row, Section
from calib_core.calibration import calibrate_pairs
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration
from calib_core.synthetic import simulate_pairs
from calib_core.synthetic.simulated_pairs import NoiseName

__all__ = ["ROWS", "measure_drag", "section"]

_TRIALS = 30
_NOISES: tuple[NoiseName, ...] = ("ti", "imaging")
_TAPES = {"tape": 0.01, "free": None}
_STEP_PX, _STEPS = 3.0, 20
_JUMP = 1.0  # stated standard deviations within one step


def measure_drag(noise: NoiseName, tape_m: float | None, trial: int) -> Figures:
    """Drag the click of the nearest placement to the right, 3 px at a time, and find the largest step of the pose.

    A step is measured in stated standard deviations: the root of its squared Mahalanobis distance.
    """
    simulated = simulate_pairs(12, rng=np.random.default_rng([2035, trial]), noise=noise)
    nearest = int(np.linalg.norm(simulated.points_radar_m, axis=1).argmin())
    options = CalibrationOptions(solving=tape_measured(tape_m))
    solved: list[Calibration] = []
    for k in range(_STEPS + 1):
        pairs = list(simulated.pairs)
        pixel_px = pairs[nearest].pixel_px + np.array([_STEP_PX * k, 0.0])
        pairs[nearest] = replace(pairs[nearest], pixel_px=pixel_px)
        outcome = calibrate_pairs(pairs, simulated.camera, options)
        if isinstance(outcome, Calibration):
            solved.append(outcome)
    return {"largest": max((_step(a, b) for a, b in pairwise(solved)), default=None)}


def _step(before: Calibration, after: Calibration) -> float:
    error = after.camera_from_radar.error_from(before.camera_from_radar)
    return float(np.sqrt(error @ np.linalg.solve(before.covariance, error)))


def _key(noise: NoiseName, known: str) -> str:
    return f"drag-{noise}-{known}"


ROWS = tuple(
    Row(_key(noise, known), _TRIALS, partial(measure_drag, noise, tape_m))
    for noise in _NOISES
    for known, tape_m in _TAPES.items()
)


def section(kept: Kept) -> Section:
    """Write the table."""
    cells, above, draws = [], 0, 0
    for noise in _NOISES:
        for known in _TAPES:
            trials: Sequence[Figures] = kept.get(_key(noise, known), ())
            if not trials:
                continue
            largest = column(trials, "largest")
            jumps = int((largest > _JUMP).sum())
            above, draws = above + jumps, draws + len(trials)
            what = (noise, known, str(len(trials)), f"{np.nanmedian(largest):.2f}", f"{np.nanmax(largest):.2f}")
            cells.append((*what, str(jumps), MISSED if jumps else MET))
    head = ("noise", "camera position", "trials", "largest step, median", "largest step of all", "above 1 sigma", "")
    aim = "one click dragged 3 px at a time moves the pose by at most one stated sigma a step"
    verdict = MISSED if above else MET if draws >= _TRIALS * len(ROWS) else UNDECIDED
    claim = Claim(aim, f"{above} of {draws} drags jump", verdict) if draws else Claim(aim, "not run", "not run")
    title = "A click is dragged: does the pose jump?"
    return Section(title, _TEXT, (Part("", head, tuple(cells)),), (claim,))


_TEXT = """Twelve pairs in the field. The click of the nearest placement is dragged 60 px to the right in steps of 3 px, and the
pairs are solved after every step. A step is the root of the squared Mahalanobis distance between two poses, by the covariance of
the first: the pose may not jump when a warning comes or goes."""
