"""`cocalib batch` as a person with many vehicles runs it."""

import json
import shutil
from pathlib import Path

import pytest

SAMPLE = Path(__file__).resolve().parents[2] / "sample_data" / "rooftop"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a session that was clicked, one that was not, and a broken one."""
    for session in ("van/clicked", "van/not-clicked"):
        (tmp_path / session).mkdir(parents=True)
        for name in ("radar.bag", "camera.bag"):
            shutil.copy(SAMPLE / name, tmp_path / session / name)
    shutil.copy(SAMPLE / "clicks.json", tmp_path / "van" / "clicked" / "clicks.json")
    (tmp_path / "broken.bag").write_bytes(b"#ROSBAG V2.0\n")
    (tmp_path / "sessions.toml").write_text(
        '[[session]]\nvehicle = "van"\nsession = "1"\nexports = ["tf2"]\n'
        'recording = ["van/clicked/radar.bag", "van/clicked/camera.bag"]\nclicks = "van/clicked/clicks.json"\n'
    )
    return tmp_path


@pytest.mark.slow
def test_from_a_folder_to_a_table(folder, cocalib):
    manifest = folder / "found.toml"
    rows = [(folder / "sessions.toml").read_text().replace('"1"', '"clicked"')]
    for name, recording in (
        ("not-clicked", ["van/not-clicked/radar.bag", "van/not-clicked/camera.bag"]),
        ("broken", ["broken.bag"]),
    ):
        rows.append(f'[[session]]\nvehicle = "van"\nsession = "{name}"\nrecording = {recording}\n')
    manifest.write_text("".join(rows))
    answer = cocalib("batch", manifest)
    assert answer.code == 12
    assert answer.out.splitlines()[0].endswith("1 refused, 1 failed")
    assert "/not-clicked: refused: " in answer.out
    assert "/broken: failed: " in answer.out
    assert answer.err.splitlines()[0] == "3 sessions"
    tables = [folder / "found" / name for name in ("results.csv", "results.json")]
    assert all(str(path) in answer.out for path in tables)
    status, as_json = (cocalib("batch", "status", folder / "found", *more) for more in ((), ("--json",)))
    as_csv = cocalib("batch", "status", folder / "found", "--csv", folder / "copy.csv")
    assert status.code == as_json.code == as_csv.code == 3
    assert [(folder / "copy.csv").read_text(), as_json.out] == [path.read_text() for path in tables]
    assert max(map(len, status.out.splitlines()[:4])) <= 80
    statuses = {row["session"]: row["status"] for row in json.loads(as_json.out)["sessions"]}
    assert statuses == {"clicked": "solved", "not-clicked": "refused", "broken": "failed"}


@pytest.mark.slow
def test_what_is_done_is_not_done_again(folder, cocalib):
    command, clicked = ("batch", folder / "sessions.toml", "--out", folder / "out"), folder / "van" / "clicked"
    assert cocalib(*command).code == 0
    (calibration,) = (folder / "out").rglob("calibration.json")
    written, first = calibration.stat().st_mtime_ns, calibration.read_bytes()
    again = cocalib(*command)
    assert (again.code, calibration.stat().st_mtime_ns) == (0, written)
    assert "1 of 1 session" in again.err
    flags = ("--clicks", clicked / "clicks.json", "--vehicle", "van", "--session-name", "1", "--out", folder / "a.json")
    assert cocalib("solve", clicked / "radar.bag", clicked / "camera.bag", *flags).code == 0
    assert (folder / "a.json").read_bytes() == first


@pytest.mark.slow
def test_what_the_last_batch_wanted_counts_and_what_it_lacks_is_named(folder, cocalib):
    manifest, out, clicks = folder / "sessions.toml", folder / "out", folder / "van" / "clicked" / "clicks.json"
    whole = clicks.read_text()
    few = json.loads(whole)
    few["clicks"] = few["clicks"][:7]
    for text in (whole, json.dumps(few), whole):
        clicks.write_text(text)
        cocalib("batch", manifest, "--out", out)
    told = cocalib("batch", "status", out, "--json")
    assert (told.code, [row["pairs"] for row in json.loads(told.out)["sessions"]]) == (0, [20])
    more = '[[session]]\nvehicle = "b"\nrecording = "broken.bag"\n'
    manifest.write_text(manifest.read_text().replace('"van"', '"VAN"', 1) + more)
    cocalib("batch", manifest, "--out", out)
    (broken,) = (path.parent for path in out.rglob("outcome.json") if '"vehicle": "b"' in path.read_text())
    shutil.rmtree(broken)
    told = cocalib("batch", "status", out, "--json")
    assert told.code == 3
    rows = {row["vehicle"]: row["status"] for row in json.loads(told.out)["sessions"]}
    assert rows == {"VAN": "solved", "b": "missing"}


@pytest.mark.slow
def test_a_pose_that_nobody_must_use_is_weak_and_not_exported(folder, cocalib):
    command, clicks = (
        ("batch", folder / "sessions.toml", "--out", folder / "out"),
        folder / "van" / "clicked" / "clicks.json",
    )
    mirrored = json.loads(clicks.read_text())
    for click in mirrored["clicks"]:
        click["pixel_px"][0] = 959.0 - click["pixel_px"][0]
    clicks.write_text(json.dumps(mirrored))
    answer = cocalib(*command)
    assert answer.code == 0
    assert ": 1 in doubt" in answer.out
    assert cocalib(*command, "--require", "usable").code == 11
    assert not list((folder / "out").rglob("static_transform*"))
