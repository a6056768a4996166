"""The wheel can be built, installed into an empty environment and run there."""

import csv
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
import urllib.request
import zipfile
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from benchmarks.boards import render_board
from calib_core.intrinsics.board import Board
from calib_core.synthetic.boards import waved_poses
from calib_core.synthetic.rig import typical_camera
from tests.architecture.test_named_commands import command_lines
from tests.port_client import channel, come_in, wanted
from tests.served_process import ServedProcess

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def wheel(project_root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the wheel with the pinned build backend, without network access."""
    folder = tmp_path_factory.mktemp("wheel")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)],
        cwd=project_root,
        check=True,
        capture_output=True,
        text=True,
    )
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Install the wheel into an empty environment that uses this one's dependencies; return its folder.

    The locked dependencies are already installed here; a .pth file makes them visible, so that the test needs no
    network and the checkout is not on the path.
    """
    folder = tmp_path_factory.mktemp("environment")
    subprocess.run(
        [sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True
    )  # the pip of this environment can install into it
    python = folder / "bin" / "python"
    pip = [sys.executable, "-m", "pip", "--python", str(python), "--disable-pip-version-check"]
    subprocess.run([*pip, "install", "--quiet", "--no-index", "--no-deps", str(wheel)], check=True)
    site = subprocess.run(
        [python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"],
        check=True,
        capture_output=True,
        text=True,
    ).stdout.strip()
    (Path(site) / "zz_borrowed.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return folder


def test_the_wheel_contains_the_page_and_the_sample(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    assert {
        "cocalib/static/index.html",
        "cocalib/static/base/state.js",
        "cocalib/sample_data/rooftop/radar.bag",
        "cocalib/sample_data/rooftop/camera.bag",
    } <= names
    assert "calib_core/interchange/published/calibration-1.schema.json" in names
    assert {"cocalib/py.typed", "calib_core/py.typed"} <= names
    assert {name.split("/")[0] for name in names if ".dist-info" not in name} == {
        "calib_core",
        "cocalib",
    }
    assert not any("__pycache__" in name or "/tests/" in name for name in names)


def test_the_installed_command_finds_its_own_page_and_sample(installed, tmp_path):
    code = "from cocalib.platform import resources; print(resources.static_folder()); print(resources.sample_folder())"
    printed = subprocess.run(
        [installed / "bin" / "python", "-c", code],
        cwd=tmp_path,
        check=True,
        capture_output=True,
        text=True,
        env={name: value for name, value in os.environ.items() if name != "PYTHONPATH"},
    ).stdout.split()
    assert len(printed) == 2
    for line in printed:
        assert Path(line).is_relative_to(installed), "found in the checkout, not in the wheel"


def test_a_foreign_package_called_app_is_left_alone(wheel, tmp_path):
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path], check=True)
    python = tmp_path / "bin" / "python"
    ask = "import sysconfig; print(sysconfig.get_path('purelib'))"
    site = Path(subprocess.run([python, "-c", ask], check=True, capture_output=True, text=True).stdout.strip())
    (site / "app").mkdir()
    (site / "app" / "__init__.py").write_text("WHOSE = 'another program'\n")
    (site / "zz_borrowed.pth").write_text(sysconfig.get_path("purelib") + "\n")
    pip = [sys.executable, "-m", "pip", "--python", str(python), "--disable-pip-version-check"]
    subprocess.run([*pip, "install", "--quiet", "--no-index", "--no-deps", wheel], check=True)
    code = "import app, cocalib as cc; print(app.WHOSE, cc.aed.__module__, cc.__file__)"
    said = subprocess.run([python, "-c", code], cwd=tmp_path, check=True, capture_output=True, text=True).stdout
    assert said.startswith("another program calib_core.results.metrics ")
    assert str(site) in said
    assert subprocess.run([tmp_path / "bin" / "cocalib", "--version"], capture_output=True).returncode == 0
    subprocess.run([*pip, "uninstall", "--quiet", "--yes", "cocalib"], check=True)
    assert (site / "app" / "__init__.py").read_text() == "WHOSE = 'another program'\n"
    assert not (site / "cocalib").exists()


def test_the_installed_command_serves_its_page(installed, tmp_path):
    server = subprocess.Popen(
        [installed / "bin" / "cocalib", "demo", "--no-browser", "--port", "0", "--session", tmp_path / "session"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1", "XDG_STATE_HOME": str(tmp_path / "state")},
    )
    try:
        assert server.stdout is not None
        link = next(
            found[0] for line in server.stdout if (found := re.search(r"http://127\.0\.0\.1:\d+/\?token=\S+", line))
        )
        browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
        page = browser.open(link, timeout=30).read().decode()
        assert "cocalib" in page
        for part in ("page/main.js", "base/state.js", "space/pace.js"):
            assert browser.open(link.partition("?")[0] + part, timeout=30).status == 200
    finally:
        server.terminate()
        server.communicate()


def test_the_installed_command_solves_its_sample_and_packs_it(installed, tmp_path):
    code = "from cocalib.platform import resources; print(resources.sample_folder() / 'rooftop')"
    sample = Path(
        subprocess.run(
            [installed / "bin" / "python", "-c", code], cwd=tmp_path, check=True, capture_output=True, text=True
        ).stdout.strip()
    )
    out = tmp_path / "calibration.json"
    done = subprocess.run(
        [
            installed / "bin" / "cocalib",
            "solve",
            sample / "radar.bag",
            sample / "camera.bag",
            "--clicks",
            sample / "clicks.json",
            "--out",
            out,
        ],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(out.read_text())["schema"] == "cocalib/calibration-1"


def test_the_examples_run_from_the_wheel(installed, project_root, tmp_path):
    examples = sorted((project_root / "docs" / "examples").iterdir())
    assert [path.name[:3] for path in examples] == [f"{number:02d}_" for number in range(1, len(examples) + 1)]
    assert max(len(path.read_text(encoding="utf-8").splitlines()) for path in examples) < 40
    code = "import runpy, sys\nfor path in sys.argv[1:]:\n    runpy.run_path(path, run_name='__main__')\n"
    done = subprocess.run(
        [installed / "bin" / "python", "-W", "error", "-c", code, *examples],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        env={name: value for name, value in os.environ.items() if name != "PYTHONPATH"},
    )
    assert done.returncode == 0, done.stderr


_SMALL = "dwell_s=3.5 width_px=480 height_px=300 camera_rate_hz=3 radar_rate_hz=5"
_PLACEHOLDERS = {
    "sample_data/rooftop/": "",
    "RECORDING --map": "tables --map",
    "RECORDING": "drive.mcap",
    "[FOLDER...] [--json]": "--json",
    "SESSION [--yes]": "drive.mcap.cocalib-session --yes",
    "SESSION --out FILE": "drive.mcap.cocalib-session --out session.json",
    "--tree drive.mcap": "--tree driver.yaml",  # drive.mcap has the calibration in its own tree
}
_NOT_RUN = {
    r"show (?!.*--out)": "opens a window; tests/browser/test_rerun_viewer.py runs it",
    r"demo$": "serves until it is ended; another test here runs it",
}
"""Command lines that are left out, and why."""
_DRIVER = """transforms:
- header: {frame_id: camera_link}
  child_frame_id: camera_optical_frame
  transform: {translation: {x: 0.0, y: 0.015, z: 0.0}, rotation: {x: -0.5, y: 0.5, z: -0.5, w: 0.5}}
"""


def board_images(folder: Path, board: Board, count: int) -> None:
    """Write images of a board into a folder, and as a video beside it."""
    folder.mkdir()
    camera = typical_camera("pinhole", width_px=480, height_px=300)
    film = cv2.VideoWriter(str(folder.with_suffix(".mp4")), cv2.VideoWriter.fourcc(*"mp4v"), 5.0, (480, 300))
    for number, pose in enumerate(waved_poses(np.random.default_rng(3), board, camera, count)):
        image = render_board(board, camera, pose, seed=number)
        cv2.imwrite(str(folder / f"left{number:02d}.jpg"), image)
        film.write(image)
    film.release()


def radar_table(recorded: Path) -> str:
    """Return a recorder's table in another one's columns: positions to the right, centimetres, km/h."""
    lines = ["Timestamp;posX;posY;posZ;u16Range;theta;vel"]
    for row in csv.reader(recorded.read_text().splitlines()[1:], delimiter=";"):
        range_m, azimuth_deg, elevation_deg, doppler_mps = (float(value) for value in row[2:6])
        azimuth, elevation = np.radians([azimuth_deg, elevation_deg])
        x, y, z = range_m * np.array(
            [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
        )
        values = x, -y, z, 100 * range_m, -azimuth_deg, 3.6 * doppler_mps
        lines.append(";".join([row[0], *(f"{value:.5f}" for value in values)]))
    return "\n".join(lines)


def run_line(cocalib: Path, folder: Path, line: str) -> tuple[int, str]:
    """Run a page's command line; return its exit code and what it printed. What serves is ended once a page has its view."""
    for words, found in _PLACEHOLDERS.items():
        line = line.replace(words, found)
    serves = line.startswith("cocalib open")
    if serves:
        line += " --no-browser --port 0 --on-problem exit"
    elif line.startswith("cocalib simulate"):
        shutil.rmtree(folder / "somewhere", ignore_errors=True)
        small = _SMALL if "--out ." in line else f"{_SMALL} placements=4"
        line = " ".join([line.replace("board_s=14", "board_s=9"), *(f"--set {each}" for each in small.split())])
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    process = subprocess.Popen(
        [cocalib, *shlex.split(line)[1:]],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=environment | {"XDG_STATE_HOME": str(folder / "state"), "PYTHONUNBUFFERED": "1"},
    )
    assert process.stdout is not None
    printed: list[str] = []
    while serves and (said := process.stdout.readline()):
        printed.append(said)
        if link := re.search(r"http://127\S+", said):
            served = ServedProcess(process, link[0])
            with channel(served, come_in(served)) as socket:
                wanted(socket, "view")
            process.terminate()
            break
    printed.append(process.communicate()[0])
    return process.returncode, "".join(printed)


def prepare(folder: Path, run: Callable[[str], object]) -> None:
    """Make the files that the pages name."""
    run("cocalib simulate --out . --set placements=8")
    run("cocalib simulate --out csv --containers csv --set placements=2")
    run("cocalib solve radar.bag camera.bag --clicks clicks.json --out calibration.json")
    run("cocalib export calibration.json --to mcap --recording radar.bag camera.bag --out drive.mcap")
    for form, file in {"urdf": "robot.urdf", "camera-info": "camera.yaml", "autoware": "kit.yaml"}.items():
        run(f"cocalib export calibration.json --to {form} --out {file}")
    run("cocalib open drive.mcap --clicks clicks.json")
    for name in ("old", "new", "factory", "a", "b"):
        shutil.copy(folder / "calibration.json", folder / f"{name}.json")
    for name in ("other", "first", "today"):
        shutil.copy(folder / "drive.mcap", folder / f"{name}.mcap")
    shutil.move(folder / "csv" / "recording_csv", folder / "tables")
    (folder / "tables" / "radar.csv").write_text(radar_table(folder / "tables" / "radar.csv"))
    kit = (folder / "kit.yaml").read_text().replace("camera_link", "camera0/camera_link")
    (folder / "sensor_kit_calibration.yaml").write_text(kit)
    kit_pose = "base_link: {sensor_kit_base_link: {x: 1.0, y: 0.0, z: 1.5, roll: 0.0, pitch: 0.0, yaw: 0.0}}\n"
    (folder / "sensors_calibration.yaml").write_text(kit_pose)
    (folder / "driver.yaml").write_text(_DRIVER)
    board_images(folder / "board", Board("checkerboard", 9, 6, 0.025), 9)
    (folder / "board").rename(folder / "real_checkerboards")
    board_images(folder / "images", Board("aprilgrid", 6, 6, 0.088, 0.0264, "DICT_APRILTAG_36h11"), 9)
    session = folder / "recordings" / "V017" / "2026-09-21"
    session.mkdir(parents=True)
    for name in ("radar.bag", "camera.bag", "clicks.json"):
        shutil.copy(folder / name, session)
    (folder / "extrinsic.json").write_text('{"T": [[1, 0, 0, 0.1], [0, 1, 0, 0.2], [0, 0, 1, 0.1], [0, 0, 0, 1]]}')
    clicks = json.loads((folder / "clicks.json").read_text())["clicks"]
    frames = [
        {"image_time": click["image_time"], "boxes": [{"label": label, "box_px": [u - 20, v - 20, u + 20, v + 20]}]}
        for label, click in zip(["pedestrian", "car"] * 4, clicks, strict=True)
        for u, v in [click["pixel_px"]]
    ]
    boxes = {"schema": "cocalib/boxes-1", "image_size_px": [480, 300], "frames": frames}
    (folder / "boxes.json").write_text(json.dumps(boxes))


@pytest.mark.timeout(900)
def test_the_command_lines_of_the_pages_run_from_the_wheel(installed, project_root, tmp_path):
    """In an empty folder with small simulated recordings, under the names that the pages give them."""
    pages = [project_root / "README.md", *sorted((project_root / "docs").glob("*.md"))]
    lines = list(dict.fromkeys(line for page in pages for line in command_lines(page)))
    ended: dict[str, tuple[int, str]] = {}

    def run(line: str) -> None:
        ended[line] = run_line(installed / "bin" / "cocalib", tmp_path, line)

    prepare(tmp_path, run)
    run(next(line for line in lines if "--preset intrinsics" in line))
    shutil.move(next((tmp_path / "somewhere").rglob("*.mcap")), tmp_path / "recording.mcap")
    assert {code for code, _ in ended.values()} == {0}, ended
    left_out = [line for line in lines if any(re.match(f"cocalib {pattern}", line) for pattern in _NOT_RUN)]
    assert len(left_out) == 3
    for line in lines:
        if line not in ended and line not in left_out:
            run(line)
    assert [(line, said) for line, said in ended.items() if said[0] not in (0, 1, 3)] == []
    made = "report.html overlay.mp4 lens.html left.yaml meanings.png out/results.csv session.json"
    assert [name for name in made.split() if not (tmp_path / name).is_file()] == []
