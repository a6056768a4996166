"""`cocalib batch` as a person with many vehicles runs it."""

import json
import shutil
from pathlib import Path

import pytest

from cocalib.cli import run

SAMPLE = Path(__file__).resolve().parents[2] / "sample_data" / "rooftop"


@pytest.fixture
def fleet(tmp_path: Path) -> Path:
    """A folder with a session that was clicked, one that was not, and a broken one."""
    for session in ("van/clicked", "van/not-clicked"):
        (tmp_path / session).mkdir(parents=True)
        for name in ("radar.bag", "camera.bag"):
            shutil.copy(SAMPLE / name, tmp_path / session / name)
    shutil.copy(SAMPLE / "clicks.json", tmp_path / "van" / "clicked" / "clicks.json")
    (tmp_path / "broken.bag").write_bytes(b"#ROSBAG V2.0\n")
    return tmp_path


def test_from_a_folder_to_a_table(fleet, capsys):
    manifest = fleet / "fleet.toml"
    assert run(["batch", str(manifest), "--init", str(fleet)]) == 0
    assert "3 sessions written to" in capsys.readouterr().out
    assert run(["batch", str(manifest)]) == 12
    printed = capsys.readouterr()
    assert printed.out.splitlines()[0] == "3 sessions: 1 solved, 1 refused, 1 failed"
    why = {line.split()[1]: line for line in printed.out.splitlines()[3:5]}
    assert "refused" in why["not-clicked"]
    assert "failed" in why["broken"]
    assert printed.err.splitlines()[0] == "3 sessions"
    assert (fleet / "fleet" / "summary.html").is_file()
    assert run(["batch", "status", str(fleet / "fleet")]) == 3
    assert "not-clicked" in capsys.readouterr().out


def test_what_is_done_is_not_done_again(fleet, capsys):
    manifest = fleet / "fleet.toml"
    manifest.write_text(
        '[[session]]\nvehicle = "van"\nsession = "1"\nrecording = ["van/clicked/radar.bag", "van/clicked/camera.bag"]\n'
        'clicks = "van/clicked/clicks.json"\n',
        encoding="utf-8",
    )
    assert run(["batch", str(manifest), "--out", str(fleet / "out")]) == 0
    (calibration,) = (fleet / "out").rglob("calibration.json")
    written, first = calibration.stat().st_mtime_ns, calibration.read_bytes()
    capsys.readouterr()
    assert run(["batch", str(manifest), "--out", str(fleet / "out")]) == 0
    assert calibration.stat().st_mtime_ns == written
    assert "1 of 1 session done already" in capsys.readouterr().err
    solved = fleet / "solved.json"
    clicked = fleet / "van" / "clicked"
    recordings = [str(clicked / "radar.bag"), str(clicked / "camera.bag")]
    flags = ["--clicks", str(clicked / "clicks.json"), "--vehicle", "van", "--session-name", "1"]
    assert run(["solve", *recordings, *flags, "--out", str(solved)]) == 0
    assert solved.read_bytes() == first


def test_what_the_last_batch_wanted_counts_and_what_it_lacks_is_named(fleet, capsys):
    manifest, out, clicks = fleet / "fleet.toml", fleet / "out", fleet / "van" / "clicked" / "clicks.json"
    row = 'recording = ["van/clicked/radar.bag", "van/clicked/camera.bag"]\nclicks = "van/clicked/clicks.json"\n'
    manifest.write_text(f'[[session]]\nvehicle = "van"\nsession = "1"\n{row}', encoding="utf-8")
    whole = clicks.read_text()
    few = json.loads(whole)
    few["clicks"] = few["clicks"][:7]
    for text in (whole, json.dumps(few), whole):
        clicks.write_text(text)
        run(["batch", str(manifest), "--out", str(out)])
    capsys.readouterr()
    run(["batch", "history", "van", str(out), "--json"])
    (session,) = json.loads(capsys.readouterr().out)["sessions"]
    assert session["pairs"] == 20
    manifest.write_text(
        manifest.read_text().replace('"van"', '"VAN"', 1) + '[[session]]\nvehicle = "b"\nrecording = "broken.bag"\n'
    )
    run(["batch", str(manifest), "--out", str(out)])
    (broken,) = (path.parent for path in out.rglob("outcome.json") if '"vehicle": "b"' in path.read_text())
    shutil.rmtree(broken)
    capsys.readouterr()
    assert run(["batch", "status", str(out)]) == 3
    told = capsys.readouterr().out
    assert "1 session in the manifest without a result: run the batch again: b/broken" in told
    assert "1 session with a result in no manifest any more" in told
    assert "van/1" in told


def test_a_pose_that_nobody_must_use_is_weak_and_not_exported(fleet, capsys):
    manifest, clicks = fleet / "fleet.toml", fleet / "van" / "clicked" / "clicks.json"
    mirrored = json.loads(clicks.read_text())
    for click in mirrored["clicks"]:
        click["pixel_px"][0] = 959.0 - click["pixel_px"][0]
    clicks.write_text(json.dumps(mirrored))
    manifest.write_text(
        '[[session]]\nvehicle = "van"\nsession = "1"\nexports = ["tf2"]\n'
        'recording = ["van/clicked/radar.bag", "van/clicked/camera.bag"]\nclicks = "van/clicked/clicks.json"\n'
    )
    assert run(["batch", str(manifest), "--out", str(fleet / "out")]) == 0
    assert "1 session: 1 weak" in capsys.readouterr().out
    assert run(["batch", str(manifest), "--out", str(fleet / "out"), "--require", "usable"]) == 11
    assert not list((fleet / "out").rglob("static_transform*"))
