"""The wheel can be built, installed into an empty environment and run there."""

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
from pathlib import Path

import pytest

from tests.architecture.test_named_commands import command_lines

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


def test_the_wheel_contains_the_page_the_sample_and_the_code_of_the_pack(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    assert {
        "cocalib/static/index.html",
        "cocalib/static/shell/state.js",
        "cocalib/sample_data/rooftop/radar.bag",
        "cocalib/sample_data/rooftop/camera.bag",
    } <= names
    assert "calib_core/interchange/published/calibration-1.schema.json" in names
    delivered = "calib_core/interchange/formats/delivered"
    assert {f"{delivered}/{name}" for name in ("selftest.cpp", "selftest.py", "radar_correction.hpp")} <= names
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
        for part in ("main.js", "shell/state.js", "space/pace.js"):
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
    command = [installed / "bin" / "cocalib", "export", out, "--to", "pack", "--out", tmp_path / "pack"]
    assert subprocess.run(command, cwd=tmp_path, capture_output=True).returncode == 0
    assert subprocess.run([sys.executable, "-I", "-S", tmp_path / "pack" / "selftest.py"]).returncode == 0


_READ = re.compile(r"(?<!-out )(?<!-report )(?<!--sheet )(?<![\w/'])[\w/]+\.(?:bag|json|mcap|mp4|urdf|yaml)\b")
"""The files that a command line reads."""


@pytest.mark.timeout(900)  # 28 command lines, three of them whole films
def test_the_command_lines_of_the_pages_run_from_the_wheel(installed, project_root, tmp_path):
    """In an empty folder with the sample's files, called as the pages call them; windows are left out."""
    for name in ("radar.bag", "camera.bag", "clicks.json"):
        shutil.copy(project_root / "sample_data" / "rooftop" / name, tmp_path)
    clicks = json.loads((tmp_path / "clicks.json").read_text())["clicks"]
    frames = [
        {"image_time": click["image_time"], "boxes": [{"label": label, "box_px": [u - 20, v - 20, u + 20, v + 20]}]}
        for label, click in zip(["pedestrian", "car"] * 10, clicks, strict=True)
        for u, v in [click["pixel_px"]]
    ]
    boxes = {"schema": "cocalib/boxes-1", "image_size_px": [960, 600], "frames": frames}
    (tmp_path / "boxes.json").write_text(json.dumps(boxes))

    def run(line: str) -> int:
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        done = subprocess.run(
            [installed / "bin" / "cocalib", *shlex.split(line)[1:]],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            env=environment | {"XDG_STATE_HOME": str(tmp_path / "state")},
        )
        assert done.returncode in (0, 1, 3), f"{line}: {done.stderr}"
        return done.returncode

    assert run("cocalib solve radar.bag camera.bag --clicks clicks.json --out calibration.json") == 0
    assert run("cocalib export calibration.json --to mcap --recording radar.bag camera.bag --out drive.mcap") == 0
    assert run("cocalib export calibration.json --to urdf --out robot.urdf") == 0
    assert run("cocalib export calibration.json --to camera-info --out camera.yaml") == 0
    for name in ("old", "new", "factory", "march", "july", "a", "b"):
        shutil.copy(tmp_path / "calibration.json", tmp_path / f"{name}.json")
    for name in ("other", "recording"):
        shutil.copy(tmp_path / "drive.mcap", tmp_path / f"{name}.mcap")
    names = ("tour", "report", "drift", "evaluation", "rerun", "formats", "intrinsics")
    pages = [project_root / "README.md", *(project_root / "docs" / f"{name}.md" for name in names)]
    lines = dict.fromkeys(line for page in pages for line in command_lines(page))
    shown = [
        line
        for line in lines
        if line.split()[1] not in ("demo", "open")
        and not ("show" in line and "--out" not in line)
        and "--tree" not in line  # drive.mcap has the pose in its own tree
        and (files := _READ.findall(line))
        and all((tmp_path / file).exists() for file in files)
    ]
    assert len(shown) > 25
    for line in shown:
        run(line)
    assert (tmp_path / "report.html").is_file()
    assert (tmp_path / "overlay.mp4").is_file()
