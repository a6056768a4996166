"""Files in formats that are read but no longer written: the golden calibration as earlier versions exported it."""

from pathlib import Path

_FOLDER = Path(__file__).parent / "golden" / "kept"
KEPT = {
    "tf2-launch-xml": "tf2-launch.xml",
    "tf1-launch": "tf1.launch",
    "koide3": "koide3.json",
    "openlabel": "openlabel.json",
    "foxglove": "foxglove.mcap",
    "numpy": "radar_camera.npz",
}
"""The file of each format."""


def kept_file(name: str) -> bytes:
    """Return the file of a format."""
    return (_FOLDER / KEPT[name]).read_bytes()
