"""The digest of a job: everything that the result depends on, and nothing else."""

import dataclasses
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from calib_core.options import CalibrationOptions, CameraPositionPrior, SolvingOptions
from calib_core.recordings import RecordingOptions
from cocalib.batch import inputs
from cocalib.batch.job import job_of
from cocalib.batch.manifest import ManifestRow


def put(path: Path, content: str = "content", age_s: float = 60.0) -> Path:
    """Write a file that was changed a while ago."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content)
    then_s = path.stat().st_mtime - age_s
    os.utime(path, (then_s, then_s))
    return path


@pytest.fixture
def row(tmp_path: Path) -> ManifestRow:
    recording = put(tmp_path / "in" / "drive.bag"), put(tmp_path / "in" / "images" / "1.jpg").parent
    return ManifestRow("van", "1", recording, place="line 3")


CHANGES: dict[str, Callable[[Path], object]] = {
    "vehicle": lambda _: "bus",
    "session": lambda _: "2",
    "recording": lambda folder: (put(folder / "in" / "drive.bag"),),
    "vehicle_type": lambda _: "long van",
    "radar_serial": lambda _: "R1",
    "camera_serial": lambda _: "C1",
    "clicks": lambda folder: put(folder / "clicks.json"),
    "auto": lambda _: True,
    "camera": lambda folder: put(folder / "camera.yaml"),
    "boxes": lambda folder: put(folder / "boxes.json"),
    "topics": lambda _: RecordingOptions(confirm_assumptions=True),
    "options": lambda _: CalibrationOptions(
        solving=SolvingOptions(camera_position=CameraPositionPrior((0.0, 0.0, 0.1), 0.01))
    ),
    "exports": lambda _: ("tf2",),
    "rescale_camera": lambda _: True,
    "reflector_m": lambda _: 0.3,
}


@pytest.mark.parametrize("name", [one.name for one in dataclasses.fields(ManifestRow) if one.name != "place"])
def test_each_field_of_a_row_changes_the_digest(name, row, tmp_path):
    changed = dataclasses.replace(row, **{name: CHANGES[name](tmp_path)})
    assert job_of(changed).digest != job_of(row).digest


def test_where_a_row_stands_and_where_its_files_lie_does_not_matter(row, tmp_path):
    shutil.copytree(tmp_path / "in", tmp_path / "copy")
    copied = tuple(tmp_path / "copy" / path.name for path in row.recording)
    moved = dataclasses.replace(row, recording=copied, place="line 9")
    assert job_of(moved).digest == job_of(row).digest
    assert job_of(moved).state == job_of(row).state


def test_another_version_of_the_program_makes_another_digest(row, tmp_path, monkeypatch):
    before = job_of(row).digest
    monkeypatch.setattr("cocalib.batch.job.version", lambda: "9.9.9")
    assert job_of(row).digest != before


READ = (
    *("drive.bag", "images/1.jpg", "images/2.jpg", "images/below/3.jpg", "metadata.yaml", "drive.csv"),
    *("images.csv", "images.txt", "timestamps.txt", "calib.txt", "calib/000001.txt", "calib_cam_to_cam.txt"),
    "v1.0-mini/calibrated_sensor.json",
)
NOT_READ = ("clicks.json", "other.bag", "images/.hidden", "drive.bag.cocalib-session/journal")


@pytest.mark.parametrize("name", [*READ, *NOT_READ])
def test_a_file_changes_the_digest_if_it_is_read_with_the_recording(name, row, tmp_path):
    before = job_of(row)
    put(tmp_path / "in" / name, "another content")
    after = job_of(row)
    assert (after.digest != before.digest) == (after.state != before.state) == (name in READ)


def test_names_and_contents_are_not_mixed_up(tmp_path):
    one, other = tmp_path / "one" / "in", tmp_path / "other" / "in"
    put(one / "a", "b"), put(one / "c", "d")
    put(other / "a", "d"), put(other / "c", "b")
    assert job_of(ManifestRow("van", "1", (one,))).digest != job_of(ManifestRow("van", "1", (other,))).digest


def test_a_missing_input_makes_a_job_too(row, tmp_path):
    missing = dataclasses.replace(row, clicks=tmp_path / "clicks.json")
    before = job_of(missing)
    put(tmp_path / "clicks.json")
    assert job_of(missing).digest != before.digest != job_of(row).digest


def test_a_camera_of_several_in_a_file_is_told_apart(row, tmp_path):
    put(tmp_path / "cameras.yaml")
    digests = {job_of(dataclasses.replace(row, camera=tmp_path / f"cameras.yaml#{name}")).digest for name in "ab"}
    assert len(digests) == 2
    changed = put(tmp_path / "cameras.yaml", "other")
    assert job_of(dataclasses.replace(row, camera=Path(f"{changed}#a"))).digest not in digests


def test_small_files_count_by_their_content_and_large_ones_by_size_and_time(row, monkeypatch):
    before = job_of(row)
    put(row.recording[0], age_s=59.0)
    assert job_of(row) == before
    changed = job_of(dataclasses.replace(row, recording=(put(row.recording[0], "CONTENT"), *row.recording[1:])))
    assert (changed.digest != before.digest, changed.state != before.state) == (True, True)
    monkeypatch.setattr(inputs, "_SMALL_BYTES", 1)
    large = job_of(row)
    put(row.recording[0], age_s=58.0)
    assert job_of(row).digest != large.digest
