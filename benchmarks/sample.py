"""Regenerate the sample recording: python -m benchmarks.sample sample_data."""

import argparse
import shutil
import sys
from pathlib import Path

from calib_core.synthetic.files import write_recording
from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.recording import simulate
from calib_core.synthetic.rig import RigOptions

SAMPLE_NAME = "rooftop"
SAMPLE_OPTIONS = SimulationOptions(
    scene="rooftop",
    radar="awr1843",
    placements=20,
    dwell_s=4.6,
    field_of_view_deg=62.0,
    width_px=960,
    height_px=600,
    camera_rate_hz=1.5,
    radar_rate_hz=10.0,
    jpeg_quality=68,
    seed=19,
    rig=RigOptions(camera_offset_m=(-0.02, 0.03, 0.11)),
)

_README = """\
# The rooftop sample

A simulated recording: a TI AWR1843 radar and a camera on one mast, and a person who puts a trihedral corner reflector
down at 20 places on a rooftop. No real sensor was involved.

| file | content |
|---|---|
| `radar.bag` | ROS 1, `/ti_mmwave/radar_scan`: one `ti_mmwave_rospkg/RadarScan` per return, 10 scans per second |
| `camera.bag` | ROS 1, `/camera/image_raw/compressed` (960 x 600, 1.5 per second), `/camera/camera_info` |
| `clicks.json` | example clicks: one per placement, 0.7 px of click noise |
| `truth.json` | the true `camera_from_radar`, and where and when the reflector stood still; for tests and benchmarks only |

The reflector's position is its apex, the inner corner where the three sheets meet. The apex is the phase centre and the
point to click. `make sample` (`python -m benchmarks.sample sample_data`) regenerates these files; how a processor
rounds decides the last bits of a few images.
"""


def write_sample(folder: Path) -> tuple[Path, ...]:
    """Write the sample into its own subfolder, replace what is there, and return its files.

    Args:
        folder: the parent folder, such as sample_data.
    """
    target = folder / SAMPLE_NAME
    if target.exists():
        shutil.rmtree(target)
    write_recording(simulate(SAMPLE_OPTIONS), target)
    (target / "README.md").write_text(_README, encoding="utf-8")
    return tuple(sorted(target.iterdir()))


def main(arguments: list[str]) -> int:
    """Write the sample to the folder given on the command line."""
    parser = argparse.ArgumentParser(prog="benchmarks.sample", description="Regenerate the sample recording.")
    parser.add_argument("folder", type=Path, help="parent folder, such as sample_data")
    for path in write_sample(parser.parse_args(arguments).folder):
        print(f"{path}  {path.stat().st_size / 1e6:.2f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
