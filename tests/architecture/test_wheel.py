"""The wheel can be built, installed into an empty environment and run there, and what is released with it is whole.

With `COCALIB_DIST=FOLDER` (`make dist`), what lies in that folder is tested, in an environment with the pinned dependencies only.
"""

import csv
import email.policy
import json
import os
import re
import runpy
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import zipfile
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from markdown_it import MarkdownIt

from benchmarks.boards import render_board
from calib_core.interchange.formats.registry import CAMERA_ONLY, FORMATS
from calib_core.intrinsics.board import Board
from calib_core.synthetic.boards import waved_poses
from calib_core.synthetic.rig import typical_camera
from tests.architecture.test_named_commands import command_lines
from tests.port_client import channel, come_in, wanted
from tests.served_process import ServedProcess

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]  # installing takes minutes on a busy machine


_DIST = os.environ.get("COCALIB_DIST")


def build(project: Path, folder: Path, *options: str) -> None:
    """Build with the pinned build backend, without network access."""
    command = [sys.executable, "-m", "hatchling", "build", "-d", str(folder), *options]
    subprocess.run(command, cwd=project, check=True, capture_output=True, text=True)


@pytest.fixture(scope="module")
def dist(project_root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder with wheel and sdist."""
    if _DIST:
        return project_root / _DIST
    folder = tmp_path_factory.mktemp("dist")
    build(project_root, folder)
    return folder


@pytest.fixture(scope="module")
def wheel(dist: Path) -> Path:
    """Return the wheel."""
    (built,) = dist.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def installed(wheel: Path, project_root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Install the wheel into an empty environment; return its folder.

    Its dependencies are the pinned ones for a release, else those of this environment: a .pth file makes them visible, so that
    the test needs no network and the checkout is not on the path.
    """
    folder = tmp_path_factory.mktemp("environment")
    subprocess.run([sys.executable, "-m", "venv", *([] if _DIST else ["--without-pip"]), str(folder)], check=True)
    python = folder / "bin" / "python"
    if _DIST:
        install = ["sh", ".ci/install", "requirements/runtime.txt"]
        subprocess.run(install, cwd=project_root, check=True, env={**os.environ, "VENV": str(folder)})
    else:
        ask = "import sysconfig; print(sysconfig.get_path('purelib'))"
        site = subprocess.run([python, "-c", ask], check=True, capture_output=True, text=True).stdout.strip()
        (Path(site) / "zz_borrowed.pth").write_text(sysconfig.get_path("purelib") + "\n")
    pip = [sys.executable, "-m", "pip", "--python", str(python), "--disable-pip-version-check"]
    subprocess.run([*pip, "install", "--quiet", "--no-index", "--no-deps", str(wheel)], check=True)
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


def test_the_sdist_builds_the_same_wheel(dist, wheel, tmp_path):
    (sdist,) = dist.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        archive.extractall(tmp_path, filter="data")
    (source,) = tmp_path.iterdir()
    assert {path.name for path in source.iterdir()} == {
        *(
            "app",
            "calib_core",
            "static",
            "sample_data",
            "docs",
            "hatch_build.py",
            "pyproject.toml",
            "PKG-INFO",
            ".gitignore",
        ),
        *("LICENSE", "README.md", "CHANGELOG.md", "CITATION.cff"),
    }
    build(source, tmp_path / "again", "-t", "wheel")
    (again,) = (tmp_path / "again").glob("*.whl")
    sums = [{info.filename: info.CRC for info in zipfile.ZipFile(path).infolist()} for path in (wheel, again)]
    assert sums[0] == sums[1]


def test_the_metadata_describe_the_release(wheel, project_root):
    with zipfile.ZipFile(wheel) as archive:
        (name,) = [name for name in archive.namelist() if name.endswith(".dist-info/METADATA")]
        metadata = email.message_from_bytes(archive.read(name), policy=email.policy.default)
    version = metadata["Version"]
    assert (metadata["Name"], metadata["License-Expression"]) == ("cocalib", "Apache-2.0")
    assert metadata["Description-Content-Type"] == "text/markdown"
    page = MarkdownIt().enable("table").render(metadata.get_payload())
    assert re.findall(r"<h[12]>(.*?)</h[12]>", page)[:2] == ["cocalib", "What you need"]
    assert all(address.startswith("https://") for address in re.findall(r'(?:href|src)="([^"]*)"', page))
    heading = re.search(r"^## (.*)", (project_root / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert heading is not None
    assert re.fullmatch(rf"{re.escape(version)} - (\d{{4}}-\d\d-\d\d|unreleased)", heading[1])
    assert f"\nversion: {version}\n" in (project_root / "CITATION.cff").read_text(encoding="utf-8")


def test_links_of_the_description_lead_below_the_projects_address(project_root):
    described = runpy.run_path(str(project_root / "hatch_build.py"))["described"]
    text = "![a](docs/a.png) [b](docs/b.md) [c](https://c.example)"
    assert described(text, None) == " b [c](https://c.example)"
    at = "https://example.org/cocalib"
    assert described(text, at) == f"![a]({at}/raw/HEAD/docs/a.png) [b]({at}/raw/HEAD/docs/b.md) [c](https://c.example)"


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


def test_the_installed_command_answers_on_its_page_and_solves_its_sample_and_pairs(installed, project_root, tmp_path):
    done = subprocess.run(
        [installed / "bin" / "python", project_root / ".ci" / "smoke"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        env={name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        | {"XDG_STATE_HOME": str(tmp_path / "state")},
    )
    assert done.returncode == 0, done.stderr
    assert str(installed) in done.stdout, "found in the checkout, not in the wheel"


def test_every_format_is_exported_from_the_wheel(installed, project_root, tmp_path):
    cocalib, sample = installed / "bin" / "cocalib", project_root / "sample_data" / "rooftop"
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}

    def run(*arguments: object) -> None:
        subprocess.run([cocalib, *arguments], cwd=tmp_path, check=True, capture_output=True, env=environment)

    run(
        "solve",
        sample / "radar.bag",
        sample / "camera.bag",
        "--clicks",
        sample / "clicks.json",
        "--out",
        "calibration.json",
    )
    run("export", "calibration.json", "--to", "all", "--out", "files")
    written = {path.name for path in (tmp_path / "files").iterdir()}
    assert {known.file_name for known in (*FORMATS, *CAMERA_ONLY)} <= written


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
    r"show (?!.*--out)": "opens a window",
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
    manifest = {"vehicle": "V017", "session": "2026-09-21"}
    manifest |= {"recording": "recordings/V017/2026-09-21", "clicks": "recordings/V017/2026-09-21/clicks.json"}
    rows = "".join(f'{name} = "{value}"\n' for name, value in manifest.items())
    (folder / "sessions.toml").write_text(f"[[session]]\n{rows}")
    (folder / "extrinsic.json").write_text('{"T": [[1, 0, 0, 0.1], [0, 1, 0, 0.2], [0, 0, 1, 0.1], [0, 0, 0, 1]]}')
    clicks = json.loads((folder / "clicks.json").read_text())["clicks"]
    frames = [
        {"image_time": click["image_time"], "boxes": [{"label": label, "box_px": [u - 20, v - 20, u + 20, v + 20]}]}
        for label, click in zip(["pedestrian", "car"] * 4, clicks, strict=True)
        for u, v in [click["pixel_px"]]
    ]
    boxes = {"schema": "cocalib/boxes-1", "image_size_px": [480, 300], "frames": frames}
    (folder / "boxes.json").write_text(json.dumps(boxes))


def test_the_command_lines_of_the_pages_run_from_the_wheel(installed, project_root, tmp_path):
    """In an empty folder with small simulated recordings, under the names that the pages give them."""
    others = [] if _DIST else sorted((project_root / "docs").glob("*.md"))  # they need the extras
    pages = [project_root / "README.md", *others]
    lines = list(dict.fromkeys(line for page in pages for line in command_lines(page)))
    ended: dict[str, tuple[int, str]] = {}

    def run(line: str) -> None:
        ended[line] = run_line(installed / "bin" / "cocalib", tmp_path, line)

    prepare(tmp_path, run)
    for line in (line for line in lines if "--preset intrinsics" in line):
        run(line)
        shutil.move(next((tmp_path / "somewhere").rglob("*.mcap")), tmp_path / "recording.mcap")
    assert {code for code, _ in ended.values()} == {0}, ended
    left_out = [line for line in lines if any(re.match(f"cocalib {pattern}", line) for pattern in _NOT_RUN)]
    assert len(left_out) == (1 if _DIST else 3)
    for line in lines:
        if line not in ended and line not in left_out:
            run(line)
    assert [(line, said) for line, said in ended.items() if said[0] not in (0, 1, 3)] == []
    made = "" if _DIST else "report.html overlay.mp4 lens.html left.yaml out/results.csv session.json"
    assert [name for name in made.split() if not (tmp_path / name).is_file()] == []
