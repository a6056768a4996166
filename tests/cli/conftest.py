"""Small recordings, either good or wrong in exactly one way."""

import importlib
import json
import shutil
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.measurements import NS_PER_S, TimeNs, time_parts
from calib_core.recordings.containers.writing import (
    CameraInfoMessage,
    CloudMessage,
    CompressedImageMessage,
    RecordedMessage,
    write_ros2,
)
from cocalib.cli import run

START = TimeNs(1_700_000_000 * NS_PER_S)
DWELL_S = 4
FRAME_TIMES_S = 0.5
SCAN_TIMES_S = 0.1
CAMERA = Camera(
    "plumb_bob",
    320,
    240,
    np.array([[260.0, 0, 160], [0, 260, 120], [0, 0, 1]]),
    np.array([-0.1, 0.02, 0.001, -0.001]),
)
CAMERA_FROM_RADAR = RigidTransform(
    rotation_exp(np.array([0.02, -0.03, 0.01])) @ np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]]),
    np.array([0.05, -0.06, 0.02]),
)


@dataclass(frozen=True)
class Made:
    """A recording to make: eight placements by default, four seconds each."""

    camera: Camera = CAMERA
    camera_from_radar: RigidTransform = CAMERA_FROM_RADAR
    placements: int = 8
    with_camera_info: bool = True
    with_images: bool = True
    with_radar: bool = True
    nan_scans: int = 0
    with_speeds: bool = True
    reflector_m: float = 0.0
    """Width of the reflector in the images; 0 leaves them grey."""

    @property
    def positions_radar_m(self) -> np.ndarray:
        """Reflector positions: spread over the view, some of them raised."""
        rng = np.random.default_rng(5)
        n = self.placements
        x = np.linspace(3.0, 11.0, n)
        y = x * np.linspace(-0.4, 0.4, n)[rng.permutation(n)]
        return np.stack([x, y, np.where(np.arange(n) % 2, -1.0, 0.4)], axis=1)

    def clicks(self) -> str:
        """Return the clicks as JSON: each placement's pixel in the frame at the middle of its dwell."""
        pixels = self.camera.project(self.camera_from_radar @ self.positions_radar_m)
        clicks = []
        for index, (u, v) in enumerate(pixels):
            sec, nanosec = time_parts(TimeNs(START + int((index * DWELL_S + DWELL_S / 2) * NS_PER_S)))
            clicks.append({"id": f"c{index}", "image_time": {"sec": sec, "nanosec": nanosec}, "pixel_px": [u, v]})
        return json.dumps({"schema": "cocalib/clicks-1", "clicks": clicks})

    def image(self, index: int) -> np.ndarray:
        """Return what the camera sees during a placement: a grey wall, and the reflector's three sheets if there is one."""
        height, width, finer = self.camera.height_px, self.camera.width_px, 8
        image = np.full((height * finer, width * finer, 3), 90, np.uint8)
        position = self.camera_from_radar @ self.positions_radar_m[index]
        apex_px = (self.camera.project(position[None])[0] + 0.5) * finer - 0.5
        radius_px = 0.5 * self.reflector_m * self.camera.matrix_px[0, 0] / position[2] * finer
        corners = apex_px + radius_px * np.array([[np.sin(a), np.cos(a)] for a in np.radians([0, 120, 240])])
        for grey, ends in ((200, (0, 1)), (140, (1, 2)), (40, (2, 0))) if self.reflector_m else ():
            sheet = np.array([apex_px, *corners[list(ends)]]).round().astype(np.int32)
            cv2.fillPoly(image, [sheet], (grey, grey, grey))
        return np.asarray(cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA))

    def messages(self) -> Iterator[RecordedMessage]:
        """Yield the messages in order of time."""
        jpegs = [cv2.imencode(".jpg", self.image(index))[1].tobytes() for index in range(self.placements)]
        made: list[RecordedMessage] = []
        for k in range(int(self.placements * DWELL_S / FRAME_TIMES_S) + 1):
            time = TimeNs(START + int(k * FRAME_TIMES_S * NS_PER_S))
            if self.with_images:
                jpeg = jpegs[min(int(k * FRAME_TIMES_S / DWELL_S), self.placements - 1)]
                image = CompressedImageMessage(time, "cam", jpeg)
                made.append(RecordedMessage("/camera/image/compressed", time, image))
            if self.with_camera_info:
                made.append(RecordedMessage("/camera/camera_info", time, CameraInfoMessage(time, "cam", self.camera)))
        rng = np.random.default_rng(7)
        for k in range(int(self.placements * DWELL_S / SCAN_TIMES_S)) if self.with_radar else ():
            time = TimeNs(START + int(k * SCAN_TIMES_S * NS_PER_S))
            index = int(k * SCAN_TIMES_S / DWELL_S)
            points = self.positions_radar_m[[index]] + rng.normal(0, 0.003, (1, 3))
            values = np.concatenate([points, [[0.0, 20.0]]], axis=1)
            if k % 7 < self.nan_scans:
                values[:, 0] = np.nan
            names = ("x", "y", "z", "velocity", "snr") if self.with_speeds else ("x", "y", "z", "snr")
            values = values if self.with_speeds else np.delete(values, 3, axis=1)
            made.append(RecordedMessage("/radar/points", time, CloudMessage(time, "radar", names, values)))
        return iter(sorted(made, key=lambda message: message.receive_time))


@dataclass(frozen=True)
class Typed:
    """A command's exit code and output."""

    code: int
    out: str
    err: str


@pytest.fixture(scope="package", autouse=True)
def parsers_are_kept() -> Iterator[None]:
    """Let tyro describe each command's options once, as in a process of its own, and not for each command line again."""
    kind = getattr(importlib.import_module("tyro._parsers"), "ParserSpecification", None)
    made = getattr(kind, "from_callable_or_type", None)  # where a new tyro lacks it, commands take longer here
    kept: dict[object, object] = {}

    def kept_or_made(command: object, **context: Any) -> object:
        if context.get("intern_prefix"):  # a group of options within a command
            return made(command, **context)
        if command not in kept:
            kept[command] = made(command, **context)
        return kept[command]

    patch = pytest.MonkeyPatch()
    if made is not None:
        patch.setattr(kind, "from_callable_or_type", staticmethod(kept_or_made))
    yield
    patch.undo()


@pytest.fixture
def cocalib(capsys: pytest.CaptureFixture[str]) -> Callable[..., Typed]:
    """Return a function that runs the command and returns its exit code and output."""

    def typed(*arguments: object) -> Typed:
        capsys.readouterr()
        try:
            code = run([str(argument) for argument in arguments])
        except SystemExit as left:
            code = int(left.code or 0)
        captured = capsys.readouterr()
        return Typed(code, captured.out, captured.err)

    return typed


@pytest.fixture(scope="session")
def sample(project_root: Path) -> Path:
    return project_root / "sample_data" / "rooftop"


@pytest.fixture(scope="session")
def bags(sample: Path) -> tuple[Path, Path]:
    return sample / "camera.bag", sample / "radar.bag"


@pytest.fixture(scope="session")
def golden(project_root: Path) -> Path:
    return project_root / "tests" / "golden" / "calibration-1.json"


@pytest.fixture(scope="session")
def solved_sample(sample: Path, bags: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the calibration of the sample's own clicks."""
    out = tmp_path_factory.mktemp("sample") / "calibration.json"
    assert run(["solve", *map(str, bags), "--clicks", str(sample / "clicks.json"), "--out", str(out)]) == 0
    return out


@pytest.fixture(scope="session")
def solved_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a recording, its clicks, and the calibration that they give; tests get copies."""
    folder = tmp_path_factory.mktemp("solved")
    recording, clicks = write_ros2(folder / "made.mcap", Made().messages(), container="mcap"), folder / "clicks.json"
    clicks.write_text(Made().clicks())
    assert run(["solve", str(recording), "--clicks", str(clicks), "--out", str(folder / "calibration.json")]) == 0
    return folder


@pytest.fixture
def made(tmp_path: Path, solved_folder: Path) -> Callable[..., Path]:
    """Return a function that writes a recording with the given changes and returns its path."""

    def write(name: str = "made", **changes: object) -> Path:
        if name == "made" and not changes:
            return shutil.copytree(solved_folder / "made.mcap", tmp_path / "made.mcap") / "made.mcap.mcap"
        return write_ros2(tmp_path / f"{name}.mcap", replace(Made(), **changes).messages(), container="mcap")

    return write


@pytest.fixture
def solved(made: Callable[..., Path], solved_folder: Path, clicks_file: Path) -> Path:
    """Return the calibration solved from a recording, which is beside it as made.mcap, and its clicks."""
    made()
    return Path(shutil.copyfile(solved_folder / "calibration.json", clicks_file.with_name("calibration.json")))


@pytest.fixture
def clicks_file(tmp_path: Path) -> Path:
    """Return a file of clicks for the recordings of `made`."""
    path = tmp_path / "clicks.json"
    path.write_text(Made().clicks())
    return path


def pairs_text(camera: Camera, pairs: Iterable[tuple[str, np.ndarray, np.ndarray]]) -> str:
    """Return a file of pairs: the name, the radar position and the pixel of each."""
    described = {"model": camera.model, "width_px": camera.width_px, "height_px": camera.height_px}
    arrays = {"matrix_px": camera.matrix_px.tolist(), "distortion": camera.distortion.tolist()}
    rows = [{"id": name, "radar_m": list(point), "pixel_px": list(pixel)} for name, point, pixel in pairs]
    return json.dumps({"schema": "cocalib/pairs-1", "camera": described | arrays, "pairs": rows})


@pytest.fixture
def pairs_file(tmp_path: Path) -> Path:
    """Return a file of eight exact pairs."""
    positions = Made().positions_radar_m
    pixels = Made().camera.project(Made().camera_from_radar @ positions)
    names = [f"p{index}" for index in range(len(positions))]
    path = tmp_path / "pairs.json"
    path.write_text(pairs_text(Made().camera, zip(names, positions, pixels, strict=True)))
    return path
