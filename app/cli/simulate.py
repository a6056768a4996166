"""`cocalib simulate`: recordings with known truth."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, TypeAlias

import tyro

from app.cli.flags import called, same
from app.cli.output import progress_bar
from calib_core.errors import InputError
from calib_core.synthetic import Container, SimulationOptions

__all__ = ["Simulate"]


@dataclass(frozen=True, slots=True)
class SimulationFlags(SimulationOptions):
    """SimulationOptions with a name for a value in the help; the texts are defined there."""

    field_of_view_deg: Annotated[float | None, called("FLOAT")] = same(SimulationOptions, "field_of_view_deg")


Simulation: TypeAlias = Annotated[SimulationFlags, tyro.conf.arg(name=""), tyro.conf.FlagConversionOff]


@dataclass(frozen=True, slots=True)
class Simulate:
    """Simulate a recording: radar, camera, and the ground truth (truth.json)."""

    out: Annotated[Path, tyro.conf.arg(metavar="FOLDER")]
    """Output folder; created if missing, must be empty."""
    containers: tuple[Container, ...] = ("ros1",)
    """Files to write: ros1 (radar.bag and camera.bag), mcap, db3."""
    options: Simulation = field(default_factory=SimulationFlags)

    def run(self) -> int:
        """Write the recording; return the exit code."""
        from calib_core.synthetic import simulate, write_recording

        if self.out.exists() and (not self.out.is_dir() or any(self.out.iterdir())):
            raise InputError(f"{self.out}: not an empty folder; choose an empty or a new one")
        with progress_bar("rendering frames") as progress:
            paths = write_recording(simulate(self.options), self.out, containers=self.containers, progress=progress)
        print("\n".join(str(path) for path in paths))
        return 0
