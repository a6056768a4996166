"""`cocalib simulate`: recordings with known truth."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from calib_core.synthetic.options import Container, SimulationOptions
from calib_core.synthetic.presets import PRESETS, PresetName
from cocalib.cli.flags import OUTPUT_FOLDER, File
from cocalib.cli.named_options import Settings, with_named
from cocalib.cli.output import progress_bar
from cocalib.platform.files import require_room, whole_folder


@dataclass(frozen=True, slots=True)
class Simulate:
    """Simulate a recording: radar, camera, and the ground truth (truth.json)."""

    NAMED = SimulationOptions

    out: Annotated[Path, tyro.conf.arg(metavar="FOLDER"), OUTPUT_FOLDER]
    """Output folder; created if missing, must be empty."""
    containers: tuple[Container, ...] = ("ros1",)
    """Files to write: ros1 (radar.bag and camera.bag), mcap, db3; without ROS: dated images, and the radar as csv."""
    preset: PresetName = "default"
    """Set of options that makes the recording unkind in one way or in many; --options and --set change single ones."""
    options: File = None
    """Options by name in a TOML file, such as placements = 12."""
    set: Settings = ()
    """An option by name, such as placements=12 or defects.azimuth_scale=1.02; may be repeated. `--help all` lists them."""

    def run(self) -> int:
        """Write the recording; return the exit code."""
        from calib_core.synthetic.files import images_size_bytes, write_recording
        from calib_core.synthetic.recording import simulate

        recording = simulate(with_named(PRESETS[self.preset], self.set, self.options))
        with whole_folder(self.out) as part:
            require_room(self.out, len(self.containers) * images_size_bytes(recording))
            with progress_bar("rendering frames") as progress:
                paths = write_recording(recording, part, containers=self.containers, progress=progress)
        print("\n".join(str(self.out / path.relative_to(part)) for path in paths))
        return 0
