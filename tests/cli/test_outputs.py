"""What the outputs of every command may be written over, and what is left where the disk is full."""

import dataclasses
import json
import os
import resource
import shlex
import shutil
import stat
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

from cocalib.cli import run
from cocalib.cli.commands import COMMANDS
from cocalib.cli.flags import OUTPUT, OUTPUT_FOLDER
from cocalib.platform import files
from tests.cli.test_session import FACTS
from tests.cli.test_simulate import TINY
from tests.unit.app.session.drive import kept, place

pytestmark = pytest.mark.skipif(os.name == "nt", reason="links, pipes and devices of POSIX")

_BOARD = "intrinsics board --board 6x4 --square-mm 25"
_OUTPUTS = {
    "solve.out": ("solve made.mcap --clicks clicks.json --out {}", ".json", "clicks.json"),
    "solve.clicks_out": ("solve made.mcap --auto --clicks-out {}", ".json", "made.mcap/made.mcap.mcap"),
    "solve.out, proposals": ("solve made.mcap --propose --out {}", ".json", "made.mcap/made.mcap.mcap"),
    "solve.out, pairs": ("solve --pairs calibration.json --out {}", ".json", "calibration.json"),
    "evaluate.report": ("evaluate calibration.json --report {}", ".html", "calibration.json"),
    "batch.csv": ("batch status results --csv {}", ".csv", "results/manifests/m.toml.json"),
    "check.junit": ("check calibration.json --junit {}", ".xml", "calibration.json"),
    "export.out": ("export calibration.json --to urdf --out {}", ".urdf", "calibration.json"),
    "export.out, into": ("export calibration.json --into car.urdf --out {}", ".urdf", "car.urdf"),
    "export.out, maps": ("export calibration.json --to kitti --out {}", ".txt", "calibration.json"),
    "export.out, mcap": (
        "export calibration.json --to mcap --recording made.mcap --out {}",
        ".mcap",
        "made.mcap/made.mcap.mcap",
    ),
    "watch.update": ("watch calibration.json made.mcap --update {}", ".json", "calibration.json"),
    "import.out": ("import pose.urdf --camera camera.yaml --out {}", ".json", "camera.yaml"),
    "intrinsics.out": ("intrinsics camera.yaml --to kalibr --out {}", ".yaml", "camera.yaml"),
    "intrinsics.out, board": (f"{_BOARD} --out {{}}", ".yaml", "board/a.png"),
    "intrinsics.report": (f"{_BOARD} --report {{}}", ".html", "board/a.png"),
    "session.out": ("session export drive.cocalib-session --out {}", ".json", "drive.cocalib-session/journal.jsonl"),
    "show.out": ("show made.mcap --out {}", ".mp4", "made.mcap/made.mcap.mcap"),
    "show.out, overlay": ("show made.mcap --calibration calibration.json --out {}", ".mkv", "calibration.json"),
    "show.out, rrd": ("show made.mcap --calibration calibration.json --out {}", ".rrd", "calibration.json"),
}
"""A command for each output: how it is typed, the suffix, and a file that it reads."""
_FOLDERS = {"batch.out", "simulate.out", "export.out"}
_UNSOLVED = {
    *("solve.clicks_out", "solve.out, proposals", "watch.update"),
    *("intrinsics.out, board", "intrinsics.report"),
}
"""Nothing comes of grey images that could be written; what may be written is told before."""
_STREAMED = {"export.out, maps", "export.out, mcap", "show.out", "show.out, overlay", "show.out, rrd"}
_EXTRA = {"show.out": "av", "show.out, overlay": "av", "show.out, rrd": "rerun"}


@pytest.fixture(scope="module")
def files_of_commands(solved_folder: Path, project_root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files that the commands read."""
    folder = tmp_path_factory.mktemp("read") / "read"
    shutil.copytree(solved_folder, folder)
    (folder / "board").mkdir()
    cv2.imwrite(str(folder / "board" / "a.png"), np.full((240, 320), 90, np.uint8))
    calibration = str(folder / "calibration.json")
    pose = json.loads(Path(calibration).read_text())["camera_from_radar"]
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([pose["rotation"], pose["translation_m"]])
    np.savetxt(folder / "pose.txt", matrix)
    for name, form in (("pose.urdf", "urdf"), ("camera.yaml", "camera-info")):
        assert run(["export", calibration, "--to", form, "--out", str(folder / name)]) == 0
    car = (folder / "pose.urdf").read_text()
    (folder / "car.urdf").write_text(car[car.index("<robot") :])
    (folder / "results" / "manifests").mkdir(parents=True)
    session = {"vehicle": "a", "session": "b", "digest": "0" * 64}
    plan = {"schema": "cocalib/batch-plan-1", "started": "2026-01-01T00:00:00Z", "sessions": [session]}
    (folder / "results" / "manifests" / "m.toml.json").write_text(json.dumps(plan))
    kept(folder / "drive.cocalib-session", *(place(frame, FACTS) for frame in range(4)), facts=FACTS)
    return folder


@pytest.fixture
def here(files_of_commands: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with copies of those files, in which the commands are typed."""
    folder = Path(shutil.copytree(files_of_commands, tmp_path / "here"))
    monkeypatch.chdir(folder)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(files, "_PATIENCE_S", 0.0)
    return folder


def states(folder: Path) -> Mapping[str, object]:
    """Return what is in a folder: of each name what it leads to, or its content."""
    found: dict[str, object] = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        mode = path.lstat().st_mode
        found[name] = path.readlink() if path.is_symlink() else path.read_bytes() if stat.S_ISREG(mode) else mode
    return found


def typed(cocalib: Callable, output: str, out: Path | str, *more: str):
    for extra in filter(None, [_EXTRA.get(output)]):
        pytest.importorskip(extra, reason="an extra that is not installed")
    return cocalib(*shlex.split(_OUTPUTS[output][0].format(out)), *more)


_IN_THE_WAY: Mapping[str, Callable[[Path, Path], object]] = {
    "hard link to an input": lambda out, read: out.hardlink_to(read),
    "link to an input": lambda out, read: out.symlink_to(read.absolute()),
    "link to a link to an input": lambda out, read: (
        out.with_name("between").symlink_to(read.absolute()),
        out.symlink_to("between"),
    ),
    "foreign text": lambda out, _read: out.write_text("mine, and cocalib is only mentioned\n"),
    "foreign bytes": lambda out, _read: out.write_bytes(bytes(range(256)) * 400),
    "link to a foreign file": lambda out, _read: (
        out.with_name("foreign").write_text("mine"),
        out.symlink_to("foreign"),
    ),
    "dangling link": lambda out, _read: out.symlink_to("absent"),
    "link to itself": lambda out, _read: out.symlink_to(out.name),
    "pipe that nobody reads": lambda out, _read: os.mkfifo(out),
    "full device": lambda out, _read: out.symlink_to("/dev/full"),
}


_EVERY_KIND = ("solve.out", "export.out, maps", "export.out, mcap")
"""An output of each way of writing: a text, files that belong together, a stream. With these everything in the way is tried
quickly, with the others a file of each rule."""
_EVERY_OUTPUT = ("hard link to an input", "foreign text")


def _cases() -> Iterator[Any]:
    for output, in_the_way in product(_OUTPUTS, _IN_THE_WAY):
        quick = output in _EVERY_KIND or in_the_way in _EVERY_OUTPUT
        yield pytest.param(output, in_the_way, marks=() if quick else pytest.mark.slow)


@pytest.mark.parametrize(("output", "in_the_way"), list(_cases()))
def test_nothing_else_is_written_over(output, in_the_way, here, cocalib):
    if output in _UNSOLVED and in_the_way in ("pipe that nobody reads", "full device"):
        pytest.skip("nothing is written")
    _, suffix, read = _OUTPUTS[output]
    out = here / f"out{suffix}"
    _IN_THE_WAY[in_the_way](out, here / read)
    before = states(here)
    answer = typed(cocalib, output, out.name)
    assert answer.code == 2, answer.out + answer.err
    assert out.name in answer.err or output == "session.out"  # a journal with two names is not even read
    assert states(here) == before


@pytest.mark.parametrize("force", [(), ("--force",)], ids=["", "force"])
@pytest.mark.parametrize("output", _OUTPUTS)
def test_an_input_is_never_written_over(output, force, here, cocalib):
    read = _OUTPUTS[output][2]
    before = states(here)
    answer = typed(cocalib, output, read, *force)
    assert answer.code == 2, answer.out + answer.err
    assert states(here) == before


@pytest.mark.parametrize("output", [output for output in _OUTPUTS if output.split(",")[0] not in _FOLDERS])
def test_a_folder_is_not_a_file(output, here, cocalib):
    out = here / f"folder{_OUTPUTS[output][1]}"
    out.mkdir()
    assert typed(cocalib, output, out.name).code == 2
    assert list(out.iterdir()) == []


@pytest.mark.parametrize("output", [output for output in _OUTPUTS if output not in _UNSOLVED])
def test_a_foreign_file_is_replaced_with_force_and_an_own_one_without(output, here, cocalib):
    out = here / f"out{_OUTPUTS[output][1]}"
    out.write_bytes(b"mine" * 10_000)
    refused, forced, again = (typed(cocalib, output, out.name, *more).code for more in ((), ("--force",), ()))
    assert refused == 2
    assert forced in (0, 3)
    assert again == (2 if output == "export.out, into" else forced), "a changed copy of another's file is not ours"
    assert not out.read_bytes().startswith(b"mine")
    assert not list(here.glob(".*"))


@pytest.mark.parametrize(
    "output",
    [
        pytest.param(output, marks=() if output in {*_EVERY_KIND, *_STREAMED} else pytest.mark.slow)
        for output in _OUTPUTS
        if output not in _UNSOLVED
    ],
)
def test_a_device_is_written_to_and_never_replaced(output, here, cocalib):
    out = here / f"null{_OUTPUTS[output][1]}"
    out.symlink_to("/dev/null")
    answer = typed(cocalib, output, out.name, "--force")
    assert (answer.code == 2) == (output in _STREAMED), answer.err
    assert stat.S_ISCHR(Path("/dev/null").stat().st_mode)
    assert out.is_symlink()


@contextmanager
def _full_after(size_bytes: int) -> Iterator[None]:
    """Let no file grow beyond a size, as a full disk would not."""
    before, bytecode = resource.getrlimit(resource.RLIMIT_FSIZE), sys.dont_write_bytecode
    sys.dont_write_bytecode = True  # Python 3.11 would keep what it could write of it
    resource.setrlimit(resource.RLIMIT_FSIZE, (size_bytes, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        sys.dont_write_bytecode = bytecode


@pytest.mark.parametrize("output", [output for output in _OUTPUTS if output not in _UNSOLVED])
def test_a_full_disk_ends_a_command_and_leaves_the_old_file(output, here, cocalib):
    out = here / f"out{_OUTPUTS[output][1]}"
    before = states(here)
    with _full_after(100):
        answer = typed(cocalib, output, out.name)
    assert answer.code == 2, answer.out + answer.err
    assert out.name in answer.err
    assert states(here) == before


@pytest.mark.slow
@pytest.mark.parametrize("container", ["ros1", "mcap", "db3", "csv"])
def test_a_simulation_on_a_full_disk_leaves_nothing(container, cocalib, tmp_path):
    out = tmp_path / "new" / "made"
    with _full_after(1000):
        answer = cocalib("simulate", "--out", out, "--containers", container, *TINY)
    assert answer.code == 2, answer.err
    assert str(out) in answer.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", ["simulate", "mcap"])
def test_what_needs_more_room_than_there_is_does_not_begin(command, here, cocalib, monkeypatch):
    monkeypatch.setattr(shutil, "disk_usage", lambda _path: SimpleNamespace(free=1000))
    before = states(here)
    answer = (
        typed(cocalib, "export.out, mcap", "out.mcap")
        if command == "mcap"
        else cocalib("simulate", "--out", "o", *TINY)
    )
    assert answer.code == 2, answer.out + answer.err
    assert states(here) == before


@pytest.mark.parametrize("force", [(), ("--force",)], ids=["", "force"])
def test_what_a_folder_is_read_from_is_not_written_over(force, here, cocalib):
    """Neither the film in it, nor by another name, nor what stands beside it."""
    pytest.importorskip("av", reason="the extra 'video' is not installed")
    folder = here / "drive"
    folder.mkdir()
    assert cocalib("show", "made.mcap", "--out", "drive/camera.mp4").code == 0
    (folder / "radar.csv").write_text("time,x,y,z\n" + "".join(f"17000000{10 + n}.0,5,0,0\n" for n in range(9)))
    (here / "other.mp4").hardlink_to(folder / "camera.mp4")
    (folder / "notes.mp4").write_text("mine")
    before = states(here)
    for out in ("drive/camera.mp4", "other.mp4", "drive/notes.mp4"):
        answer = cocalib("show", "drive", "--video-start", "1700000000", "--out", out, *force)
        assert answer.code == 2, answer.out + answer.err
        assert states(here) == before


def test_a_recording_file_is_written_into_nothing_that_stands_there(here, cocalib):
    (here / "recording.toml").symlink_to(here / "absent.txt")
    before = states(here)
    answer = cocalib("info", "made.mcap", "--write")
    assert answer.code == 2, answer.out + answer.err
    assert states(here) == before


@pytest.mark.parametrize("stands", ["file", "dangling", "folder with a file"])
def test_a_simulation_is_written_into_a_new_or_empty_folder(stands, here, cocalib):
    out = here / "out"
    if stands == "file":
        out.write_text("mine")
    elif stands == "dangling":
        out.symlink_to("absent")
    else:
        out.mkdir()
        (out / "notes").write_text("mine")
    before = states(here)
    assert cocalib("simulate", "--out", "out", *TINY).code == 2
    assert states(here) == before


@pytest.mark.slow
def test_of_files_that_belong_together_none_is_written_if_one_may_not_be(here, cocalib):
    (here / "all").mkdir()
    (here / "all" / "rectification.npz").write_text("mine")
    before = states(here)
    for command in ("--to all --out all", "--to kitti --out all/calib.txt"):
        assert cocalib("export", "calibration.json", *command.split()).code == 2
        assert states(here) == before
    assert cocalib("export", "calibration.json", "--to", "all", "--out", "all", "--force").code == 0
    assert cocalib("export", "calibration.json", "--to", "all", "--out", "all").code == 0


def test_of_files_that_belong_together_none_is_written_if_one_cannot_be(here, cocalib):
    before = states(here)
    with _full_after(5_000):
        assert cocalib("export", "calibration.json", "--to", "kitti", "--out", "calib.txt").code == 2
    assert states(here) == before


def test_one_name_is_not_for_two_outputs(here, cocalib):
    before = states(here)
    assert cocalib("evaluate", "calibration.json", "--report", "o.html", "--report", "./o.html").code == 2
    assert states(here) == before


def _marked(kind: type) -> Iterator[str]:
    for flag in dataclasses.fields(kind):
        marks = getattr(flag.type, "__metadata__", ())
        inner = getattr(flag.type, "__origin__", None)
        if dataclasses.is_dataclass(inner):
            yield from _marked(inner)
        if {OUTPUT, OUTPUT_FOLDER} & {mark for mark in marks if isinstance(mark, str)}:
            yield flag.name


def test_the_table_has_every_output():
    marked = {f"{name}.{flag}" for name, command in COMMANDS.items() for flag in _marked(command.load())}
    assert marked == {output.split(",")[0] for output in _OUTPUTS} | _FOLDERS
