"""The nine rows of Table I for one seed."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.paper.settings import PPM, Dataset, Settings, other_rig, session
from calib_core.arrays import Points2, Points3
from calib_core.association.pairing import pair_clicks
from calib_core.calibration import calibrate, calibrate_pairs
from calib_core.geometry import RigidTransform, mounting_rotation, rotation_log
from calib_core.measurements import Pair, Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration
from calib_core.results.metrics import aed, cdsd, distances
from calib_core.synthetic.recording import SimulatedRecording
from calib_core.synthetic.rig import OTHER_OFFSET_M, OTHER_YAW_DEG

MOST_GROSS = 4


@dataclass(frozen=True, slots=True)
class Figures:
    """One row for one seed: AED and CDSD over all pairs, and the share of clicked radar positions outside the image."""

    aed_px: float
    cdsd_px: float
    outside: float


@dataclass(frozen=True, slots=True)
class Gross:
    """DR+D3 with some grossly wrong radar positions, by one method.

    Attributes:
        count: of wrong pairs.
        method: "paper" or "default".
        figures: over all pairs, the wrong ones included.
        rotation_deg: of the pose from the true one.
        position_m: of the camera from its true position.
        agreeing: pairs that the method counts as inliers.
        pairs: all of them.
    """

    count: int
    method: str
    figures: Figures
    rotation_deg: float
    position_m: float
    agreeing: int
    pairs: int


@dataclass(frozen=True, slots=True)
class Seed:
    """All that one seed gives.

    Attributes:
        rows: by the names of the paper's table; without a row where its method found no pose.
        conditions: of CCM: of its least-squares problem, and of the three by three numbers that stand for the rotation.
        gross: DR+D3 without wrong pairs and with 1 to 4, by both methods.
    """

    rows: dict[str, Figures]
    conditions: tuple[float, float] | None = None
    gross: tuple[Gross, ...] = ()


def calibrated(simulated: SimulatedRecording) -> Calibration | Unsolvable:
    """Calibrate a simulated data set by the paper's method (PPM)."""
    return calibrate(simulated.clicks, simulated.scans, simulated.camera, PPM)


def by_mounting(simulated: SimulatedRecording, *, other_rig: bool = False) -> RigidTransform:
    """Return camera_from_radar by tape measure and protractor (PMM): nominal rotation and measured offset."""
    own = simulated.options.rig.camera_offset_m, 0.0
    offset_m, yaw_deg = (OTHER_OFFSET_M, OTHER_YAW_DEG) if other_rig else own
    rotation = mounting_rotation(0.0, 0.0, yaw_deg)
    return RigidTransform(rotation, -rotation @ np.array(offset_m))


def by_checkerboard(simulated: SimulatedRecording, on_board: Calibration) -> tuple[np.ndarray, tuple[float, float]]:
    """Return CCM's matrix (3, 4), [R | t] of P_c = [R | t] P_r (paper, equation 1), with the conditions that a seed keeps.

    Its twelve numbers are found by linear least squares; none says that R is a rotation. P_c is the corner of the board
    nearest to the click, which the camera knows exactly. The corners lie in a plane, so the matrix maps every radar
    position into that plane: it is singular but for rounding.
    """
    board = simulated.stage.scene.board
    assert board is not None, "D2 has a checkerboard"
    corners_m = simulated.stage.rig.camera_from_world @ board.corners_m
    points, pixels_px = points_and_pixels(on_board)
    off_px = simulated.camera.project(corners_m)[None] - pixels_px[:, None]
    rows = _homogeneous(points)
    solution = np.linalg.lstsq(rows, corners_m[np.linalg.norm(off_px, axis=2).argmin(axis=1)], rcond=None)[0]
    return solution.T, (float(np.linalg.cond(rows)), float(np.linalg.cond(solution.T[:, :3])))


def _homogeneous(points_m: Points3) -> np.ndarray:
    return np.hstack([points_m, np.ones((len(points_m), 1))])


def measured_pairs(calibration: Calibration) -> list[Pair]:
    """Return the pairs that a calibration was made of."""
    return [one.measured for one in calibration.pairs if one.measured is not None]


def points_and_pixels(calibration: Calibration) -> tuple[Points3, Points2]:
    """Return radar position and click of each pair."""
    points = np.array([pair.point_radar_m for pair in calibration.pairs])
    return points, np.array([pair.pixel_px for pair in calibration.pairs])


def projected_by(pose: RigidTransform | np.ndarray | None, of: Calibration) -> Points2:
    """Return where a pose, or CCM's matrix, puts the radar positions of a calibration; without one, its own pose."""
    if pose is None:
        return np.array([pair.projected_px for pair in of.pairs])
    points, _ = points_and_pixels(of)
    return of.camera.project(pose @ points if isinstance(pose, RigidTransform) else _homogeneous(points) @ pose.T)


def figures_of(calibration: Calibration, pose: RigidTransform | np.ndarray | None = None) -> Figures:
    """Judge a calibration, or another pose or CCM's matrix on its pairs."""
    projected_px = projected_by(pose, calibration)
    lengths = distances(projected_px, points_and_pixels(calibration)[1])
    lengths = lengths[np.isfinite(lengths)]
    return Figures(aed(lengths), cdsd(lengths), 1.0 - float(calibration.camera.in_image(projected_px).mean()))


def measure(seed: int, settings: Settings, datasets: Sequence[Dataset] = ("d1", "d2", "d3")) -> Seed:
    """Simulate data sets, D1 among them, and compute the rows that they give."""
    found = {dataset: session(dataset, seed, settings) for dataset in datasets}
    outcomes = {dataset: calibrated(simulated) for dataset, simulated in found.items()}
    solved = {dataset: one for dataset, one in outcomes.items() if isinstance(one, Calibration)}
    rows = {f"PPM+{dataset.upper()}": figures_of(one) for dataset, one in solved.items()}
    conditions = None
    if first := solved.get("d1"):
        mounted, own = by_mounting(found["d1"]), first.camera_from_radar
        rows["PMM+D1"] = figures_of(first, mounted)
        rows["PPM+D1+T_m"] = figures_of(first, RigidTransform(own.rotation, mounted.translation_m))
        rows["PMM+D1+T_c"] = figures_of(first, RigidTransform(mounted.rotation, own.translation_m))
        if second := solved.get("d2"):
            matrix, conditions = by_checkerboard(found["d2"], second)
            rows["CCM+D2"], rows["CCM+D1"] = figures_of(second, matrix), figures_of(first, matrix)
    gross: tuple[Gross, ...] = ()
    if settings.gross_pairs and "d3" in found:
        gross = _gross_errors(other_rig(found["d3"]), settings)
        for one in gross:
            if (one.count, one.method) == (settings.gross_pairs, PPM.method):
                rows["PPM+DR+D3"] = one.figures
    return Seed(rows, conditions, gross)


def with_gross_errors(
    other: SimulatedRecording, count: int, by_m: float, options: CalibrationOptions = PPM
) -> Calibration | Unsolvable:
    """Calibrate with some radar positions displaced by a fixed distance in random horizontal directions."""
    if options.method == "paper":
        pairs = measured_pairs(calibrate(other.clicks, other.scans, other.camera, options).unwrap())
    else:
        pairs = list(pair_clicks(other.clicks, other.scans, options).pairs)
    return calibrate_pairs(displaced(pairs, count, by_m, other.stage.options.seed), other.camera, options)


def displaced(pairs: Sequence[Pair], count: int, by_m: float, seed: int) -> list[Pair]:
    """Displace the radar positions of some pairs; the same clicks and directions whatever the method made of the scans."""
    rng = np.random.default_rng([seed, 28])
    order = sorted((pair.id for pair in pairs), key=lambda name: (len(name), name))
    wrong = [order[i] for i in rng.permutation(len(order))[:count]]
    turns = dict(zip(wrong, rng.uniform(0.0, 2.0 * np.pi, MOST_GROSS), strict=False))
    return [pair if pair.id not in turns else _moved(pair, by_m, turns[pair.id]) for pair in pairs]


def _moved(pair: Pair, by_m: float, turn_rad: float) -> Pair:
    shift = by_m * np.array([abs(np.cos(turn_rad)), np.sin(turn_rad), 0.0])  # never behind the radar
    candidates = tuple(replace(one, position_radar_m=one.position_radar_m + shift) for one in pair.candidates)
    return replace(pair, candidates=candidates)


def _gross_errors(other: SimulatedRecording, settings: Settings) -> tuple[Gross, ...]:
    """Solve DR+D3 with 0 to 4 grossly wrong radar positions, by both methods."""
    tried = [(count, options) for options in (PPM, CalibrationOptions()) for count in range(MOST_GROSS + 1)]
    outcomes = ((count, with_gross_errors(other, count, settings.gross_m, options)) for count, options in tried)
    return tuple(_gross(one, other, count) for count, one in outcomes if isinstance(one, Calibration))


def _gross(outcome: Calibration, other: SimulatedRecording, count: int) -> Gross:
    found, true = outcome.camera_from_radar, other.camera_from_radar
    return Gross(
        count,
        outcome.options.method,
        figures_of(outcome),
        float(np.rad2deg(np.linalg.norm(rotation_log((found @ true.inverse()).rotation)))),
        float(np.linalg.norm(found.inverse().translation_m - true.inverse().translation_m)),
        sum(pair.inlier for pair in outcome.pairs),
        len(outcome.pairs),
    )
