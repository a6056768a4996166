"""The sample's clicks with the radar around them, as a solve gets them."""

from pathlib import Path

from calib_core.camera import Camera
from calib_core.interchange.own.clicks_json import read_clicks
from calib_core.measurements import RadarScans, ReflectorClick
from calib_core.recordings import open_recording

ClickedSample = tuple[tuple[ReflectorClick, ...], RadarScans, Camera]


def read_rooftop(project_root: Path, half_window_s: float) -> ClickedSample:
    """Read the sample's own clicks, the scans within half_window_s [s] of them, and the camera."""
    folder = project_root / "sample_data" / "rooftop"
    clicks = read_clicks((folder / "clicks.json").read_text(encoding="utf-8"), "clicks.json")
    with open_recording([folder / "camera.bag", folder / "radar.bag"]) as recording:
        camera = recording.camera()
        assert camera is not None
        return clicks, recording.radar_scans_around([click.image_time for click in clicks], half_window_s), camera
