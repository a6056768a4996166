"""The law of exit codes, command by command; README, help and the table of commands say it alike."""

import json
from pathlib import Path

import numpy as np
import pytest

from calib_core.geometry import OPTICAL_FROM_LINK, RigidTransform
from calib_core.recordings.containers.writing import write_ros2
from cocalib.cli import run
from cocalib.cli.commands import COMMANDS
from cocalib.cli.exit_codes import batch_exit_code, exit_codes
from cocalib.cli.old_names import OLD_NAMES
from tests.cli.conftest import Made

_SCENE = "made.mcap"
_MADE = Made(placements=20)
_POSITION_M = tuple(f"{value:.6f}" for value in _MADE.camera_from_radar.inverse().translation_m)
_TABLE = [
    (0, "solve", "--pairs", "good-pairs.json", "--out", "o.json", "--require", "usable"),
    (1, "solve", "--pairs", "few.json", "--out", "o.json"),
    (2, "solve", "--pairs", "absent.json"),
    (3, "solve", "--pairs", "good-pairs.json", "--method", "paper", "--out", "o.json", "--require", "usable"),
    (3, "solve", "--pairs", "mirrored.json", "--out", "o.json"),
    (0, "import", "good.json", "--out", "o.json"),
    (1, "import", "unclear.json", "--out", "o.json"),
    (2, "import", "empty"),
    (3, "import", "bare.txt", "--camera", "camera.yaml", "--out", "o.json"),
    (3, "import", "contradictory.json", "--out", "o.json"),
    (0, "evaluate", "good.json", _SCENE, "--clicks", "clicks.json", "--no-held-out"),
    (1, "evaluate", "good.json", _SCENE),
    (2, "evaluate", "good.json", "absent.mcap"),
    (3, "evaluate", "contradictory.json", _SCENE, "--clicks", "clicks.json", "--no-held-out"),
    (3, "evaluate", "bare.txt", _SCENE, "--clicks", "clicks.json", "--no-held-out", "--require", "usable"),
    (0, "check", "good.json"),
    (0, "check", "good.json", "--against", "good.json"),
    (0, "check", "contradictory.json", "--of", "contradictory.json"),
    (1, "check", "good.json", "--against", "turned.txt"),
    (2, "check", "empty"),
    (3, "check", "bare.txt"),
    (3, "check", "contradictory.json"),
    (0, "batch", "good.toml"),
    (11, "batch", "broken.toml"),
    (2, "batch", "absent.toml"),
    (0, "export", "good.json", "--to", "tf2"),
    (0, "export", "contradictory.json", "--to", "tf2"),
    (2, "export", "bare.txt", "--to", "tf2"),
    (0, "compare", "good.json", "turned.txt"),
    (1, "compare", "good.json", "turned.txt", _SCENE),
    (1, "check", "turned.txt", "--against", "good.json", "--recording", _SCENE),
    (3, "evaluate", "contradictory.json", "--report", "o.html"),
    (0, "report", "contradictory.json", "--out", "o.html"),
    (3, "report", "good.json", "--out", "o.html", "--require", "max-deg=0.001"),
    (2, "batch", "status", "absent"),
    (2, "show", "absent.mcap"),
    (2, "show", "absent.mcap", "--out", "o.mp4"),
    (2, "compare", "good.json"),
    (0, "report", "good.json", "--out", "o.html"),
    (2, "report", "empty", "--out", "o.html"),
    (0, "info", _SCENE),
    (1, "info", "cut.mcap", "--verify"),
    (2, "info", "empty"),
    (1, "propose", "two.mcap"),
    (2, "propose", "absent.mcap"),
    (2, "intrinsics", "absent.png"),
    (0, "session", "list", "."),
    (2, "session", "export", "absent"),
    (2, "fleet", "status", "absent"),
    (2, "simulate", "--out", "o", "--preset", "absent"),
    (2, "video", "absent.mcap", "--out", "o.mp4"),
    (2, "record-rrd", "absent.mcap", "--out", "o.rrd"),
    (2, "rerun", "absent.mcap"),
    (2, "open", "--absent"),
    (2, "demo", "--absent"),
]


def _pairs_text(points_radar_m: np.ndarray) -> str:
    """Write pairs with noise of a pixel."""
    pixels = _MADE.camera.project(_MADE.camera_from_radar @ _MADE.positions_radar_m)
    pixels += np.random.default_rng(3).normal(0.0, 1.0, pixels.shape)
    camera = {
        "model": "plumb_bob",
        "width_px": _MADE.camera.width_px,
        "height_px": _MADE.camera.height_px,
        "matrix_px": _MADE.camera.matrix_px.tolist(),
        "distortion": _MADE.camera.distortion.tolist(),
    }
    pairs = [
        {"id": f"p{index}", "radar_m": point, "pixel_px": pixel}
        for index, (point, pixel) in enumerate(zip(points_radar_m.tolist(), pixels.tolist(), strict=False))
    ]
    return json.dumps({"schema": "cocalib/pairs-1", "camera": camera, "pairs": pairs})


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files of the table."""
    path = tmp_path_factory.mktemp("codes")
    write_ros2(path / _SCENE, _MADE.messages(), container="mcap")
    write_ros2(path / "two.mcap", Made(placements=2).messages(), container="mcap")
    (file,) = (path / _SCENE).glob("*.mcap")
    (path / "cut.mcap").write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    (path / "clicks.json").write_text(_MADE.clicks())
    (path / "empty").write_bytes(b"")
    points_radar_m = _MADE.positions_radar_m
    (path / "good-pairs.json").write_text(_pairs_text(points_radar_m))
    (path / "few.json").write_text(_pairs_text(points_radar_m[:2]))
    (path / "mirrored.json").write_text(_pairs_text(points_radar_m * [1.0, -1.0, 1.0]))
    for pairs, out in (("good-pairs", "good"), ("mirrored", "contradictory")):
        flags = ["--pairs", str(path / f"{pairs}.json"), "--camera-position-m", *_POSITION_M]
        run(["solve", *flags, "--out", str(path / f"{out}.json")])
    pose = _MADE.camera_from_radar
    np.savetxt(path / "bare.txt", pose.as_matrix())
    np.savetxt(path / "turned.txt", pose.perturbed(np.array([0.0, 0.0, 0.0, 0.0, 0.2, 0.0])).as_matrix())
    matrix, size = (
        _MADE.camera.matrix_px,
        f"image_width: {_MADE.camera.width_px}\nimage_height: {_MADE.camera.height_px}",
    )
    (path / "camera.yaml").write_text(
        f"{size}\ndistortion_model: plumb_bob\ncamera_matrix: {{rows: 3, cols: 3, data: {matrix.ravel().tolist()}}}\n"
        f"distortion_coefficients: {{rows: 1, cols: 4, data: {_MADE.camera.distortion.tolist()}}}\n"
    )
    body = (pose.inverse() @ RigidTransform(OPTICAL_FROM_LINK, np.zeros(3))).as_matrix()
    (path / "unclear.json").write_text(json.dumps({"calibration": {"radar": {"T": body.tolist()}}}))
    row = f'[[session]]\nvehicle = "a"\nrecording = "{_SCENE}"\nclicks = "clicks.json"\n'
    (path / "good.toml").write_text(row)
    (path / "broken.toml").write_text(row + '[[session]]\nvehicle = "b"\nrecording = "cut.mcap"\n')
    return path


@pytest.mark.parametrize("row", _TABLE, ids=lambda row: " ".join(map(str, row)))
def test_every_command_keeps_the_law(row, folder, cocalib, monkeypatch):
    monkeypatch.chdir(folder)
    code, *arguments = row
    answer = cocalib(*arguments)
    assert answer.code == code, answer.out + answer.err


def test_the_table_has_every_command():
    assert {row[1] for row in _TABLE} == {*COMMANDS, *OLD_NAMES}


@pytest.mark.parametrize(
    ("levels", "require", "code"),
    [
        (["good", "usable"], "usable", 0),
        (["contradictory"], None, 0),
        (["contradictory", "good"], "usable", 11),
        (["good", "usable", None], "good", 12),
        ([None] * 200, None, 99),
    ],
)
def test_a_batch_counts_what_failed(levels, require, code):
    assert batch_exit_code(levels, require) == code


@pytest.mark.parametrize("command", ["check", "export"])
def test_the_verdict_of_a_file_is_said(command, folder, cocalib):
    flags = ["--to", "tf2"] if command == "export" else []
    for name in ("good", "contradictory"):
        verdict = json.loads((folder / f"{name}.json").read_text())["verdict"]
        answer = cocalib(command, folder / f"{name}.json", *flags)
        assert verdict["reason"] in answer.out + answer.err


def test_readme_and_help_state_the_law_alike(cocalib, project_root):
    for text in (cocalib("--help").out, (project_root / "README.md").read_text(encoding="utf-8")):
        assert exit_codes() in " ".join(text.split())
