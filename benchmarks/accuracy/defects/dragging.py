"""One click is dragged across the image: does the pose follow without jumps?"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from benchmarks.accuracy.cases import tape_measured
from benchmarks.accuracy.figures import MET, MISSED, at_most, column, share
from benchmarks.accuracy.rows import Claim, Figures, Kept, Part, Row, Section
from benchmarks.simulated_pairs import NoiseName, simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration

__all__ = ["ROWS", "measure_drag", "section"]

_TRIALS = 30
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
    Row(_key(noise, known), _TRIALS, partial(measure_drag, noise, tape_m))
    for noise in _NOISES
    for known, tape_m in _TAPES.items()
)


def section(kept: Kept) -> Section:
    """Write the table."""
    everything = {
        (noise, known): trials for noise in _NOISES for known in _TAPES if (trials := kept.get(_key(noise, known), ()))
    }
    cells = [_cells(*what, trials) for what, trials in everything.items()]
    head = ("noise", "camera position", "drags", "steps", "largest step, median", "largest step of all")
    head = (*head, "drags with a step above 1 sigma", "steps above 1 sigma", "of these the answer says why")
    drags = [one for trials in everything.values() for one in trials]
    title = "A click is dragged: does the pose jump?"
    return Section(title, _TEXT, (Part("", head, tuple(cells)),), _claims(drags))


def _cells(noise: str, known: str, trials: Sequence[Figures]) -> tuple[str, ...]:
    largest = column(trials, "largest")
    sums = [str(int(column(trials, name).sum())) for name in ("steps", "jumps", "sides")]
    what = (noise, known, str(len(trials)), sums[0], f"{np.nanmedian(largest):.2f}", f"{np.nanmax(largest):.2f}")
    return (*what, str(int((largest > _JUMP).sum())), *sums[1:])


def _claims(drags: Sequence[Figures]) -> tuple[Claim, ...]:
    steps_aim = "one click dragged by 3 px moves the pose by more than one stated sigma in at most 4 of 200 steps"
    drags_aim = "the same in at most 4 of 200 drags of twenty such steps"
    said_aim = "where it does, the answer says that a click or the measured position begins or ceases to agree"
    if not drags:
        return tuple(Claim(aim, "not run", "not run") for aim in (steps_aim, drags_aim, said_aim))
    steps, jumps, said = (int(column(drags, name).sum()) for name in ("steps", "jumps", "sides"))
    jumping = column(drags, "largest") > _JUMP
    each = share((np.arange(steps) < jumps).astype(np.float64))
    return (
        Claim(steps_aim, f"{jumps} of {steps}", at_most(each, _MOST)),
        Claim(drags_aim, f"{int(jumping.sum())} of {len(drags)}", at_most(share(jumping), _MOST)),
        Claim(said_aim, f"{said} of {jumps}", MET if said == jumps else MISSED),
    )


_TEXT = """Twelve pairs in the field. The click of the nearest placement is dragged 60 px to the right in steps of 3 px, and the
pairs are solved after every step. A step is the root of the squared Mahalanobis distance between two poses, by the covariance of
the first: the pose may not jump when a warning comes or goes. The answer says why if a click begins or ceases to agree,
"disagrees: p8: 31 px from its radar position", or the measured position does (`camera-position-contradicted`)."""
