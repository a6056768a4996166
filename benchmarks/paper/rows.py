"""The nine rows of Table I for one seed."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.paper.settings import Dataset, Settings, ppm_options, session
from calib_core.arrays import Points2, Points3
from calib_core.association.pairing import pair_clicks
from calib_core.calibration import calibrate, calibrate_pairs
from calib_core.geometry import RigidTransform, rotation_log
from calib_core.measurements import Pair, Unsolvable
from calib_core.options import CalibrationOptions, CameraPositionPrior, MountingOptions, SolvingOptions
from calib_core.paper.other_methods import CheckerboardMatrix, calibrate_by_mounting, register_on_checkerboard, swapped
from calib_core.results import Calibration
from calib_core.results.metrics import aed, cdsd, distances
from calib_core.synthetic import SimulatedScans

MOST_GROSS = 4


@dataclass(frozen=True, slots=True)
class Figures:
    """One row for one seed.

    Attributes:
        aed_px: over all pairs.
        cdsd_px: likewise.
        outside: share of the clicked radar positions that the pose puts outside the picture.
    """

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


def calibrated(simulated: SimulatedScans, settings: Settings) -> Calibration | Unsolvable:
    """Calibrate a simulated data set by the paper's method."""
    return calibrate(simulated.clicks, simulated.scans, simulated.camera, ppm_options(settings))


def by_mounting(simulated: SimulatedScans, pairs: Sequence[Pair] = (), *, other_rig: bool = False) -> Calibration:
    """Return what tape measure and protractor say (PMM): nominal rotation and measured offset, judged on pairs."""
    rig, other = simulated.stage.options.rig, simulated.stage.options.other_camera
    offset_m, yaw_deg = (other.offset_m, other.yaw_deg) if other_rig else (rig.camera_offset_m, 0.0)
    options = CalibrationOptions(
        method="paper",
        mounting=MountingOptions(yaw_deg=yaw_deg),
        solving=SolvingOptions(camera_position=CameraPositionPrior(offset_m)),
    )
    return calibrate_by_mounting(pairs, simulated.camera, options)


def by_checkerboard(simulated: SimulatedScans, pairs: Sequence[Pair]) -> CheckerboardMatrix:
    """Return CCM's matrix from D2: of each pair, the corner nearest to the click, which the camera knows exactly."""
    board = simulated.stage.scene.board
    assert board is not None, "D2 has a checkerboard"
    corners_m = simulated.stage.rig.camera_from_world @ board.corners_m
    corners_px = simulated.camera.project(corners_m)
    _, pixels_px = points_and_pixels(pairs)
    nearest = np.linalg.norm(corners_px[None] - pixels_px[:, None], axis=2).argmin(axis=1)
    return register_on_checkerboard(points_and_pixels(pairs)[0], corners_m[nearest])


def measured_pairs(calibration: Calibration) -> list[Pair]:
    """Return the pairs that a calibration was made of."""
    return [one.measured for one in calibration.pairs if one.measured is not None]


def points_and_pixels(pairs: Sequence[Pair]) -> tuple[Points3, Points2]:
    """Return the most plausible radar position and the click of each pair."""
    points = np.array([pair.candidates[0].position_radar_m for pair in pairs])
    return points, np.array([pair.pixel_px for pair in pairs])


def measure(seed: int, settings: Settings, datasets: Sequence[Dataset] = ("d1", "d2", "d3")) -> Seed:
    """Simulate data sets, D1 among them, and compute the rows that they give."""
    found = {dataset: session(dataset, seed, settings) for dataset in datasets}
    solved = {dataset: calibrated(simulated, settings) for dataset, simulated in found.items()}
    rows = {
        f"PPM+{dataset.upper()}": figures_of(one) for dataset, one in solved.items() if isinstance(one, Calibration)
    }
    conditions, first, second = None, solved["d1"], solved.get("d2")
    if isinstance(first, Calibration):
        mounted = by_mounting(found["d1"], measured_pairs(first))
        rows["PMM+D1"] = figures_of(mounted)
        rows["PPM+D1+T_m"] = figures_of(swapped(first, mounted))
        rows["PMM+D1+T_c"] = figures_of(swapped(mounted, first))
        if isinstance(second, Calibration):
            matrix = by_checkerboard(found["d2"], measured_pairs(second))
            conditions = matrix.problem_condition, matrix.condition
            rows["CCM+D2"] = matrix_figures(matrix, second)
            rows["CCM+D1"] = matrix_figures(matrix, first)
    gross: tuple[Gross, ...] = ()
    if settings.gross_pairs and "d3" in found:
        gross = gross_errors(found["d3"], settings)
        for one in gross:
            if (one.count, one.method) == (settings.gross_pairs, "paper"):
                rows["PPM+DR+D3"] = one.figures
    return Seed(rows, conditions, gross)


def gross_errors(simulated: SimulatedScans, settings: Settings) -> tuple[Gross, ...]:
    """Solve DR+D3, the clicks in the second camera's pictures, with 0 to 4 grossly wrong radar positions, by both methods."""
    other = simulated.other_camera
    assert other is not None, "D3 has a second camera"
    found = []
    for options in (ppm_options(settings), CalibrationOptions()):
        for count in range(MOST_GROSS + 1):
            outcome = with_gross_errors(other, settings, count, options)
            if isinstance(outcome, Calibration):
                found.append(_gross(outcome, other, count))
    return tuple(found)


def with_gross_errors(
    other: SimulatedScans, settings: Settings, count: int, options: CalibrationOptions
) -> Calibration | Unsolvable:
    """Calibrate with some radar positions displaced by a fixed distance in random horizontal directions."""
    if options.method == "paper":
        pairs = measured_pairs(calibrate(other.clicks, other.scans, other.camera, options).unwrap())
    else:
        pairs = list(pair_clicks(other.clicks, other.scans, options).pairs)
    return calibrate_pairs(displaced(pairs, count, settings.gross_m, other.stage.options.seed), other.camera, options)


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


def _gross(outcome: Calibration, other: SimulatedScans, count: int) -> Gross:
    true = other.camera_from_radar
    off = outcome.camera_from_radar @ true.inverse()
    return Gross(
        count,
        outcome.options.method,
        figures_of(outcome),
        float(np.rad2deg(np.linalg.norm(rotation_log(off.rotation)))),
        float(np.linalg.norm(_centre(outcome.camera_from_radar) - _centre(true))),
        sum(pair.inlier for pair in outcome.pairs),
        len(outcome.pairs),
    )


def _centre(camera_from_radar: RigidTransform) -> np.ndarray:
    return camera_from_radar.inverse().translation_m


def figures_of(outcome: Calibration) -> Figures:
    """Return AED and CDSD over all pairs, and the share outside the picture."""
    projected = np.array([pair.projected_px for pair in outcome.pairs])
    return _figures(projected, np.array([pair.pixel_px for pair in outcome.pairs]), outcome)


def matrix_figures(matrix: CheckerboardMatrix, judged_on: Calibration) -> Figures:
    """Return the figures of CCM's matrix on the pairs of a calibration."""
    points, pixels = points_and_pixels(measured_pairs(judged_on))
    return _figures(matrix.project(points, judged_on.camera), pixels, judged_on)


def _figures(projected_px: Points2, pixels_px: Points2, of: Calibration) -> Figures:
    lengths = distances(projected_px, pixels_px)
    lengths = lengths[np.isfinite(lengths)]
    return Figures(aed(lengths), cdsd(lengths), 1.0 - float(of.camera.in_image(projected_px).mean()))
