"""Settings and fixtures for all tests."""

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings

if TYPE_CHECKING:
    from calib_core.interchange.calibration_file import CalibrationFile

# The same examples on every run, without a time limit for each: a busy machine must not cause failures.
settings.register_profile("cocalib", deadline=None, derandomize=True)
settings.load_profile("cocalib")

ROOT = Path(__file__).resolve().parent.parent


os.environ["COCALIB_CACHE"] = "off"  # tests must not write to the user's cache folder

# Tests and the programs that they start, some hundreds, keep the byte code of our modules, which git ignores: compiling them
# anew each time would take half of such a program's time, and a quarter of a minute of each worker's.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# As in the program itself: our matrices are small, and threads within one product only cost time. NumPy must not be loaded
# yet; jaxtyping's plugin, which would load it, is switched off in pyproject.toml.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Start two workers more than there are processors: tests that drive a browser or start programs wait half of the time."""
    return (os.cpu_count() or 1) + 2


@pytest.fixture(scope="session")
def project_root() -> Path:
    """Return the top folder of the checkout."""
    return ROOT


@pytest.fixture(scope="session")
def golden_text(project_root: Path) -> str:
    """Return the golden calibration as it is written."""
    return (project_root / "tests/golden/calibration-1.json").read_text(encoding="utf-8")


@pytest.fixture(scope="session")
def file(golden_text: str) -> "CalibrationFile":
    """Return the golden calibration as it is read."""
    from calib_core.interchange.own.calibration_json import read_calibration

    return read_calibration(golden_text)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Return the folder of real recordings next to the checkout; skip if it is absent."""
    folder = Path(os.environ.get("COCALIB_SHARED_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip("there are no real recordings next to this checkout; set COCALIB_SHARED_DATA to their folder")
    return folder
