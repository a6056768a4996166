"""Settings and fixtures for all tests."""

import contextlib
import gc
import importlib
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings

if TYPE_CHECKING:
    from calib_core.interchange.calibration_file import CalibrationFile

# The same examples on every run, without a time limit for each: a busy machine must not cause failures.
settings.register_profile("all", deadline=None, derandomize=True)
settings.register_profile("quick", settings.get_profile("all"), max_examples=40)

ROOT = Path(__file__).resolve().parent.parent


os.environ["COCALIB_CACHE"] = "off"  # tests must not write to the user's cache folder

# Tests and the programs that they start, some hundreds, keep the byte code of our modules, which git ignores: compiling them
# anew each time would take half of such a program's time, and a quarter of a minute of each worker's.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# As in the program itself: our matrices are small, and threads within one product only cost time. NumPy must not be loaded
# yet; jaxtyping's plugin, which would load it, is switched off in pyproject.toml.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


# Of what is imported and collected nothing is garbage: looking for it there, while that grows and then with every test, takes
# a seventh of the collection of each worker.
gc.disable()


def pytest_configure(config: pytest.Config) -> None:
    """Try fewer examples of each law where the slow tests are left out, too."""
    settings.load_profile("quick" if "not slow" in config.getoption("markexpr") else "all")


def pytest_collection(session: pytest.Session) -> None:
    """Load the tests from another file on in each worker, so that in a new checkout each compiles a part, and reads the rest."""
    worker = getattr(session.config, "workerinput", None)
    if worker is None or session.config.args_source is not pytest.Config.ArgsSource.TESTPATHS:
        return
    ignored = tuple(session.config.getoption("ignore") or ())
    files = [path.relative_to(ROOT) for path in sorted(ROOT.glob("tests/**/test_*.py"))]
    names = [".".join(path.with_suffix("").parts) for path in files if not str(path).startswith(ignored)]
    first = len(names) * int(worker["workerid"][2:]) // worker["workercount"]
    for name in (*names[first:], *names[:first]):
        with contextlib.suppress(Exception, pytest.skip.Exception):  # is told where its file is collected
            importlib.import_module(name)


def pytest_collection_finish() -> None:
    """Let the garbage collection begin with what the tests make."""
    gc.freeze()
    gc.enable()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Start one worker more than there are processors: tests that drive a browser or start programs wait now and then."""
    return (os.cpu_count() or 1) + 1


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
