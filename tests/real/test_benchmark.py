"""The benchmark on public sets: what it says without data, what it refuses, and one set whose pairs lie here."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.real.__main__ import main, outcome_of
from benchmarks.real.judging import Judged
from benchmarks.real.sets import SETS

CLICKS = SETS["clicks-16"]


def test_the_list_needs_no_data(capsys):
    assert main(["--list"]) == 0
    out = capsys.readouterr().out
    assert all(f"| {row.name} |" in out and row.clone in out for row in SETS.values())


def test_a_set_that_is_not_there_is_said_in_its_row(tmp_path, capsys):
    outcome = outcome_of(CLICKS, tmp_path)

    assert isinstance(outcome, str)
    assert CLICKS.clone in outcome
    assert main(["--data", str(tmp_path), "--only", CLICKS.name]) == 0
    assert CLICKS.clone in capsys.readouterr().out


def test_other_files_than_the_checksum_is_of_are_refused(tmp_path):
    file = tmp_path / "lidar_camera_calibration" / "calibration_data" / "camera_calibration" / "ost.yaml"
    file.parent.mkdir(parents=True)
    file.write_text("image_width: 1\n")

    outcome = outcome_of(CLICKS, tmp_path)

    assert isinstance(outcome, str)
    assert CLICKS.digest(tmp_path / "lidar_camera_calibration") in outcome


@pytest.mark.real
@pytest.mark.slow
def test_sixteen_clicks_are_judged_like_the_pairs_that_were_taken_from_them(shared_data: Path, tmp_path: Path):
    document = json.loads((shared_data / "real_pairs" / "heethesh_lidar_clicks_16.json").read_text(encoding="utf-8"))
    data = tmp_path / "lidar_camera_calibration" / "calibration_data"
    folder, lens = data / "lidar_camera_calibration", data / "camera_calibration"
    folder.mkdir(parents=True)
    lens.mkdir()
    np.save(folder / "img_corners.npy", [row["uv"] for row in document["pairs"]])
    np.save(folder / "pcl_corners.npy", [row["xyz"] for row in document["pairs"]])
    published = document["published_T_camera_from_sensor"]
    np.savez(folder / "extrinsics.npz", R=published["R"], T=[published["t"]])
    matrix, distortion = np.ravel(document["camera"]["K"]).tolist(), document["camera"]["D"]
    (lens / "ost.yaml").write_text(
        f"image_width: 964\nimage_height: 724\ncamera_matrix: {{rows: 3, cols: 3, data: {matrix}}}\n"
        f"distortion_model: plumb_bob\ndistortion_coefficients: {{rows: 1, cols: 5, data: {distortion}}}\n"
    )
    row = replace(CLICKS, sha256=CLICKS.digest(tmp_path / "lidar_camera_calibration"))

    outcome = outcome_of(row, tmp_path)

    assert isinstance(outcome, Judged)
    assert (outcome.pairs, outcome.verdict) == (16, "coarse")
    assert outcome.poses["ours"].rotation_deg == pytest.approx(5.7, abs=0.5)
    assert outcome.poses["OpenCV"].rotation_deg < 0.01  # which is how the published pose was made
    assert outcome.published_px == pytest.approx(10.43, abs=0.05)
    assert outcome.reach == pytest.approx(1.14, abs=0.1)
