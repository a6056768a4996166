"""`python -m benchmarks.accuracy.ablation`: what does each part of the method do? Each is left out in turn.

6 and 20 pairs of both radars, no tape, three in ten wrong, with the errors that all pairs share and a quarter of the variance of
the radar's angles smooth over direction. A part is left out by an option, or by replacing one value of its module.
"""

import argparse
import os
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from types import ModuleType
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks.accuracy.cases import exact_instruments
from benchmarks.accuracy.defects.shared_errors import Shared, draw_shared
from benchmarks.accuracy.figures import rmse, share
from benchmarks.accuracy.outcomes import inside, outcome_figures, sold, solved_or_refused
from benchmarks.accuracy.rows import Figures
from calib_core.calibration import calibrate_pairs
from calib_core.estimation import alternative_poses, best_fit, covariance, errors_in_variables
from calib_core.options import CalibrationOptions
from cocalib.batch.worker_processes import WorkerProcesses

_DEFAULT = CalibrationOptions()
_FAR_M = 100.0


@dataclass(frozen=True, slots=True)
class Without:
    """How a part is left out: by options, or by a module's name and what replaces it."""

    options: CalibrationOptions = _DEFAULT
    module: ModuleType | None = None
    name: str = ""
    value: Any = None


WITHOUT: Mapping[str, Without] = {
    "nothing": Without(),
    "errors that all pairs share": Without(exact_instruments(_DEFAULT)),
    "smooth angle errors": Without(module=covariance, name="smooth_spread", value=lambda *_: None),
    "noise from the residuals": Without(replace(_DEFAULT, noise=replace(_DEFAULT.noise, estimate_scale=False))),
    "true positions": Without(module=errors_in_variables, name="NEAR_SIGMAS", value=0.0),
    "near outliers": Without(module=errors_in_variables, name="NEAR_OUTLIER_SHARE", value=1e-12),
    "all starts but one": Without(module=best_fit, name="_STARTS_FREE", value=1),
    "other peaks": Without(module=alternative_poses, name="_MOST_PAIRS", value=0),
    "the camera's place": Without(
        replace(_DEFAULT, solving=replace(_DEFAULT.solving, nominal_camera_distance_m=_FAR_M))
    ),
}
"""The parts, and what leaves each out."""

_CASES = tuple(
    Shared(noise, pairs, None, outlier_share=0.3, smooth_share=0.25) for pairs in (6, 20) for noise in ("ti", "imaging")
)


def _solve(case: Shared, part: str, trials: list[int]) -> list[Figures]:
    without, figures = WITHOUT[part], []
    for trial in trials:
        drawn = draw_shared(case, trial)
        replaced = patch.object(without.module, without.name, without.value) if without.module else nullcontext()
        with replaced:
            outcome = solved_or_refused(partial(calibrate_pairs, drawn.pairs, drawn.camera, without.options))
        figures.append(outcome_figures(outcome, drawn.camera_from_radar))
    return figures


def main() -> None:
    """Print a table, a row for each part that was left out."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.accuracy.ablation", description=__doc__)
    parser.add_argument("--trials", type=int, default=48, help="sets of each case")
    parser.add_argument("--first", type=int, default=70_000_000, help="number of the first draw")
    given = parser.parse_args()
    trials = list(range(given.first, given.first + given.trials))
    chunks = [(case, part, [10 * trial + at for trial in trials]) for part in WITHOUT for at, case in enumerate(_CASES)]
    figures: dict[str, list[Figures]] = {part: [] for part in WITHOUT}
    for number, solved in WorkerProcesses(min(os.cpu_count() or 1, 4)).run_all(_solve, chunks):
        figures[chunks[number][1]] += solved
    print(
        "| without | rotation [deg] | position [cm] | inside 95 % | good or usable | of these inside |\n|---|---|---|---|---|---|"
    )
    for part, sets in figures.items():
        relied, held = sold(sets), inside(sets)
        turned, away = np.rad2deg(rmse(sets, "rotation_rad")), 100.0 * rmse(sets, "position_m")
        print(
            f"| {part} | {turned:.2f} | {away:.1f} | {share(held).percent} | {int(relied.sum())} of {len(sets)} | "
            f"{share(held[relied]).percent} |"
        )


if __name__ == "__main__":
    main()
