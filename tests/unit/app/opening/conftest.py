"""A small recording without intrinsics, and its camera file."""

from pathlib import Path

import pytest

from calib_core.synthetic.files import write_recording
from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.recording import simulate
from tests.image_recording import grey_frames


@pytest.fixture(scope="session")
def without_intrinsics(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with images, a radar table and, apart from them, camera.yaml."""
    folder = tmp_path_factory.mktemp("recordings")
    options = SimulationOptions(placements=2, dwell_s=4.0, width_px=128, height_px=80, camera_rate_hz=2.0)
    with grey_frames():
        write_recording(simulate(options), folder, ("csv",))
    (folder / "recording_csv" / "camera.yaml").rename(folder / "camera.yaml")
    return folder
