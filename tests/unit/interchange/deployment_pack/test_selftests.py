"""The self-tests of a pack pass where all is right, fail at every wrong number, and ask for pixels that OpenCV gives, too."""

import csv
import re
from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange import CalibrationFile, export
from calib_core.interchange.syntax.zip_archives import unpack
from calib_core.lens_models.registry import LENS_MODELS
from calib_core.radar import RadarErrors


def rows_of(file: CalibrationFile) -> np.ndarray:
    """Return x, y, z, the raw pixel and the corrected one of each of the ten points."""
    text = unpack(export(file, "pack").data, source="pack")["selftest.csv"].decode()
    return np.array([[float(value) for value in row.values()] for row in csv.DictReader(text.splitlines())])


def through_opencv(file: CalibrationFile, points_radar_m: np.ndarray) -> np.ndarray:
    camera, pose = file.calibration.camera, file.calibration.camera_from_radar
    rvec, tvec = cv2.Rodrigues(pose.rotation)[0], pose.translation_m.copy()
    points, k, d = np.ascontiguousarray(points_radar_m)[:, None], camera.matrix_px.copy(), camera.distortion.copy()
    if camera.lens.opencv == "fisheye.projectPoints":
        return cv2.fisheye.projectPoints(points, rvec, tvec, k, d)[0].reshape(-1, 2)
    return cv2.projectPoints(points, rvec, tvec, k, d)[0].reshape(-1, 2)


@pytest.mark.parametrize("lens", LENS_MODELS)
def test_they_pass_through_every_lens(lens, through_lens, unpacked, selftest):
    folder = unpacked(through_lens(lens))
    before = sorted(folder.rglob("*"))

    answer = selftest(folder)

    assert sorted(folder.rglob("*")) == before
    assert answer.code == 0, answer.out
    assert answer.out.splitlines()[-1].startswith("PASS")
    assert len(answer.out.splitlines()) == 11


@pytest.mark.parametrize("lens", LENS_MODELS)
def test_opencv_projects_the_ten_points_to_the_same_pixels(lens, through_lens):
    file = through_lens(lens)
    errors, grid = file.calibration.radar_errors, file.calibration.angle_map

    rows = rows_of(file)

    true_m = grid.corrected(errors.corrected(rows[:, :3]))
    assert rows.shape == (10, 7)
    np.testing.assert_allclose(rows[:, 3:5], through_opencv(file, rows[:, :3]), rtol=0, atol=1e-6)
    np.testing.assert_allclose(rows[:, 5:], through_opencv(file, true_m), rtol=0, atol=1e-6)
    assert np.linalg.norm(rows[:, 5:] - rows[:, 3:5], axis=1).min() > 1.0
    assert file.calibration.camera.in_image(rows[:, 3:5]).all()
    assert np.ptp(rows[:, 3:5], axis=0).min() > 0.8 * file.calibration.camera.height_px


def test_a_skewed_camera_passes(golden, unpacked, selftest):
    matrix = golden.calibration.camera.matrix_px.copy()
    matrix[0, 1] = 25.0
    camera = Camera("plumb_bob", 640, 480, matrix, golden.calibration.camera.distortion)
    file = replace(golden, calibration=replace(golden.calibration, camera=camera))

    assert selftest(unpacked(file)).code == 0


def changed(pattern: str, change: Callable[[str], str]) -> Callable[[str], str]:
    """Return a function that changes the first group of a pattern in a text."""

    def edit(text: str) -> str:
        match = re.search(pattern, text, re.DOTALL)
        return text[: match.start(1)] + change(match[1]) + text[match.end(1) :]

    return edit


def larger(number: str) -> str:
    return repr(float(number) * 1.01 + 1e-4)


NUMBER = r"(-?[\d.]+(?:e[-+]?\d+)?)"
PLANTED = {
    "pixel": ("selftest.csv", changed(rf"\n(?:[^,]*,){{3}}{NUMBER}", larger)),
    "corrected pixel": ("selftest.csv", changed(rf"\n(?:[^,]*,){{6}}{NUMBER}", larger)),
    "rotation": ("calibration.json", changed(rf'"rotation": [\[\s]+{NUMBER}', larger)),
    "translation": ("calibration.json", changed(rf'"translation_m": \[{NUMBER}', larger)),
    "focal length": ("camera_info.yaml", changed(rf"camera_matrix:.*?\[{NUMBER}", larger)),
    "row of the principal point": (
        "camera_info.yaml",
        changed(rf"camera_matrix:.*?\[(?:[^,]*,){{5}} {NUMBER}", larger),
    ),
    "last coefficient": ("camera_info.yaml", changed(rf"distortion_coefficients:.*?\[[^\]]*, {NUMBER}\]", larger)),
    "lens": ("camera_info.yaml", changed(r"distortion_model: (\w+)", lambda _: "equidistant")),
    "unknown lens": ("camera_info.yaml", changed(r"distortion_model: (\w+)", lambda _: "division")),
    "range bias": ("radar_correction.csv", changed(rf"range_bias_m,{NUMBER}", larger)),
    "azimuth scale": ("radar_correction.csv", changed(rf"azimuth_scale,{NUMBER}", larger)),
    "elevation scale": ("radar_correction.csv", changed(rf"elevation_scale,{NUMBER}", larger)),
    "height": ("radar_correction.csv", changed(rf"squared_height_m2,{NUMBER}", lambda _: "1.6")),
    "no angle map": ("radar_correction.csv", changed(r"angle_map,(\S+)", lambda _: "none")),
    "missing error": ("radar_correction.csv", changed(r"(range_bias_m,\S+\n)", lambda _: "")),
    "no points": ("selftest.csv", changed(r"\n(.*)", lambda _: "")),
    "word for a number": ("selftest.csv", changed(rf"\n{NUMBER}", lambda _: "near")),
    "nan for a pixel": ("selftest.csv", changed(rf"\n(?:[^,]*,){{3}}{NUMBER}", lambda _: "nan")),
    "map without a line": ("radar_angle_map.csv", changed(r"\n([^\n]+\n)$", lambda _: "")),
    "empty file": ("radar_angle_map.csv", lambda _: ""),
}


@pytest.mark.parametrize("slip", PLANTED)
def test_they_fail_at_a_wrong_number(slip, through_lens, unpacked, selftest):
    folder = unpacked(through_lens("rational_polynomial"))
    name, edit = PLANTED[slip]
    text = (folder / name).read_text()
    (folder / name).write_text(edit(text))
    assert (folder / name).read_text() != text

    answer = selftest(folder)

    assert answer.code == 1, answer.out
    assert answer.out.splitlines()[-1].startswith("FAIL: ")


def test_they_fail_where_a_table_of_the_angle_map_is_wrong(through_lens, unpacked, selftest):
    folder = unpacked(through_lens("plumb_bob"))
    path = folder / "radar_angle_map.csv"
    head, *lines = path.read_text().splitlines()
    cells = [line.split(",") for line in lines]
    path.write_text("\n".join([head, *(",".join([*row[:2], larger(row[2]), *row[3:]]) for row in cells)]) + "\n")

    assert selftest(folder).code == 1


@pytest.mark.parametrize("name", ["calibration.json", "camera_info.yaml", "radar_angle_map.csv", "selftest.csv"])
def test_they_fail_without_a_file(name, corrected, unpacked, selftest):
    folder = unpacked(corrected)
    (folder / name).unlink()

    answer = selftest(folder)

    assert answer.code == 1
    assert name in answer.out.splitlines()[-1]


def test_inliers_come_first_and_excluded_pairs_are_no_points(golden):
    pairs = golden.calibration.pairs
    inliers = {tuple(np.round(pair.point_radar_m, 3)) for pair in pairs if pair.inlier}
    others = {tuple(np.round(pair.point_radar_m, 3)) for pair in pairs if not pair.inlier}
    assert others

    points = [tuple(row[:3]) for row in rows_of(golden)]

    assert set(points[: len(inliers)]) == inliers
    assert not others & set(points)
    assert len(set(points)) == 10


def test_of_many_pairs_ten_are_spread_over_directions_and_ranges(golden):
    rng, (pair, *_) = np.random.default_rng(4), golden.calibration.pairs
    points_m = rng.uniform(3.0, 30.0, (60, 1)) * np.column_stack([np.ones(60), rng.uniform(-0.35, 0.35, (60, 2))])
    pairs = tuple(replace(pair, id=f"p{i}", point_radar_m=point, inlier=True) for i, point in enumerate(points_m))
    file = replace(golden, calibration=replace(golden.calibration, pairs=pairs))

    chosen_m = rows_of(file)[:, :3]

    for ratio in (chosen_m[:, 1] / chosen_m[:, 0], chosen_m[:, 2] / chosen_m[:, 0]):
        assert np.ptp(ratio) > 0.4
    assert chosen_m[:, 0].max() / chosen_m[:, 0].min() > 4.0
    assert {tuple(row) for row in chosen_m} <= {tuple(row) for row in np.round(points_m, 3)}


def test_a_lens_that_the_programs_do_not_know_is_refused(golden, monkeypatch):
    monkeypatch.setitem(LENS_MODELS, "division", replace(LENS_MODELS["plumb_bob"], name="division"))
    camera = replace(golden.calibration.camera, model="division")
    file = replace(golden, calibration=replace(golden.calibration, camera=camera))

    with pytest.raises(InputError, match="cannot project through the lens model division"):
        export(file, "pack")


def test_errors_that_leave_no_point_are_refused_in_words(golden):
    errors = RadarErrors(range_bias_m=float("nan"))
    file = replace(golden, calibration=replace(golden.calibration, radar_errors=errors))

    with pytest.raises(InputError, match="nothing to project"):
        export(file, "pack")


def test_the_programs_name_no_path_of_this_machine(golden, project_root):
    members = unpack(export(golden, "pack").data, source="pack")

    assert not any(str(project_root).encode() in data for data in members.values())
