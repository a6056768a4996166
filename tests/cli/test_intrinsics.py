"""`cocalib intrinsics` on real images of a board, and on input that cannot give a calibration."""

import json
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import cv2
import jsonschema
import numpy as np
import pytest

from calib_core.interchange.cameras.files import read_camera_file

_BOARD = ("--board", "9x6", "--square-mm", "25")


@pytest.fixture
def left(shared_data: Path) -> list[Path]:
    return sorted((shared_data / "real_checkerboards").glob("left[01]*.jpg"))


@pytest.fixture
def right(shared_data: Path) -> list[Path]:
    return sorted((shared_data / "real_checkerboards").glob("right[01]*.jpg"))


def flat_board(columns: int, rows: int, square_px: int) -> np.ndarray:
    """Draw a checkerboard with so many inner corners, square on, on white."""
    squares = np.indices((rows + 1, columns + 1)).sum(axis=0) % 2
    return cv2.copyMakeBorder(
        np.kron(255 * squares, np.ones((square_px, square_px))).astype(np.uint8),
        *[square_px] * 4,
        cv2.BORDER_CONSTANT,
        value=255,
    )


def write_shifted(folder: Path, board: np.ndarray, count: int) -> None:
    """Write images of a board that is moved sideways only, with a little blur and noise."""
    rng = np.random.default_rng(3)
    for index in range(count):
        canvas = np.full((480, 640), 200, dtype=np.uint8)
        top, across = 20 + 20 * (index % 3), 10 + 30 * index
        canvas[top : top + board.shape[0], across : across + board.shape[1]] = board
        noisy = cv2.GaussianBlur(canvas, (0, 0), 0.7) + rng.normal(0.0, 1.0, canvas.shape)
        cv2.imwrite(str(folder / f"flat{index:02d}.png"), np.clip(noisy, 0, 255).astype(np.uint8))


@pytest.mark.slow
def test_real_images_give_a_lens_as_good_as_opencv_s_with_everything_written(cocalib, left, tmp_path, project_root):
    out, report = tmp_path / "camera.yaml", tmp_path / "lens.html"
    answer = cocalib("intrinsics", *left, *_BOARD, "--json", "--out", out, "--report", report)

    assert answer.code == 3, answer.err  # these views cover less than half of the image, and a warning says so
    said = json.loads(answer.out)
    schema = json.loads((project_root / "docs/schemas/intrinsics-1.schema.json").read_text())
    jsonschema.validate(said, schema)
    assert "little-covered" in [warning["code"] for warning in said["warnings"]]
    assert said["rms_px"] <= 0.195
    assert said["rms_px"] < said["held_out_rms_px"] < 0.25
    assert [view["name"] for view in said["views"]] == [path.name for path in left]
    assert all(one["sigma"] > 0 for one in said["parameters"])
    assert said["camera"]["model"] == "plumb_bob"
    assert said["choice"].startswith("plumb_bob")
    assert np.allclose(read_camera_file(out).matrix_px, said["camera"]["matrix_px"])
    assert {child.tag.split("}")[1] for child in ElementTree.fromstring(report.read_text().split("\n", 1)[1])} == {
        "head",
        "body",
    }
    assert all(name in report.read_text() for name in ("left01.jpg", "0.0", "cannot see"))


@pytest.mark.slow
def test_planted_images_are_named_and_no_good_one_is_dropped(cocalib, right, tmp_path):
    planted = {f"blurred-{path.name}": cv2.GaussianBlur(cv2.imread(str(path)), (0, 0), 2.5) for path in right[:3]}
    planted["mirrored.png"] = cv2.imread(str(right[4]))[:, ::-1]
    canvas, board = np.full((480, 640), 200, dtype=np.uint8), flat_board(7, 5, 40)
    canvas[40 : 40 + board.shape[0], 60 : 60 + board.shape[1]] = board
    planted["another_board.png"] = cv2.GaussianBlur(canvas, (0, 0), 0.8)
    for name, image in planted.items():
        cv2.imwrite(str(tmp_path / name), image)
    answer = cocalib("intrinsics", *right, *(tmp_path / name for name in planted), *_BOARD, "--verbose")

    assert re.search(r"13 used, 5 left", answer.out)
    said = [line.removeprefix("left out: ") for line in answer.out.splitlines() if line.startswith("left out: ")]
    left_out = dict(line.split(": ", 1) for line in said)
    reasons = {name: "blurred" if "blurred" in name else "mirror" for name in planted} | {"another_board.png": "7 x 5"}
    assert set(left_out) == set(planted)
    assert [name for name, reason in reasons.items() if reason not in left_out[name]] == []


def test_images_without_a_board_say_so(cocalib, tmp_path):
    rng = np.random.default_rng(1)
    for index in range(3):
        cv2.imwrite(str(tmp_path / f"{index}.png"), rng.integers(0, 255, (240, 320), dtype=np.uint8))
    answer = cocalib("intrinsics", tmp_path, *_BOARD)
    assert answer.code == 1
    assert "None of 3 images" in answer.err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("count", "size", "words"),
    [
        (2, "8x7", ("show 9 x 6 inner corners", "State 9x6")),
        (2, "8x6", ("9 x 6 inner corners",)),  # which may be seen as a part of it
        (1, "9x6", ("1 usable views of the board, at least 3 are needed", "ilm the board from at least 10 directions")),
    ],
)
def test_a_wrong_size_of_the_board_names_the_right_one_and_one_view_is_too_few(cocalib, left, count, size, words):
    answer = cocalib("intrinsics", *left[:count], "--board", size, "--square-mm", "25")
    assert answer.code == 1
    assert [word for word in words if word not in answer.err] == []


def test_a_board_that_is_only_shifted_gives_no_focal_length(cocalib, tmp_path):
    write_shifted(tmp_path, flat_board(9, 6, 28), 7)
    answer = cocalib("intrinsics", tmp_path, *_BOARD, "--model", "pinhole")
    assert answer.code == 1, answer.out
    assert "focal length" in answer.err
    assert "30 to 45°" in answer.err


def test_images_of_different_sizes_are_not_mixed(cocalib, left, tmp_path):
    for path in left[:2]:
        cv2.imwrite(str(tmp_path / path.name), cv2.resize(cv2.imread(str(path)), (800, 600)))
    answer = cocalib("intrinsics", *left[2:5], *(tmp_path / path.name for path in left[:2]), *_BOARD)
    assert answer.code == 1
    assert "of 800 x 600" in answer.err


def test_two_series_of_images_in_a_folder_are_told_apart(cocalib, left):
    answer = cocalib("intrinsics", left[0].parent, *_BOARD)
    assert answer.code == 2
    assert [word for word in ("2 series", "left*.jpg (13)", "right*.jpg (13)") if word not in answer.err] == []


def test_a_file_with_intrinsics_is_printed_and_converted(cocalib, shared_data, tmp_path):
    source = shared_data / "real_checkerboards" / "left_intrinsics.yml"
    shown = cocalib("intrinsics", source)
    assert shown.code == 0
    assert "plumb_bob, images of 640" in shown.out
    assert "field of view" in shown.out
    for flags in (("--out", tmp_path / "one.json"), ("--rescale", "1280x960", "--out", tmp_path / "twice.json")):
        assert cocalib("intrinsics", source, *flags).code == 0
    once, one, twice = (read_camera_file(path) for path in (source, tmp_path / "one.json", tmp_path / "twice.json"))
    assert np.array_equal(one.matrix_px, once.matrix_px)
    assert (twice.width_px, twice.height_px) == (1280, 960)
    assert np.isclose(twice.matrix_px[0, 0], 2.0 * once.matrix_px[0, 0])
