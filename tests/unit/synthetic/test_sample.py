"""The command reproduces the sample recording in sample_data/, and the sample stays small."""

import importlib.metadata
import json
import re
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from benchmarks.sample import SAMPLE_NAME, SAMPLE_OPTIONS, write_sample
from calib_core.recordings import open_recording
from calib_core.recordings.containers.writing import write_ros1_bag
from calib_core.synthetic.files import clicks_text, radar_messages, truth_text
from calib_core.synthetic.recording import SimulatedRecording, simulate

LARGEST_BYTES = 12_000_000
FIRST_IMAGES = 24


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


def test_the_sample_is_small_enough_to_ship(sample):
    files = {path.name: path.stat().st_size for path in sample.iterdir()}
    assert set(files) == {"README.md", "camera.bag", "clicks.json", "radar.bag", "truth.json"}
    assert sum(files.values()) < LARGEST_BYTES


@pytest.fixture(scope="module")
def again(locked: None) -> SimulatedRecording:
    """Simulate the sample once more; its images are rendered when they are asked for."""
    return simulate(SAMPLE_OPTIONS)


def nearly(value: Any) -> Any:
    """Return a tree of JSON whose numbers compare to 1e-9: a processor's vector units decide the last digits."""
    if isinstance(value, dict):
        return {key: nearly(one) for key, one in value.items()}
    if isinstance(value, list):
        return [nearly(one) for one in value]
    return pytest.approx(value, rel=1e-9, abs=1e-9) if isinstance(value, float) else value


@pytest.mark.parametrize(("name", "text_of"), [("clicks.json", clicks_text), ("truth.json", truth_text)])
def test_clicks_and_truth_are_reproduced(name, text_of, sample, again):
    assert json.loads(text_of(again)) == nearly(json.loads((sample / name).read_text()))


def test_the_command_replaces_the_sample_and_its_text(sample, tmp_path, monkeypatch):
    def write(recording: SimulatedRecording, folder: Path) -> None:
        assert recording.options == SAMPLE_OPTIONS
        folder.mkdir(parents=True)

    monkeypatch.setattr("benchmarks.sample.write_recording", write)
    (tmp_path / SAMPLE_NAME).mkdir()
    (tmp_path / SAMPLE_NAME / "old").touch()

    (text,) = write_sample(tmp_path)

    assert text.read_text() == (sample / "README.md").read_text()


@pytest.mark.slow
def test_the_radar_is_reproduced(sample, again, tmp_path):
    written = write_ros1_bag(tmp_path / "radar.bag", radar_messages(again, 1))
    with (
        open_recording(sample / "radar.bag", require=("radar",)) as shipped,
        open_recording(written, require=("radar",)) as new,
    ):
        one, other = shipped.radar_scans(), new.radar_scans()
    assert np.array_equal(other.times_ns, one.times_ns)
    assert np.array_equal(other.first_return, one.first_return)
    assert other.points_radar_m == pytest.approx(one.points_radar_m, abs=1e-5)
    assert other.doppler_mps == pytest.approx(one.doppler_mps, abs=1e-5, nan_ok=True)


@pytest.mark.slow
def test_the_first_images_are_reproduced_to_a_few_grey_levels(sample, again):
    """The others differ from them in where the person and the reflector are."""
    with open_recording(sample / "camera.bag", require=("image",)) as shipped:
        assert list(again.stage.frame_times.header_ns) == list(shipped.image_times)
        for index, frame in enumerate(again.frames(FIRST_IMAGES)):
            encoded = np.frombuffer(frame.jpeg(SAMPLE_OPTIONS.jpeg_quality), dtype=np.uint8)
            apart = np.abs(cv2.imdecode(encoded, cv2.IMREAD_COLOR).astype(int) - shipped.image(index))
            assert apart.max() <= 8, f"image {index}"
            assert apart.mean() <= 0.01, f"image {index}"
