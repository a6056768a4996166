"""The command reproduces the sample recording in sample_data/, and the sample stays small."""

import importlib.metadata
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calib_core.recordings import Recording, open_recording
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


@pytest.fixture(scope="module")
def again(locked: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write the sample once more; return its folder."""
    folder = tmp_path_factory.mktemp("sample")
    write_sample(folder)
    return folder / SAMPLE_NAME


def opened(folder: Path) -> Recording:
    return open_recording([folder / "radar.bag", folder / "camera.bag"])


def nearly(value: Any) -> Any:
    """Return a tree of JSON whose numbers compare to 1e-9: a processor's vector units decide the last digits."""
    if isinstance(value, dict):
        return {key: nearly(one) for key, one in value.items()}
    if isinstance(value, list):
        return [nearly(one) for one in value]
    return pytest.approx(value, rel=1e-9, abs=1e-9) if isinstance(value, float) else value


@pytest.mark.slow
@pytest.mark.parametrize("name", ["clicks.json", "truth.json"])
def test_clicks_and_truth_are_reproduced(name: str, sample: Path, again: Path) -> None:
    assert json.loads((again / name).read_text()) == nearly(json.loads((sample / name).read_text()))


@pytest.mark.slow
def test_the_text_is_reproduced(sample: Path, again: Path) -> None:
    assert (again / "README.md").read_text() == (sample / "README.md").read_text()


@pytest.mark.slow
def test_the_radar_is_reproduced(sample: Path, again: Path) -> None:
    with opened(sample) as shipped, opened(again) as written:
        one, other = shipped.radar_scans(), written.radar_scans()
        assert np.array_equal(other.times_ns, one.times_ns)
        assert np.array_equal(other.first_return, one.first_return)
        assert other.points_radar_m == pytest.approx(one.points_radar_m, abs=1e-5)
        assert other.doppler_mps == pytest.approx(one.doppler_mps, abs=1e-5, nan_ok=True)


@pytest.mark.slow
def test_every_picture_is_reproduced_to_a_few_grey_levels(sample: Path, again: Path) -> None:
    with opened(sample) as shipped, opened(again) as written:
        assert list(written.image_times) == list(shipped.image_times)
        for index in range(len(shipped.image_times)):
            apart = np.abs(written.image(index).astype(int) - shipped.image(index))
            assert apart.max() <= 8, f"picture {index}"
            assert apart.mean() <= 0.01, f"picture {index}"
