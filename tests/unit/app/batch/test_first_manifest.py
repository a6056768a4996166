"""A first manifest says what lies in a folder, and can be read back."""

from pathlib import Path

import pytest

from calib_core.errors import InputError
from cocalib.batch.first_manifest import first_manifest
from cocalib.batch.manifest import ManifestRow, read_manifest

CLICKS = '{"schema": "cocalib/clicks-1", "clicks": []}'


def lay(folder: Path, *names: str) -> None:
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(CLICKS if path.suffix == ".json" else "", encoding="utf-8")


def read_back(folder: Path) -> dict[tuple[str, str], ManifestRow]:
    manifest = folder / "sessions.toml"
    text, count = first_manifest(folder, manifest)
    manifest.write_text(text, encoding="utf-8")
    rows = read_manifest(manifest).rows
    assert len(rows) == count
    return {(row.vehicle, row.session): row for row in rows}


def test_vehicles_and_sessions_are_folders(tmp_path):
    bags = ("radar.bag", "camera.bag")
    lay(tmp_path, *(f"van {place}/{bag}" for place in ("7/spring", "8") for bag in bags), "van 7/autumn/drive.mcap")
    found = read_back(tmp_path)
    assert set(found) == {("van 7", "spring"), ("van 7", "autumn"), ("van 8", "1")}
    assert {path.name for path in found["van 7", "spring"].recording} == {"radar.bag", "camera.bag"}
    assert len(found["van 8", "1"].recording) == 2


def test_recordings_of_one_folder_belong_together_if_only_the_sensor_differs(tmp_path):
    lay(tmp_path, "van/radar_01.bag", "van/camera_01.bag", "van/radar_02.bag", "van/camera_02.bag", "single.bag")
    found = read_back(tmp_path)
    assert set(found) == {("van", "01"), ("van", "02"), ("single", "single")}
    assert [path.name for path in found["van", "02"].recording] == ["camera_02.bag", "radar_02.bag"]


def test_a_bag_folder_is_one_recording(tmp_path):
    lay(tmp_path, "van/2026-01-02/bag/metadata.yaml", "van/2026-01-02/bag/bag_0.db3", ".hidden/a.bag")
    found = read_back(tmp_path)
    assert [row.recording for row in found.values()] == [(tmp_path / "van" / "2026-01-02" / "bag",)]


def test_clicks_beside_the_only_recording_are_taken(tmp_path):
    lay(tmp_path, "van/a/drive.bag", "van/a/clicks.json", "van/b/drive.bag", "van/b/one.json", "van/b/two.json")
    (tmp_path / "van" / "a" / "truth.json").write_text('{"schema": "cocalib/truth-1"}', encoding="utf-8")
    found = read_back(tmp_path)
    assert found["van", "a"].clicks == tmp_path / "van" / "a" / "clicks.json"
    assert found["van", "b"].clicks is None
    assert not any(row.auto for row in found.values())
    assert "van/b/one.json, van/b/two.json" in first_manifest(tmp_path, tmp_path / "x.toml")[0]


def test_names_of_any_kind_survive(tmp_path):
    lay(tmp_path, 'a"b é/c d.bag')
    ((row),) = read_back(tmp_path).values()
    assert row.recording == (tmp_path / 'a"b é' / "c d.bag",)


def test_a_manifest_elsewhere_names_whole_paths(tmp_path):
    lay(tmp_path, "data/van.bag")
    manifest = tmp_path / "other" / "sessions.toml"
    manifest.parent.mkdir()
    manifest.write_text(first_manifest(tmp_path / "data", manifest)[0], encoding="utf-8")
    (row,) = read_manifest(manifest).rows
    assert row.recording == (tmp_path / "data" / "van.bag",)


def test_folders_of_images_and_tables_are_named_as_left_out(tmp_path):
    frames = ("frames/1.png", "frames/2.png", "radar.csv")
    lay(tmp_path, "van 1/drive.mcap", "van 1/thumbs/1.png", *(f"van 2/{name}" for name in frames))
    text, count = first_manifest(tmp_path, tmp_path / "sessions.toml")
    assert count == 1
    left_out = [line for line in text.splitlines() if line.startswith("# left out: ")]
    assert [line.partition(" (")[2].partition(")")[0] for line in left_out] == ["1 .csv", "2 .png"]
    assert set(read_back(tmp_path)) == {("van 1", "drive")}


def test_of_many_left_out_folders_some_are_named_and_the_rest_counted(tmp_path):
    lay(tmp_path, "van/drive.mcap", *(f"p{k:02}/1.png" for k in range(25)))
    text, _ = first_manifest(tmp_path, tmp_path / "sessions.toml")
    assert text.count("# left out: ") == 20
    assert text.endswith(" 5 more folders\n")


def test_a_folder_without_recordings_is_refused(tmp_path):
    with pytest.raises(InputError, match="no recording in it"):
        first_manifest(tmp_path, tmp_path / "x.toml")
    with pytest.raises(InputError, match="no such folder"):
        first_manifest(tmp_path / "absent", tmp_path / "x.toml")


def test_links_are_followed_once_and_every_name_is_one_that_a_manifest_takes(tmp_path):
    lay(tmp_path, "van/spring/drive.mcap", "a\\b/autumn/drive.mcap")
    (tmp_path / "van" / "loop").symlink_to(tmp_path, target_is_directory=True)
    (tmp_path / "again").symlink_to(tmp_path / "van" / "spring", target_is_directory=True)
    assert set(read_back(tmp_path)) == {("van", "spring"), ("a_b", "autumn")}
