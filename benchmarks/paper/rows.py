"""The nine rows of Table I for one seed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.paper.settings import Dataset, Settings, ccm_options, pmm_options, ppm_options, session
from calib_core.association.pairing import pair_clicks
from calib_core.baselines.checkerboard import calibrate_on_board, pairs_on_corners
from calib_core.baselines.judging import judged_again
from calib_core.baselines.registration import register, register_linearly
from calib_core.baselines.swaps import swapped
from calib_core.calibration import calibrate
from calib_core.measurements import Unsolvable
from calib_core.results import Calibration
from calib_core.synthetic import SimulatedScans

__all__ = ["DATASETS", "Figures", "Seed", "calibrated", "measure"]

DATASETS: tuple[Dataset, ...] = ("d1", "d2", "d3", "dr-a", "dr-b")
_FEWEST_CORNERS, _MORE_CORNERS = 4, 12
"""Four corners are the fewest that give the twelve equations of [R | t]."""
_CORNER_PX = 0.1
"""Standard deviation of a corner found in a picture."""


@dataclass(frozen=True, slots=True)
class Figures:
    """One row for one seed.

    Attributes:
        aed_px: NaN if there is no pose, or none of the points is before the camera.
        cdsd_px: likewise.
        outside: share of the clicked radar positions that the pose puts outside the picture.
        condition: condition number of the registration; NaN for other methods.
    """

    aed_px: float
    cdsd_px: float
    outside: float
    condition: float = float("nan")


@dataclass(frozen=True, slots=True)
class Seed:
    """All rows for one seed: by name, and D1's pose judged on D2 and D3."""

    rows: Mapping[str, Figures]


def calibrated(dataset: Dataset, seed: int, settings: Settings) -> tuple[SimulatedScans, Calibration | Unsolvable]:
    """Simulate a data set and calibrate it by the paper's method."""
    simulated = session(dataset, seed, settings)
    return simulated, calibrate(simulated.clicks, simulated.scans, simulated.camera, ppm_options(settings))


def measure(seed: int, settings: Settings, datasets: Sequence[Dataset] = DATASETS) -> Seed:
    """Simulate data sets, D1 among them, and compute the rows that they give: of all of them, the nine and some more."""
    found = {dataset: calibrated(dataset, seed, settings) for dataset in datasets}
    rows = {f"PPM+{dataset.upper()}": _figures(outcome) for dataset, (_, outcome) in found.items()}
    first, by_points = found["d1"]
    by_mounting = calibrate(first.clicks, first.scans, first.camera, pmm_options(first))
    rows["PMM+D1"] = _figures(by_mounting)
    if isinstance(by_points, Calibration) and isinstance(by_mounting, Calibration):
        rows["R_PPM+T_m+D1"] = _figures(swapped(by_points, by_mounting))
        rows["R_I+T_c+D1"] = _figures(swapped(by_mounting, by_points))
        for corners in (_FEWEST_CORNERS, _MORE_CORNERS) if "d2" in found else ():
            on_board = session("d2", seed, settings, corners)
            for linear in (True, False):
                name = f"CCM+D1, {corners} corners, {'linear' if linear else 'rigid'}"
                rows[name] = _on_board(on_board, by_points, linear=linear)
        for dataset in ("d2", "d3"):
            _, other = found.get(dataset, (None, None))
            if isinstance(other, Calibration):
                again = judged_again(other, by_points.camera_from_radar)
                rows[f"D1's pose on {dataset.upper()}"] = _figures(again)
    return Seed(rows)


def _figures(outcome: Calibration | Unsolvable, condition: float = float("nan")) -> Figures:
    if isinstance(outcome, Unsolvable):
        return Figures(float("nan"), float("nan"), float("nan"), condition)
    used = np.array([pair.projected_px for pair in outcome.pairs if not pair.excluded])
    outside = 1.0 - float(outcome.camera.in_image(used).mean())
    return Figures(outcome.metrics.aed_px, outcome.metrics.cdsd_px, outside, condition)


def _on_board(simulated: SimulatedScans, judged_on: Calibration, *, linear: bool) -> Figures:
    """Calibrate on the checkerboard of D2 and judge the pose on D1.

    There are no pictures here: the corners are where the true lens puts them, as exactly as they are found in a picture.
    """
    board = simulated.stage.scene.board
    assert board is not None, "D2 has a checkerboard"
    options = ccm_options(simulated, linear=linear)
    rng = np.random.default_rng([simulated.stage.options.seed, 99])
    corners_px = simulated.camera.project(simulated.stage.rig.camera_from_world @ board.corners_m)
    corners_px = corners_px + _CORNER_PX * rng.standard_normal(corners_px.shape)
    pairs = pair_clicks(simulated.clicks, simulated.scans, options).pairs
    outcome = calibrate_on_board(pairs, corners_px, simulated.camera, options)
    if isinstance(outcome, Unsolvable):
        return _figures(outcome)
    on = pairs_on_corners(pairs, corners_px, options.board)
    radar_m = np.array([pair.candidates[0].position_radar_m for pair in on.pairs])
    camera_m = simulated.stage.rig.camera_from_world @ board.corners_m[list(on.corners)]
    found = (register_linearly if linear else register)(radar_m, camera_m)
    return _figures(
        judged_again(judged_on, outcome.camera_from_radar), float("nan") if found is None else found.condition
    )
