"""The command reproduces the sample recording in sample_data/ bit for bit, and the sample stays small."""

import importlib.metadata
import re
from itertools import islice
from pathlib import Path

import pytest
from rosbags.highlevel import AnyReader

from calib_core.recordings.containers.writing import write_ros1_bag
from calib_core.synthetic import simulate
from calib_core.synthetic.messages import radar_messages
from calib_core.synthetic.sample import SAMPLE_NAME, SAMPLE_OPTIONS, write_sample
from calib_core.synthetic.truth import clicks_text, truth_text

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


@pytest.mark.usefixtures("locked")
def test_radar_truth_and_clicks_of_the_sample_are_reproduced(sample: Path, tmp_path: Path) -> None:
    recording = simulate(SAMPLE_OPTIONS)
    again = write_ros1_bag(tmp_path / "radar.bag", radar_messages(recording, 1))
    assert again.read_bytes() == (sample / "radar.bag").read_bytes()
    assert truth_text(recording) == (sample / "truth.json").read_text()
    assert clicks_text(recording) == (sample / "clicks.json").read_text()


@pytest.mark.usefixtures("locked")
def test_the_first_frames_of_the_sample_are_reproduced(sample: Path) -> None:
    frames = list(simulate(SAMPLE_OPTIONS).frames(4))
    with AnyReader([sample / "camera.bag"]) as reader:
        images = [connection for connection in reader.connections if connection.topic.endswith("compressed")]
        stored = [
            reader.deserialize(raw, connection.msgtype).data.tobytes()
            for connection, _, raw in islice(reader.messages(images), 4)
        ]
    assert [frame.jpeg(SAMPLE_OPTIONS.jpeg_quality) for frame in frames] == stored


@pytest.mark.slow
@pytest.mark.usefixtures("locked")
def test_the_whole_sample_is_reproduced(sample: Path, tmp_path: Path) -> None:
    for path in write_sample(tmp_path):
        assert path.read_bytes() == (sample / path.name).read_bytes(), path.name
