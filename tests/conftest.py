"""What all tests share."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

# The same examples on every run, and no time limit on a single one: a busy machine is no failure.
settings.register_profile("cocalib", deadline=None, derandomize=True)
settings.load_profile("cocalib")

ROOT = Path(__file__).resolve().parent.parent


os.environ["COCALIB_CACHE"] = "off"  # tests leave nothing in the user's cache folder

# As in the program itself: our matrices are small, and threads inside one product only cost time. Nothing has loaded NumPy
# yet; jaxtyping's plugin, which would, is switched off in pyproject.toml.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


@pytest.fixture(scope="session")
def project_root() -> Path:
    """Return the checkout's top folder."""
    return ROOT


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Return the folder of real recordings that lies beside the checkout; skip where it is absent."""
    folder = Path(os.environ.get("COCALIB_SHARED_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip("the real recordings are not beside this checkout; set COCALIB_SHARED_DATA to their folder")
    return folder
