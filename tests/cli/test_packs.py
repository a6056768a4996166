"""The deployment pack on the command line, and what exports without the angle map say."""

import subprocess
import sys
import zipfile

from calib_core.interchange import export_all, read_calibration, written_formats
from calib_core.interchange.formats.statement import POSE_ONLY


def test_a_pack_is_a_zip_or_the_files_in_a_folder(cocalib, golden, tmp_path):
    archive, folder, there = tmp_path / "pack.zip", tmp_path / "robot" / "pack", tmp_path / "there"
    there.mkdir()
    for out in (archive, folder, there):
        assert cocalib("export", golden, "--to", "pack", "--out", out).code == 0

    with zipfile.ZipFile(archive) as packed:
        members = {name: packed.read(name) for name in packed.namelist()}
    for unpacked in (folder, there):
        files = [path for path in unpacked.rglob("*") if path.is_file()]
        assert {path.relative_to(unpacked).as_posix(): path.read_bytes() for path in files} == members
    tested = subprocess.run([sys.executable, "-I", "-S", folder / "selftest.py"], capture_output=True, text=True)
    assert (tested.returncode, tested.stdout.splitlines()[-1][:4]) == (0, "PASS")


def test_a_pack_replaces_no_file_that_is_not_its_own(cocalib, golden, tmp_path):
    folder = tmp_path / "project"
    folder.mkdir()
    (folder / "README.txt").write_text("mine")
    refused = cocalib("export", golden, "--to", "pack", "--out", folder)
    assert refused.code == 2
    assert "already contains another README.txt" in refused.err
    assert [path.name for path in folder.iterdir()] == ["README.txt"]
    (folder / "README.txt").unlink()
    for _ in range(2):  # the same files again are no other files
        assert cocalib("export", golden, "--to", "pack", "--out", folder).code == 0


def test_a_pack_is_imported_checked_and_exported_like_its_calibration(cocalib, golden, tmp_path):
    archive, back = tmp_path / "pack.zip", tmp_path / "back.json"
    assert cocalib("export", golden, "--to", "pack", "--out", archive).code == 0
    assert cocalib("check", archive).code == 0
    assert cocalib("import", archive, "--out", back).code == 0
    assert back.read_bytes() == golden.read_bytes()
    from_pack, from_json = (cocalib("export", source, "--to", "urdf") for source in (archive, golden))
    assert (from_pack.code, from_pack.out) == (0, from_json.out)


def test_all_formats_are_written_and_those_that_cannot_hold_the_calibration_say_why(cocalib, golden, tmp_path):
    folder = tmp_path / "exports"
    answer = cocalib("export", golden, "--to", "all", "--out", folder)
    assert answer.code == 0
    lines = dict(line.split(": ", 1) for line in answer.out.splitlines())
    assert set(lines) == {known.name for known in written_formats()}
    written, refused = export_all(read_calibration(golden.read_bytes()))
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


def test_all_formats_take_the_parent_and_the_rectified_pictures_where_they_apply(cocalib, golden, tmp_path):
    parent = ["--parent-from-radar", "1.5", "0", "0.25", "0", "0", "0", "1"]
    answer = cocalib("export", golden, "--to", "all", "--out", tmp_path / "a", "--rectified", *parent)
    assert answer.code == 0
    assert "kitti: written to" in answer.out
    assert "x: 1.5" in (tmp_path / "a" / "sensor_kit_calibration.yaml").read_text()
