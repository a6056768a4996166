"""A bare matrix is tested against data from outside the file: pairs, and the ground truth of a simulation."""

import json
from collections.abc import Callable

import numpy as np
import pytest

from calib_core.errors import InputError
from calib_core.interchange import (
    CalibrationFile,
    adopt,
    check,
    imported,
    read_any,
    read_check_pairs,
    read_check_pairs_file,
)


@pytest.fixture
def pairs(file: CalibrationFile) -> Callable[[int], str]:
    """Return a function that writes pairs-1 with a given number of exact pairs."""

    def written(count: int) -> str:
        rng = np.random.default_rng(8)
        points = np.column_stack([rng.uniform(4, 15, 40), rng.uniform(-0.3, 0.3, 40), rng.uniform(-0.2, 0.1, 40)])
        points[:, 1:] *= points[:, :1]
        camera = file.calibration.camera
        rows = [
            {"id": f"p{i}", "radar_m": point.tolist(), "pixel_px": pixel.tolist()}
            for i, (point, pixel) in enumerate(zip(points, file.calibration.reproject(points), strict=True))
        ]
        described = {
            "model": camera.model,
            "width_px": camera.width_px,
            "height_px": camera.height_px,
            "matrix_px": camera.matrix_px.tolist(),
            "distortion": camera.distortion.tolist(),
        }
        return json.dumps({"schema": "cocalib/pairs-1", "camera": described, "pairs": rows[:count]})

    return written


def matrix_text(matrix: np.ndarray) -> str:
    return "\n".join(" ".join(map(repr, row)) for row in matrix.tolist())


def test_pairs_confirm_a_bare_matrix_or_name_its_slip(file, pairs):
    right = file.calibration.camera_from_radar.as_matrix()
    millimetres = right.copy()
    millimetres[:3, 3] *= 1000
    transposed = right.copy()
    transposed[:3, :3] = right[:3, :3].T
    check_pairs = read_check_pairs(pairs(12))

    for matrix, codes, verdict in (
        (right, ["pairs-fit"], "right"),
        (np.linalg.inv(right), ["swapped-direction"], "wrong"),
        (millimetres, ["millimetres"], "wrong"),
        (transposed, ["transposed-rotation"], "wrong"),
    ):
        report = check(read_any(matrix_text(matrix)), pairs=check_pairs)
        assert [result.code for result in report.results] == codes
        assert report.verdict == verdict


def test_pairs_of_other_sensors_disagree_without_a_slip(file, pairs):
    moved = file.calibration.camera_from_radar.perturbed(np.array([0, 0, 0, 0.1, 0.4, 0])).as_matrix()

    report = check(read_any(matrix_text(moved)), pairs=read_check_pairs(pairs(12)))

    assert [result.code for result in report.results] == ["pairs-missed"]
    assert report.verdict == "wrong"


def test_the_pairs_of_a_calibration_serve_as_well(file, golden_text, tmp_path):
    document = json.loads(golden_text)
    document["pairs"] = document["pairs"] * 2
    for index, pair in enumerate(document["pairs"]):
        document["pairs"][index] = {**pair, "id": f"p{index}"}
    path = tmp_path / "calibration.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    matrix = np.linalg.inv(file.calibration.camera_from_radar.as_matrix())

    report = check(read_any(matrix_text(matrix)), pairs=read_check_pairs_file(path))

    assert [result.code for result in report.results] == ["swapped-direction"]


def test_too_few_pairs_and_files_of_something_else_are_refused(pairs, tmp_path):
    with pytest.raises(InputError, match="contains 3 pairs; a check needs at least 4"):
        read_check_pairs(pairs(3))
    with pytest.raises(InputError, match="schema"):
        read_check_pairs('{"schema": "cocalib/clicks-1", "clicks": []}')
    with pytest.raises(InputError, match="cannot be read"):
        read_check_pairs_file(tmp_path / "absent.json")
    (tmp_path / "binary.json").write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match="not a text file"):
        read_check_pairs_file(tmp_path / "binary.json")


def test_with_nothing_to_test_it_against_a_bare_matrix_is_unproven_and_a_sideways_one_doubtful(file):
    right = file.calibration.camera_from_radar.as_matrix()

    plausible, sideways = (check(read_any(matrix_text(matrix))) for matrix in (right, np.linalg.inv(right)))

    assert (plausible.verdict, sideways.verdict) == ("unproven", "doubtful")
    assert plausible.lines()[-1].startswith("not proven: ")
    assert sideways.lines()[-1].startswith("DOUBTFUL: ")
    assert all("--pairs FILE" in report.lines()[-1] for report in (plausible, sideways))


def test_a_calibration_is_compared_with_the_truth_of_a_simulation_which_is_not_imported(file):
    truth = json.dumps(
        {
            "schema": "cocalib/truth-1",
            "camera_from_radar": {
                "rotation": file.calibration.camera_from_radar.rotation.tolist(),
                "translation_m": file.calibration.camera_from_radar.translation_m.tolist(),
            },
            "camera": {
                "model": file.calibration.camera.model,
                "width_px": file.calibration.camera.width_px,
                "height_px": file.calibration.camera.height_px,
                "matrix_px": file.calibration.camera.matrix_px.tolist(),
                "distortion": file.calibration.camera.distortion.tolist(),
            },
        }
    )

    report = check(imported(file), against=read_any(truth))

    assert report.verdict == "right"
    assert report.comparison is not None
    assert report.comparison.rotation_deg == pytest.approx(0, abs=1e-9)
    with pytest.raises(InputError, match="is the ground truth of a simulation"):
        adopt(read_any(truth), "truth.json")
    with pytest.raises(InputError, match=r"camera_from_radar\.rotation: missing"):
        read_any('{"schema": "cocalib/truth-1"}')
