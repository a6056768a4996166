"""Bad input: one clear line, the right exit code, no file written or lost."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Cocalib = Callable[..., Any]


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


@pytest.mark.parametrize(
    ("recording", "words"),
    [
        (lambda made, folder: folder / "absent.bag", ("absent.bag", "no such file")),
        (lambda made, folder: made(with_radar=False), ("no readable radar topic", "/camera/image/compressed")),
        (lambda made, folder: made(with_camera_info=False), ("no intrinsics", "cocalib intrinsics", "--camera")),
    ],
    ids=["absent", "no radar", "no intrinsics"],
)
def test_a_recording_that_cannot_be_calibrated_is_named(refused, made, tmp_path, recording, words):
    line = refused(recording(made, tmp_path))
    assert [word for word in words if word not in line] == []


STRAY = [{"id": "stray", "image_time": {"sec": 1_600_000_000, "nanosec": 5}, "pixel_px": [10, 10]}]


@pytest.mark.parametrize(
    ("change", "code", "words"),
    [
        (lambda clicks: STRAY, 2, ("stray", "1600000000.000000005", "no frame")),
        (lambda clicks: [*clicks[:2], {**clicks[2], "pixel_px": [320.0, 5.0]}], 2, ("c2", "320 x 240")),
        (lambda clicks: clicks[:3], 1, ("3 of", "4")),
        (lambda clicks: "none", 2, ("other.json", "clicks")),
    ],
    ids=["outside the recording", "outside the picture", "too few", "no list"],
)
def test_clicks_that_do_not_fit_are_named(refused, made, clicks_file, tmp_path, change, code, words):
    document = json.loads(clicks_file.read_text())
    clicks = tmp_path / "other.json"
    clicks.write_text(json.dumps(document | {"clicks": change(document["clicks"])}))
    line = refused(made(), clicks=clicks, code=code)
    assert [word for word in words if word not in line] == []


def test_nan_returns_do_not_shift_the_clicks(cocalib, made, clicks_file, tmp_path):
    """The authors' script drops NaN rows from the radar list only; here each click keeps its returns."""
    whole, holed = tmp_path / "whole.json", tmp_path / "holed.json"
    assert cocalib("solve", made("whole"), "--clicks", clicks_file, "--out", whole).code == 0
    assert cocalib("solve", made("holed", nan_scans=3), "--clicks", clicks_file, "--out", holed).code == 0
    pairs, holed_pairs = (json.loads(path.read_text())["pairs"] for path in (whole, holed))
    assert [pair["id"] for pair in pairs] == [pair["id"] for pair in holed_pairs]
    for pair, holed_pair in zip(pairs, holed_pairs, strict=True):
        assert holed_pair["radar_m"] == pytest.approx(pair["radar_m"], abs=0.01)


def test_a_misspelt_key_in_a_pairs_file_gets_a_suggestion(cocalib, pairs_file, tmp_path):
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


def test_three_pairs_are_too_few(cocalib, pairs_file, tmp_path):
    out = tmp_path / "calibration.json"
    answer = cocalib("solve", "--pairs", pairs_file(3), "--out", out)
    assert answer.code == 1
    assert "3 of" in answer.err
    assert not out.exists()


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
        (["batch", "export", "--parquet", "a"], "--parquet went in 0.1: use --csv"),
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
        (["show", "a.bag", "--out", "a.mp4", "--trail", "3"], "--calibration FILE is missing"),
        (["show", "a.bag", "--out", "a.mp4", "--web"], "remove --out to open it"),
        (["solve", "a.bag", "--propose", "--auto"], "--propose solves nothing: give a recording"),
        (["solve", "a.bag", "--json"], "--json applies with --propose only"),
        (["check", "a.json", "b.json", "--against", "c.json", "--recording", "d"], "judges two calibrations"),
        (["info", "a.bag", "--clock", "wall"], "--clock takes auto, header or receive, not 'wall'"),
        (["open", "a.bag", "--port", "http"], "--port takes a whole number, not 'http'"),
        (["solve", "a.bag", "--camera-position-m", "0", "1", "up"], "--camera-position-m takes X Y Z"),
        (["solve", "a.bag", "--camera-position-by", "eye"], "--camera-position-by"),
        (["session", "export", "a"], "needs the name of the new file: --out clicks.json"),
        (["session", "export", "--out", "b"], "takes one session folder, or its recording; 0 given"),
        (["session", "repair", "a", "b"], "takes one session folder, or its recording; 2 given"),
        (["session", "list", "--yes"], "--yes applies to session repair only"),
        (["session", "repair", "a", "--json"], "--json applies to session list only"),
        (["session", "list", "--out", "b"], "--out applies to session export only"),
        (["session", "repair", "absent"], "absent: no such folder"),
        (["session", "mend"], "takes list, repair or export, not 'mend'"),
        (["batch", "status"], "batch status takes OUT; 0 given"),
        (["batch", "history", "OUT"], "batch history takes VEHICLE OUT; 1 given"),
        (["batch", "compare", "A", "OUT"], "batch compare takes A B OUT; 2 given"),
        (["batch", "status", "/nowhere"], "/nowhere: no such folder"),
        (["batch", "export", "OUT"], "needs the name of the new file: --csv FILE"),
        (["batch", "export", "OUT", "--json"], "--json applies to batch status, history, compare only"),
        (["batch", "walk", "OUT"], "batch takes one MANIFEST, or an action: status, history"),
        (["batch", "status", "OUT", "--workers", "2"], "batch status takes --json or --csv only"),
        (["compare", "a.json"], "is cocalib check NEW --against OLD now"),
        (["evaluate"], "CALIBRATION is missing; see cocalib evaluate --help"),
        (["evaluate", "{golden}"], "evaluate needs a recording, or --report FILE.html"),
        (
            ["evaluate", "{golden}", "--boxes", "b.json", "--report", "a.html"],
            "apply with a RECORDING only; give it after the",
        ),
        (["evaluate", "/nowhere.json", "--report", "a.html"], "/nowhere.json: "),
        (["evaluate", "{golden}", "--report", "/nowhere/report.html"], "/nowhere/report.html: cannot be written: "),
        (["solve", "a.bag", "--vehicle", "a/b"], "--vehicle: 'a/b' cannot be a name; give one without slashes"),
        (["solve", "a.bag", "--session-name", ".."], "--session-name: '..' cannot be a name"),
        (["solve", "a.bag", "--vehicle-type", " "], "--vehicle-type is ' '; give 1 to 120 printable characters"),
        (["solve", "a.bag", "--camera-serial", "x" * 121], "--camera-serial is 'xxxxxxxxxxxxxxxxxxxx…'; give 1 to 120"),
        (["simulate", "--out", "absent", "--preset", "kind"], "not 'kind'"),
    ],
)
def test_wrong_usage_gets_a_clear_error(cocalib, project_root, tmp_path, monkeypatch, arguments, expected):
    monkeypatch.chdir(tmp_path)
    golden = project_root / "tests/golden/calibration-1.json"
    answer = cocalib(*(word.format(golden=golden) for word in arguments))
    assert answer.code == 2
    (line,) = answer.err.splitlines()
    assert expected in line
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", ["open", "info", "solve", "export", "check", "import", "show", "simulate"])
def test_the_help_names_every_value(cocalib, command):
    answer = cocalib(command, "--help")
    assert answer.code == 0
    assert "None" not in answer.out
    assert "STR" not in answer.out


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("noise.sigmapx=3", "unknown option 'noise.sigmapx'; did you mean noise.sigma_px?"),
        ("noise=3", "unknown option 'noise'"),
        ("noise.sigma_px=many", "option noise.sigma_px: expected `float`"),
        ("noise.sigma_px=0", "option noise.sigma_px: 0 is out of range"),
        ("noise.sigma_px", "--set noise.sigma_px: give NAME=VALUE"),
    ],
)
def test_a_setting_that_is_none_is_refused_in_one_line(cocalib, setting, words):
    refused = cocalib("solve", "--propose", "nowhere.bag", "--set", setting)
    assert (refused.code, refused.out) == (2, "")
    assert refused.err.startswith(f"cocalib: {words}")
    assert refused.err.count("\n") == 1
