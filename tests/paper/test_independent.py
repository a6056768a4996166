"""AED, CDSD, PMM, CCM and the swaps computed once more from the paper's formulas alone, in plain Python, without our code."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

from benchmarks.paper.rows import Figures, by_checkerboard, calibrated, figures_of, measure, points_and_pixels
from benchmarks.paper.settings import FITTED, SEED_SETS, Dataset, session
from calib_core.results import Calibration
from calib_core.synthetic.recording import SimulatedRecording

Point = Sequence[float]


def pixel_of(matrix: Sequence[Point], point: Point, lens: Sequence[float], distortion: Sequence[float]) -> Point:
    """Equation 2, s p = K [R | t] P, with the lens distortion by k1, k2, p1, p2 (and k3)."""
    fx, fy, cx, cy = lens
    x, y, z = (sum(row[k] * value for k, value in enumerate((*point, 1.0))) for row in matrix)
    x, y = x / z, y / z
    k1, k2, p1, p2, k3 = (*distortion, 0.0)[:5]
    r2 = x * x + y * y
    radial = 1.0 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    u = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
    v = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
    return fx * u + cx, fy * v + cy


def aed_and_cdsd(projected: Sequence[Point], clicked: Sequence[Point]) -> tuple[float, float]:
    """Equations 4 and 5."""
    lengths = [math.hypot(a - c, b - d) for (a, b), (c, d) in zip(projected, clicked, strict=True)]
    mean = sum(lengths) / len(lengths)
    return mean, math.sqrt(sum((one - mean) ** 2 for one in lengths) / (len(lengths) - 1))


def twelve_numbers(points: Sequence[Point], corners: Sequence[Point]) -> list[list[float]]:
    """Equation 1, P_c = [R | t] P_r, by least squares: for each row the normal equations by Gauss' elimination, centred."""
    count = len(points)
    means = [sum(point[k] for point in points) / count for k in range(3)]
    moved = [[point[k] - means[k] for k in range(3)] for point in points]
    matrix = []
    for axis in range(3):
        target_mean = sum(corner[axis] for corner in corners) / count
        system = [
            [sum(p[i] * p[j] for p in moved) for j in range(3)]
            + [sum(p[i] * (c[axis] - target_mean) for p, c in zip(moved, corners, strict=True))]
            for i in range(3)
        ]
        row = solved(system)
        matrix.append([*row, target_mean - sum(a * b for a, b in zip(row, means, strict=True))])
    return matrix


def solved(system: list[list[float]]) -> list[float]:
    n = len(system)
    for i in range(n):
        pivot = max(range(i, n), key=lambda k: abs(system[k][i]))
        system[i], system[pivot] = system[pivot], system[i]
        for k in range(i + 1, n):
            factor = system[k][i] / system[i][i]
            system[k] = [a - factor * b for a, b in zip(system[k], system[i], strict=True)]
    found = [0.0] * n
    for i in reversed(range(n)):
        found[i] = (system[i][n] - sum(system[i][k] * found[k] for k in range(i + 1, n))) / system[i][i]
    return found


def solved_set(dataset: Dataset) -> tuple[SimulatedRecording, Calibration]:
    simulated = session(dataset, SEED_SETS[0][0], FITTED)
    return simulated, calibrated(simulated).unwrap()


@pytest.fixture(scope="module")
def d1() -> Calibration:
    return solved_set("d1")[1]


@pytest.fixture(scope="module")
def d2() -> tuple[SimulatedRecording, Calibration]:
    return solved_set("d2")


def lens_of(calibration: Calibration) -> tuple[list[float], list[float]]:
    matrix = calibration.camera.matrix_px
    return [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]], calibration.camera.distortion.tolist()


def again(matrix: Sequence[Point], calibration: Calibration) -> tuple[float, float]:
    points, clicked = points_and_pixels(calibration)
    lens, distortion = lens_of(calibration)
    projected = [pixel_of(matrix, point, lens, distortion) for point in points.tolist()]
    return aed_and_cdsd(projected, clicked.tolist())


def both(figures: Figures) -> tuple[float, float]:
    return figures.aed_px, figures.cdsd_px


@pytest.mark.slow
def test_aed_and_cdsd_of_ppm_are_those_of_the_formulas(d1, d2):
    for calibration in (d1, d2[1]):
        pose = calibration.camera_from_radar
        matrix = np.column_stack([pose.rotation, pose.translation_m]).tolist()
        assert both(figures_of(calibration)) == pytest.approx(again(matrix, calibration), rel=1e-6)


@pytest.mark.slow
def test_ccm_is_least_squares_for_twelve_numbers_on_its_own_board_and_on_d1(d1, d2):
    simulated, on_board = d2
    points, clicked = points_and_pixels(on_board)
    board = simulated.stage.scene.board
    corners = (simulated.stage.rig.camera_from_world @ board.corners_m).tolist()
    lens, distortion = lens_of(on_board)
    identity = np.eye(3, 4).tolist()
    seen = [pixel_of(identity, corner, lens, distortion) for corner in corners]
    nearest = [min(range(len(seen)), key=lambda k: math.dist(seen[k], click)) for click in clicked.tolist()]
    matrix = twelve_numbers(points.tolist(), [corners[k] for k in nearest])
    ours, (_, condition) = by_checkerboard(simulated, on_board)
    assert both(figures_of(on_board, ours)) == pytest.approx(again(matrix, on_board), rel=1e-6)
    assert both(figures_of(d1, ours)) == pytest.approx(again(matrix, d1), rel=1e-3)
    assert condition > 1e9


@pytest.mark.slow
def test_pmm_looks_along_the_radar_and_the_swaps_take_its_parts(d1):
    """The camera is 4.5 cm above the radar and looks where it looks: x right, y down, z forward of x forward, y left, z up."""
    axes, offset = [(0.0, -1.0, 0.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)], (0.0, 0.045, 0.0)
    pose, rows = d1.camera_from_radar, measure(SEED_SETS[0][0], FITTED, ["d1"]).rows
    for name, rotation, translation in (
        ("PMM+D1", axes, offset),
        ("PPM+D1+T_m", pose.rotation.tolist(), offset),
        ("PMM+D1+T_c", axes, pose.translation_m.tolist()),
    ):
        matrix = [(*row, shift) for row, shift in zip(rotation, translation, strict=True)]
        assert both(rows[name]) == pytest.approx(again(matrix, d1), rel=1e-6)
