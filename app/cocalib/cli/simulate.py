"""`cocalib simulate`: recordings with known truth."""

from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Annotated, Any, Self, TypeAlias

import tyro

from calib_core.errors import InputError
from calib_core.synthetic import PRESETS, Container, PresetName, RadarDefects, SimulationOptions, Surroundings
from cocalib.cli.flags import called, same
from cocalib.cli.output import progress_bar


@dataclass(frozen=True, slots=True)
class DefectFlags(RadarDefects):
    """RadarDefects with a name for a value in the help; the texts are defined there."""

    cloud_topic: Annotated[str, tyro.conf.arg(metavar="TOPIC")] = same(RadarDefects, "cloud_topic")
    range_bin_m: Annotated[float | None, called("FLOAT")] = same(RadarDefects, "range_bin_m")
    azimuth_bins: Annotated[int | None, called("INT")] = same(RadarDefects, "azimuth_bins")
    scatter_range_m: Annotated[float | None, called("FLOAT")] = same(RadarDefects, "scatter_range_m")
    scatter_azimuth_deg: Annotated[float | None, called("FLOAT")] = same(RadarDefects, "scatter_azimuth_deg")
    scatter_elevation_deg: Annotated[float | None, called("FLOAT")] = same(RadarDefects, "scatter_elevation_deg")
    constant_azimuth_deg: Annotated[float | None, called("FLOAT")] = same(RadarDefects, "constant_azimuth_deg")
    constant_elevation_deg: Annotated[float | None, called("FLOAT")] = same(RadarDefects, "constant_elevation_deg")
    threshold_db: Annotated[float | None, called("FLOAT")] = same(RadarDefects, "threshold_db")
    max_speed_mps: Annotated[float | None, called("FLOAT")] = same(RadarDefects, "max_speed_mps")


@dataclass(frozen=True, slots=True)
class SurroundingsFlags(Surroundings):
    """Surroundings with a name for a value in the help; the texts are defined there."""

    strong_target_dbsm: Annotated[float | None, called("FLOAT")] = same(Surroundings, "strong_target_dbsm")


@dataclass(frozen=True, slots=True)
class SimulationFlags(SimulationOptions):
    """SimulationOptions with a name for a value in the help; the texts are defined there."""

    field_of_view_deg: Annotated[float | None, called("FLOAT")] = same(SimulationOptions, "field_of_view_deg")
    defects: DefectFlags = field(default=DefectFlags(), metadata=same(SimulationOptions, "defects").metadata)
    surroundings: SurroundingsFlags = field(
        default=SurroundingsFlags(), metadata=same(SimulationOptions, "surroundings").metadata
    )

    @classmethod
    def of(cls, options: SimulationOptions) -> Self:
        """Return the options as flags."""
        groups = {
            "defects": DefectFlags(**_values(options.defects)),
            "surroundings": SurroundingsFlags(**_values(options.surroundings)),
        }
        return cls(**(_values(options) | groups))


def _values(options: Any) -> dict[str, Any]:
    """Return the fields of options with their values."""
    return {one.name: getattr(options, one.name) for one in fields(options)}


Simulation: TypeAlias = Annotated[SimulationFlags, tyro.conf.arg(name=""), tyro.conf.FlagConversionOff]


@dataclass(frozen=True, slots=True)
class Simulate:
    """Simulate a recording: radar, camera, and the ground truth (truth.json)."""

    out: Annotated[Path, tyro.conf.arg(metavar="FOLDER")]
    """Output folder; created if missing, must be empty."""
    containers: tuple[Container, ...] = ("ros1",)
    """Files to write: ros1 (radar.bag and camera.bag), mcap, db3; without ROS: dated pictures, and the radar as csv or jsonl."""
    preset: PresetName = "default"
    """Set of options that makes the recording unkind in one way or in many; typed options replace its own."""
    options: Simulation = field(default_factory=SimulationFlags)

    def file_defaults(self) -> Self | None:
        """Take the options of the preset; typed options replace them."""
        if self.preset == "default":
            return None
        return type(self)(self.out, options=SimulationFlags.of(PRESETS[self.preset]))

    def run(self) -> int:
        """Write the recording; return the exit code."""
        from calib_core.synthetic import simulate, write_recording

        if self.out.exists() and (not self.out.is_dir() or any(self.out.iterdir())):
            raise InputError(f"{self.out}: not an empty folder; choose an empty or a new one")
        with progress_bar("rendering frames") as progress:
            paths = write_recording(simulate(self.options), self.out, containers=self.containers, progress=progress)
        print("\n".join(str(path) for path in paths))
        return 0
