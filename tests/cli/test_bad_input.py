"""Bad input: one clear line, the right exit code, no file written or lost."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from calib_core.recordings.containers.writing import write_ros2

Cocalib = Callable[..., Any]
MadeRecording = Callable[..., Path]


@pytest.fixture
def refused(cocalib: Cocalib, tmp_path: Path, clicks_file: Path) -> Callable[..., str]:
    """Return a function that runs solve, expects a one-line error, and returns that line."""

    def refuse(*recording: object, clicks: Path = clicks_file, code: int = 2) -> str:
        out = tmp_path / "calibration.json"
        out.write_text("an earlier calibration")
        before = {path: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()}
        answer = cocalib("solve", *recording, "--clicks", clicks, "--out", out)
        assert answer.code == code, answer
        assert answer.out == ""
        (line,) = answer.err.splitlines()
        assert line.startswith("cocalib: ")
        after = {path: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()}
        assert after == before, "a refused command must leave every file unchanged"
        return line

    return refuse


def test_a_missing_file_is_named(refused: Callable[..., str], tmp_path: Path) -> None:
    line = refused(tmp_path / "absent.bag")
    assert "absent.bag" in line
    assert "no such file" in line


def test_a_file_that_is_not_a_recording_is_named_with_the_accepted_types(
    refused: Callable[..., str], tmp_path: Path
) -> None:
    path = tmp_path / "holiday.bag"
    path.write_bytes(b"GIF89a" + bytes(500))
    line = refused(path)
    assert "holiday.bag" in line
    assert ".bag" in line
    assert ".mcap" in line


def test_an_empty_file_is_refused(refused: Callable[..., str], tmp_path: Path) -> None:
    path = tmp_path / "nothing.bag"
    path.write_bytes(b"")
    assert "empty" in refused(path)


def test_a_bag_without_messages_is_refused(refused: Callable[..., str], tmp_path: Path) -> None:
    line = refused(write_ros2(tmp_path / "silent.mcap", [], container="mcap"))
    assert "silent.mcap" in line
    assert "no messages" in line


def test_a_recording_without_radar_says_what_it_has(refused: Callable[..., str], made: MadeRecording) -> None:
    line = refused(made(with_radar=False))
    assert "no readable radar topic" in line
    assert "/camera/image/compressed" in line


def test_a_recording_without_camera_says_what_it_has(refused: Callable[..., str], made: MadeRecording) -> None:
    line = refused(made(with_images=False, with_camera_info=False))
    assert "no readable camera image topic" in line
    assert "/radar/points" in line


def test_a_topic_that_does_not_exist_gets_a_suggestion(
    cocalib: Cocalib, made: MadeRecording, clicks_file: Path
) -> None:
    answer = cocalib("solve", made(), "--clicks", clicks_file, "--radar-topic", "/radar/point")
    assert answer.code == 2
    assert "/radar/points" in answer.err


def test_sensors_that_never_recorded_together_are_reported(refused: Callable[..., str], made: MadeRecording) -> None:
    line = refused(made(radar_late_s=3600))
    assert "3568.0 s apart" in line
    assert "/radar/points" in line
    assert "/camera/image/compressed" in line


def test_missing_intrinsics_are_asked_for(refused: Callable[..., str], made: MadeRecording) -> None:
    line = refused(made(with_camera_info=False))
    assert "no intrinsics" in line
    assert "cocalib intrinsics" in line
    assert "--camera" in line


def test_a_click_outside_the_recording_is_named(
    refused: Callable[..., str], made: MadeRecording, tmp_path: Path
) -> None:
    clicks = tmp_path / "other.json"
    click = {"id": "stray", "image_time": {"sec": 1_600_000_000, "nanosec": 5}, "pixel_px": [10, 10]}
    clicks.write_text(json.dumps({"schema": "cocalib/clicks-1", "clicks": [click]}))
    line = refused(made(), clicks=clicks)
    assert "stray" in line
    assert "1600000000.000000005" in line
    assert "outside the recording" in line


def test_a_click_outside_the_image_is_named(
    refused: Callable[..., str], made: MadeRecording, clicks_file: Path, tmp_path: Path
) -> None:
    document = json.loads(clicks_file.read_text())
    document["clicks"][2]["pixel_px"] = [320.0, 5.0]
    clicks = tmp_path / "other.json"
    clicks.write_text(json.dumps(document))
    line = refused(made(), clicks=clicks)
    assert "c2" in line
    assert "320 x 240" in line


def test_three_clicks_are_too_few_and_the_missing_one_is_counted(
    refused: Callable[..., str], made: MadeRecording, clicks_file: Path, tmp_path: Path
) -> None:
    document = json.loads(clicks_file.read_text())
    document["clicks"] = document["clicks"][:3]
    clicks = tmp_path / "few.json"
    clicks.write_text(json.dumps(document))
    line = refused(made(), clicks=clicks, code=1)
    assert "3 of" in line
    assert "4" in line


def test_clicks_that_are_not_json_are_refused(refused: Callable[..., str], made: MadeRecording, tmp_path: Path) -> None:
    clicks = tmp_path / "broken.json"
    clicks.write_text('{"schema": "cocalib/clicks-1", "clicks": [')
    assert "broken.json" in refused(made(), clicks=clicks)


def test_nan_returns_do_not_shift_the_clicks(
    cocalib: Cocalib, made: MadeRecording, clicks_file: Path, tmp_path: Path
) -> None:
    """The authors' script drops NaN rows from the radar list only; here each click keeps its returns."""
    whole, holed = tmp_path / "whole.json", tmp_path / "holed.json"
    assert cocalib("solve", made("whole"), "--clicks", clicks_file, "--out", whole).code == 0
    assert cocalib("solve", made("holed", nan_scans=3), "--clicks", clicks_file, "--out", holed).code == 0
    pairs, holed_pairs = (json.loads(path.read_text())["pairs"] for path in (whole, holed))
    assert [pair["id"] for pair in pairs] == [pair["id"] for pair in holed_pairs]
    for pair, holed_pair in zip(pairs, holed_pairs, strict=True):
        assert holed_pair["radar_m"] == pytest.approx(pair["radar_m"], abs=0.01)


def test_a_misspelt_key_in_a_pairs_file_gets_a_suggestion(
    cocalib: Cocalib, pairs_file: Callable[..., Path], tmp_path: Path
) -> None:
    def misspell(document: dict[str, Any]) -> None:
        document["pairs"][3]["pixl_px"] = document["pairs"][3].pop("pixel_px")

    out = tmp_path / "calibration.json"
    answer = cocalib("solve", "--pairs", pairs_file(change=misspell), "--out", out)
    assert answer.code == 2
    (line,) = answer.err.splitlines()
    assert "pairs[3]" in line
    assert "pixl_px" in line
    assert "pixel_px" in line
    assert not out.exists()


def test_three_pairs_are_too_few(cocalib: Cocalib, pairs_file: Callable[..., Path], tmp_path: Path) -> None:
    out = tmp_path / "calibration.json"
    answer = cocalib("solve", "--pairs", pairs_file(3), "--out", out)
    assert answer.code == 1
    assert "3 of" in answer.err
    assert not out.exists()


def test_an_unwritable_folder_is_named(cocalib: Cocalib, pairs_file: Callable[..., Path], tmp_path: Path) -> None:
    answer = cocalib("solve", "--pairs", pairs_file(), "--out", tmp_path / "absent" / "calibration.json")
    assert answer.code == 2
    assert "absent" in answer.err


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["solve"], "--clicks"),
        (["solve", "a.bag"], "--clicks"),
        (["solve", "--pairs", "a.json", "--clicks", "b.json"], "not both"),
        (["solve", "--pairs", "absent.json"], "absent.json"),
        (["export", "absent.json", "--to", "tf2"], "absent.json"),
        (["export", "a.json", "--to", "urdff"], "urdf"),
        (["check", "absent.json"], "absent.json"),
        (["info", "absent.bag"], "absent.bag"),
        (["open", "absent.bag", "--no-browser"], "absent.bag"),
        (["demo", "--no-browser", "--port", "99999"], "65535"),
        (["demo", "--no-browser", "--host", "203.0.113.5"], "203.0.113.5"),
        (["demo", "--no-browser", "--token", ""], "empty"),
        (["info"], "no recording given"),
        (["bogus"], "unknown command 'bogus'; known: demo, open"),
        (["infos", "a.bag"], "did you mean 'info'?"),
        (
            ["solve", "--pairs", "a.json", "--fleet-prior", "b"],
            "--fleet-prior went in 0.1: each pose rests on its own pairs",
        ),
        (["batch", "a.toml", "--engine=none"], "--engine went in 0.1: use --workers 1 for none"),
        (["batch", "a.toml", "--shard", "1/2"], "--shard went in 0.1: give --scheduler ADDRESS"),
        (["fleet", "rebuild"], "ACTION rebuild went in 0.1: the commands read the results themselves"),
        (["fleet", "export", "--parquet", "a"], "--parquet went in 0.1: use --csv"),
        (["export", "a.json", "--to", "tf1-launch"], "format 'tf1-launch' went in 0.1: use tf2 or tf2-launch-py"),
        (["--json", "info"], "unknown option --json; give a command first: demo, open"),
        (["info", "a.bag", "--bogus"], "unknown option --bogus; see cocalib info --help"),
        (["info", "a.bag", "--topic", "/radar"], "did you mean --camera-info-topic, --image-topic or --radar-topic?"),
        (["solve", "a.bag", "--clicsk=b.json"], "unknown option --clicsk; did you mean --clicks"),
        (["solve", "--pairs"], "--pairs needs a value: --pairs FILE; see cocalib solve --help"),
        (["check"], "CALIBRATION is missing; see cocalib check --help"),
        (["check", "a.json", "--max-deg", "1"], "are limits for --against FILE"),
        (["check", "a.json", "--clicks", "clicks.json"], "give it with --recording RECORDING"),
        (["check", "a.json", "--radar-topic", "/r"], "apply with --recording RECORDING only"),
        (["video", "a.bag"], "--out FILE is missing; see cocalib video --help"),
        (["info", "a.bag", "--clock", "wall"], "--clock takes auto, header or receive, not 'wall'"),
        (["open", "a.bag", "--port", "http"], "--port takes a whole number, not 'http'"),
        (["solve", "a.bag", "--camera-position-m", "0", "1", "up"], "--camera-position-m takes X Y Z"),
    ],
)
def test_wrong_usage_gets_a_clear_error(cocalib: Cocalib, arguments: list[str], expected: str) -> None:
    answer = cocalib(*arguments)
    assert answer.code == 2
    (line,) = answer.err.splitlines()
    assert expected in line


@pytest.mark.parametrize(
    "command", ["open", "info", "solve", "export", "check", "import", "video", "record-rrd", "rerun", "simulate"]
)
def test_the_help_names_every_value(cocalib: Cocalib, command: str) -> None:
    answer = cocalib(command, "--help")
    assert answer.code == 0
    assert "None" not in answer.out
    assert "STR" not in answer.out
