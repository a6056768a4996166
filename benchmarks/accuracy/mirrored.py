"""Is a radar with a mirrored axis detected?"""

from dataclasses import dataclass, replace
from functools import partial
from itertools import product

import numpy as np

from benchmarks.accuracy.cases import Case, draw, tape_measured
from benchmarks.accuracy.figures import MET, MISSED, column, fewest, share, summed_up
from benchmarks.accuracy.rows import Figures, Kept, Part, Row, Section
from benchmarks.simulated_pairs import NoiseName, SimulatedPairs
from calib_core.calibration import calibrate_pairs
from calib_core.measurements import Pair
from calib_core.options import CalibrationOptions, SolvingOptions
from calib_core.results import Calibration

__all__ = ["ROWS", "Mirrored", "measure_mirrored", "section"]

_TRIALS = 300
_NEAR_M = 0.3
_CODE = "mirrored-axes"
_NOISES: tuple[NoiseName, ...] = ("ti", "imaging")
_AXES = {"left": (1.0, -1.0, 1.0), "up": (1.0, 1.0, -1.0)}


@dataclass(frozen=True, slots=True)
class Mirrored:
    """What is drawn: noise, pairs, the axis with the wrong sign, and whether the camera position is measured."""

    noise: NoiseName
    pairs: int
    axis: str = "left"
    measured: bool = False

    @property
    def key(self) -> str:
        """A file name."""
        return f"mirrored-{self.noise}-{self.pairs}-{self.axis}-{'tape' if self.measured else 'near'}"


_CASES = (
    *(Mirrored(noise, pairs) for noise, pairs in product(_NOISES, (10, 20, 40))),
    *(Mirrored(noise, 20, axis="up") for noise in _NOISES),
    *(Mirrored(noise, 20, measured=True) for noise in _NOISES),
)


def measure_mirrored(case: Mirrored, trial: int) -> Figures:
    """Solve one trial with the input as drawn and mirrored."""
    simulated = draw(Case(case.noise, case.pairs, 0.1), trial)
    solving = tape_measured(0.01) if case.measured else SolvingOptions(nominal_camera_distance_m=_NEAR_M)
    options = CalibrationOptions(solving=solving)
    turned = tuple(_turned(pair, np.array(_AXES[case.axis])) for pair in simulated.pairs)
    mirrored = replace(simulated, pairs=turned)
    return {"caught": _caught(mirrored, options), "false_alarm": _caught(simulated, options)}


def _turned(pair: Pair, signs: np.ndarray) -> Pair:
    candidates = tuple(
        replace(
            one, position_radar_m=one.position_radar_m * signs, covariance_m2=one.covariance_m2 * np.outer(signs, signs)
        )
        for one in pair.candidates
    )
    return replace(pair, candidates=candidates)


def _caught(simulated: SimulatedPairs, options: CalibrationOptions) -> float:
    """Return 1 if the outcome reports mirrored axes."""
    outcome = calibrate_pairs(simulated.pairs, simulated.camera, options)
    named = [one.code for one in outcome.warnings] if isinstance(outcome, Calibration) else [outcome.code]
    return float(_CODE in named)


ROWS = tuple(Row(case.key, _TRIALS, partial(measure_mirrored, case)) for case in _CASES)


def section(kept: Kept) -> Section:
    """Write the table."""
    cells, verdicts = [], []
    for case in _CASES:
        trials = kept.get(case.key, ())
        if not trials:
            continue
        caught, alarms = column(trials, "caught"), column(trials, "false_alarm")
        verdicts.append(MET if caught.all() else MISSED)
        known = "measured to 1 cm" if case.measured else f"within {_NEAR_M:g} m"
        counts = (f"{caught.sum():.0f}", f"{alarms.sum():.0f}")
        cells.append((case.noise, str(case.pairs), case.axis, known, str(len(trials)), *counts, "all", verdicts[-1]))
        cells[-1] = (*cells[-1][:5], f"{counts[0]} ({share(caught).value:.1f} %)", *cells[-1][6:])
    head = ("noise", "pairs", "axis", "camera position", "trials", "caught", "false alarms", "aim", "")
    trial_counts = fewest(kept, [row.key for row in ROWS])
    claim = summed_up(
        "mirrored input caught in every trial, nominal camera position within 0.3 m", verdicts, trial_counts
    )
    return Section("Is a mirrored radar axis detected?", _TEXT, (Part("", head, tuple(cells)),), (claim,))


_TEXT = """Placements on the ground, one pair in ten wrong; y or z of every radar position has the wrong sign. "Caught"
means that the outcome reports mirrored axes; "false alarms" that it does so for the same pairs with the right signs."""
