"""`cocalib simulate`: recordings with known truth."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Self, TypeAlias

import tyro

from calib_core.errors import InputError
from calib_core.synthetic import PRESETS, Container, PresetName, SimulationOptions
from cocalib.cli.output import progress_bar

Simulation: TypeAlias = Annotated[SimulationOptions, tyro.conf.arg(name=""), tyro.conf.FlagConversionOff]


@dataclass(frozen=True, slots=True)
class Simulate:
    """Simulate a recording: radar, camera, and the ground truth (truth.json)."""

    out: Annotated[Path, tyro.conf.arg(metavar="FOLDER")]
    """Output folder; created if missing, must be empty."""
    containers: tuple[Container, ...] = ("ros1",)
    """Files to write: ros1 (radar.bag and camera.bag), mcap, db3; without ROS: dated pictures, and the radar as csv or jsonl."""
    preset: PresetName = "default"
    """Set of options that makes the recording unkind in one way or in many; typed options replace its own."""
    options: Simulation = field(default_factory=SimulationOptions)

    def file_defaults(self) -> Self | None:
        """Take the options of the preset; typed options replace them."""
        if self.preset == "default":
            return None
        return type(self)(self.out, options=PRESETS[self.preset])

    def run(self) -> int:
        """Write the recording; return the exit code."""
        from calib_core.synthetic import simulate, write_recording

        if self.out.exists() and (not self.out.is_dir() or any(self.out.iterdir())):
            raise InputError(f"{self.out}: not an empty folder; choose an empty or a new one")
        with progress_bar("rendering frames") as progress:
            paths = write_recording(simulate(self.options), self.out, containers=self.containers, progress=progress)
        print("\n".join(str(path) for path in paths))
        return 0
