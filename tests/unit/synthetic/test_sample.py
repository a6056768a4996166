"""The command reproduces the sample recording in sample_data/ bit for bit, and the sample stays small."""

import importlib.metadata
import re
from pathlib import Path

import pytest

from calib_core.synthetic.sample import SAMPLE_NAME, write_sample

LARGEST_BYTES = 12_000_000


@pytest.fixture(scope="module")
def sample(project_root: Path) -> Path:
    return project_root / "sample_data" / SAMPLE_NAME


@pytest.fixture(scope="module")
def locked(project_root: Path) -> None:
    """Skip if versions other than the locked ones are installed: the last bits may differ."""
    text = (project_root / "requirements" / "runtime.txt").read_text()
    for package in ("numpy", "opencv-python-headless", "rosbags"):
        pinned = re.findall(rf"^{package}==([^\s;\\]+)", text, flags=re.MULTILINE)
        if pinned and importlib.metadata.version(package) not in pinned:
            pytest.skip(f"{package} is {importlib.metadata.version(package)}; the sample is made with {pinned[0]}")


def test_the_sample_is_small_enough_to_ship(sample: Path) -> None:
    files = {path.name: path.stat().st_size for path in sample.iterdir()}
    assert set(files) == {"README.md", "camera.bag", "clicks.json", "radar.bag", "truth.json"}
    assert sum(files.values()) < LARGEST_BYTES


@pytest.mark.slow
@pytest.mark.usefixtures("locked")
def test_the_whole_sample_is_reproduced(sample: Path, tmp_path: Path) -> None:
    for path in write_sample(tmp_path):
        assert path.read_bytes() == (sample / path.name).read_bytes(), path.name
