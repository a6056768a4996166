"""Calibrations of every kind, their packs unpacked, and the pack's own programs, compiled once."""

import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from calib_core.interchange import CalibrationFile, export, read_calibration
from calib_core.interchange.syntax.zip_archives import unpack
from calib_core.radar import AngleMap, RadarErrors
from calib_core.synthetic import typical_camera

ERRORS = RadarErrors(0.02, -0.03, 0.12, 0.6)


@dataclass(frozen=True)
class Run:
    """A program's exit code and what it printed."""

    code: int
    out: str


@pytest.fixture(scope="session")
def golden(golden_text: str) -> CalibrationFile:
    return read_calibration(golden_text)


@pytest.fixture(scope="session")
def angle_map() -> AngleMap:
    add = np.deg2rad(np.random.default_rng(2).uniform(-2, 2, (4, 6, 2)))
    return AngleMap(np.linspace(-0.5, 0.5, 6), np.linspace(-0.2, 0.1, 4), add, np.abs(add), 22.9, 2.04)


@pytest.fixture(scope="session")
def corrected(golden: CalibrationFile, angle_map: AngleMap) -> CalibrationFile:
    """Return a calibration with radar errors and an angle map."""
    return replace(golden, calibration=replace(golden.calibration, angle_map=angle_map, radar_errors=ERRORS))


@pytest.fixture(scope="session")
def through_lens(corrected: CalibrationFile) -> Callable[[str], CalibrationFile]:
    """Return a function that gives the calibration another camera; its pairs, which another lens saw, are left out."""

    def made(lens: str) -> CalibrationFile:
        return replace(
            corrected,
            calibration=replace(corrected.calibration, camera=typical_camera(lens), pairs=()),
            check_point=None,
        )

    return made


@pytest.fixture
def unpacked(tmp_path: Path) -> Callable[[CalibrationFile], Path]:
    """Return a function that writes a calibration's pack into a folder."""

    def write(file: CalibrationFile) -> Path:
        folder = tmp_path / "pack"
        for name, data in unpack(export(file, "pack").data, source="pack").items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(data)
        return folder

    return write


@pytest.fixture(scope="session")
def compiled(golden: CalibrationFile, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, str | None], Path]:
    """Return a function that compiles a C++ program of the pack, or one beside its header, once."""
    compiler = shutil.which("g++") or shutil.which("clang++")
    folder, programs = tmp_path_factory.mktemp("compiled"), {}

    def program(name: str, source: str | None = None) -> Path:
        if compiler is None:
            pytest.skip("neither g++ nor clang++ is installed")
        if name not in programs:
            members = unpack(export(golden, "pack").data, source="pack")
            (folder / "radar_correction.hpp").write_bytes(members["radar_correction.hpp"])
            (folder / f"{name}.cpp").write_text(source or members[f"{name}.cpp"].decode())
            command = [compiler, "-std=c++17", "-Wall", "-Wextra", f"{name}.cpp", "-o", name]
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
            assert (done.returncode, done.stderr) == (0, "")
            programs[name] = folder / name
        return programs[name]

    return program


@pytest.fixture(params=["python", "c++"])
def selftest(request: pytest.FixtureRequest, compiled: Callable[[str], Path], tmp_path: Path) -> Callable[[Path], Run]:
    """Return a function that runs the self-test of a pack's folder, where cocalib and NumPy cannot be imported."""

    def run(folder: Path) -> Run:
        if request.param == "python":
            command = [sys.executable, "-I", "-S", folder / "selftest.py"]
        else:
            command = [compiled("selftest"), folder]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
        assert done.stderr == ""
        return Run(done.returncode, done.stdout)

    return run
