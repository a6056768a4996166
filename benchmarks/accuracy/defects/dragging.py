"""One click is dragged across the image: does the pose follow without jumps?"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise, product

import numpy as np

from benchmarks.accuracy.cases import tape_measured
from benchmarks.accuracy.figures import MET, MISSED, at_most, column, counted
from benchmarks.accuracy.rows import Claim, Figures, Kept, Row, Section
from benchmarks.simulated_pairs import NoiseName, simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration

_TRIALS = 8
_NOISES: tuple[NoiseName, ...] = ("ti", "imaging")
_TAPES = {"tape": 0.01, "free": None}
_STEP_PX, _STEPS = 3.0, 20
_JUMP = 1.0  # stated standard deviations within one step
_MOST = 2.0  # percent


def measure_drag(noise: NoiseName, tape_m: float | None, trial: int) -> Figures:
    """Drag the click of the nearest placement to the right, 3 px at a time, and find the steps of the pose.

    A step is measured in stated standard deviations: the root of its squared Mahalanobis distance. Of those above one, it is
    counted with how many the answer says why: a click, or the measured position, begins or ceases to agree.
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
    steps = [(_step(a, b), _said(a) != _said(b)) for a, b in pairwise(solved)]
    jumps = [changed for step, changed in steps if step > _JUMP]
    return {
        "largest": max((step for step, _ in steps), default=None),
        "steps": float(len(steps)),
        "jumps": float(len(jumps)),
        "sides": float(sum(jumps)),
    }


def _said(calibration: Calibration) -> set[str]:
    """Return which clicks agree, and whether the measured position does not."""
    codes = {one.code for one in calibration.warnings} & {"camera-position-contradicted", "camera-position-doubtful"}
    return {pair.id for pair in calibration.pairs if pair.inlier} | codes


def _step(before: Calibration, after: Calibration) -> float:
    error = after.camera_from_radar.error_from(before.camera_from_radar)
    return float(np.sqrt(error @ np.linalg.solve(before.covariance, error)))


def _key(noise: NoiseName, known: str) -> str:
    return f"drag-{noise}-{known}"


ROWS = tuple(
    Row(_key(noise, known), _TRIALS, partial(measure_drag, noise, _TAPES[known]), draws)
    for draws, (noise, known) in enumerate(product(_NOISES, _TAPES))
)


def section(kept: Kept) -> Section:
    """Judge each row."""
    rows: list[dict[str, str]] = []
    everything: list[Figures] = []
    for noise in _NOISES:
        for known in _TAPES:
            trials = kept.get(_key(noise, known), ())
            if not trials:
                continue
            everything += trials
            largest = column(trials, "largest")
            steps, jumps, said = _sums(trials)
            rows.append(
                {"noise": noise, "camera position": known, "drags": str(len(trials)), "steps": str(steps)}
                | {"largest step, median [sigma]": f"{np.nanmedian(largest):.2f}"}
                | {"largest of all": f"{np.nanmax(largest):.2f}", "drags with a step above 1": str(_above(trials))}
                | {"steps above 1": str(jumps), "said why": str(said), "aim": f"{_MOST:g} % of the drags"}
                | {"verdict": at_most(counted(_above(trials), len(trials)), _MOST)}
            )
    steps, jumps, said = _sums(everything)
    above = _above(everything)
    claims = (
        Claim(
            "a step of 3 px moves the pose by more than one sigma in 2 %",
            f"{jumps} of {steps} steps",
            at_most(counted(jumps, steps), _MOST),
        ),
        Claim(
            "the same in at most 4 of 200 drags of 20 steps",
            f"{above} of {len(everything)} drags",
            at_most(counted(above, len(everything)), _MOST),
        ),
        Claim("where it does, the answer says why", f"{said} of {jumps}", MET if said == jumps else MISSED),
    )
    return Section("A click is dragged: does the pose jump?", _TEXT, claims, tuple(rows))


def _sums(trials: Sequence[Figures]) -> tuple[int, ...]:
    return tuple(int(np.nansum(column(trials, name))) for name in ("steps", "jumps", "sides"))


def _above(trials: Sequence[Figures]) -> int:
    return int((column(trials, "largest") > _JUMP).sum())


_TEXT = """12 pairs; the click of the nearest placement is dragged 60 px to the right. A step is the root of the squared
Mahalanobis distance between two poses, by the covariance of the first. The answer says why if a click, or the measured
position, begins or ceases to agree."""
