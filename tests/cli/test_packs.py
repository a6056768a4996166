"""The deployment pack on the command line, and what exports without the angle map say."""

import json
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from calib_core.interchange import export_all, read_calibration, written_formats
from calib_core.interchange.formats.statement import POSE_ONLY


@pytest.fixture
def calibration(project_root: Path) -> Path:
    return project_root / "tests/golden/calibration-1.json"


def test_a_pack_is_a_zip_or_the_files_in_a_folder(cocalib, calibration, tmp_path):
    archive, folder, there = tmp_path / "pack.zip", tmp_path / "robot" / "pack", tmp_path / "there"
    there.mkdir()
    for out in (archive, folder, there):
        assert cocalib("export", calibration, "--to", "pack", "--out", out).code == 0

    with zipfile.ZipFile(archive) as packed:
        members = {name: packed.read(name) for name in packed.namelist()}
    for unpacked in (folder, there):
        files = [path for path in unpacked.rglob("*") if path.is_file()]
        assert {path.relative_to(unpacked).as_posix(): path.read_bytes() for path in files} == members
    tested = subprocess.run([sys.executable, "-I", "-S", folder / "selftest.py"], capture_output=True, text=True)
    assert (tested.returncode, tested.stdout.splitlines()[-1][:4]) == (0, "PASS")


def test_a_pack_replaces_no_file_that_is_not_its_own(cocalib, calibration, tmp_path):
    folder = tmp_path / "project"
    folder.mkdir()
    (folder / "README.txt").write_text("mine")
    refused = cocalib("export", calibration, "--to", "pack", "--out", folder)
    assert refused.code == 2
    assert "already contains another README.txt" in refused.err
    assert [path.name for path in folder.iterdir()] == ["README.txt"]
    (folder / "README.txt").unlink()
    for _ in range(2):  # the same files again are no other files
        assert cocalib("export", calibration, "--to", "pack", "--out", folder).code == 0


def test_a_pack_is_imported_checked_and_exported_like_its_calibration(cocalib, calibration, tmp_path):
    archive, back = tmp_path / "pack.zip", tmp_path / "back.json"
    assert cocalib("export", calibration, "--to", "pack", "--out", archive).code == 0
    assert cocalib("check", archive).code == 0
    assert cocalib("import", archive, "--out", back).code == 0
    assert back.read_bytes() == calibration.read_bytes()
    from_pack, from_json = (cocalib("export", source, "--to", "urdf") for source in (archive, calibration))
    assert (from_pack.code, from_pack.out) == (0, from_json.out)


def test_an_export_without_the_angle_map_says_so_on_stderr(cocalib, calibration, tmp_path):
    document = json.loads(calibration.read_text())
    table = [[0.001, 0.002], [0.0, -0.001]]
    document["radar_angle_map"] = {
        **{"azimuth_rad": [-0.5, 0.5], "elevation_rad": [-0.1, 0.1], "aed_px": 22.9, "corrected_aed_px": 2.0},
        **dict.fromkeys(("add_azimuth_rad", "add_elevation_rad", "sigma_azimuth_rad", "sigma_elevation_rad"), table),
    }
    mapped = tmp_path / "mapped.json"
    mapped.write_text(json.dumps(document))
    for name in ("tf2", "kitti"):
        answer = cocalib("export", mapped, "--to", name, "--out", tmp_path / name, *["--rectified"][: name == "kitti"])
        assert answer.code == 0
        first = next(line for line in answer.err.splitlines() if line.startswith("note: "))
        assert first.startswith("note: NOT IN THIS FILE: the radar's angle map")
        assert "22.9 px off, with it 2 px" in first
    for name in ("json", "pack"):
        assert "NOT IN THIS FILE" not in cocalib("export", mapped, "--to", name, "--out", tmp_path / f"{name}.zip").err


def test_all_formats_are_written_and_those_that_cannot_hold_the_calibration_say_why(cocalib, calibration, tmp_path):
    folder = tmp_path / "exports"
    answer = cocalib("export", calibration, "--to", "all", "--out", folder)
    assert answer.code == 0
    lines = dict(line.split(": ", 1) for line in answer.out.splitlines())
    assert set(lines) == {known.name for known in written_formats()}
    written, refused = export_all(read_calibration(calibration.read_bytes()))
    for name, made in written.items():
        assert lines[name] == f"written to {folder / made.file_name}"
        assert (folder / made.file_name).read_bytes() == made.data
    for one in refused:
        assert lines[one.name] == f"not written: {one.reason}"
    beside = {extra.file_name for made in written.values() for extra in made.extra_files}
    assert beside == {"rectification.npz"}
    assert {path.name for path in folder.iterdir()} == {made.file_name for made in written.values()} | beside
    (note,) = (line for line in answer.err.splitlines() if line.endswith(POSE_ONLY))
    assert note.startswith("note: tf2, tf2-launch-py, ")
    assert "warning of the calibration: the pairs span 5 m to 15 m" in answer.err


def test_all_formats_take_the_parent_and_the_rectified_pictures_where_they_apply(cocalib, calibration, tmp_path):
    parent = ["--parent-from-radar", "1.5", "0", "0.25", "0", "0", "0", "1"]
    answer = cocalib("export", calibration, "--to", "all", "--out", tmp_path / "a", "--rectified", *parent)
    assert answer.code == 0
    assert "kitti: written to" in answer.out
    assert "x: 1.5" in (tmp_path / "a" / "sensor_kit_calibration.yaml").read_text()
