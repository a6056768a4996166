"""Flags that several commands share, and how values are called in the help."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, TypeAlias

import tyro

from calib_core.options import CalibrationOptions, CameraPositionPrior
from calib_core.recordings import RecordingOptions
from calib_core.synthetic import SimulationOptions

__all__ = [
    "CameraPosition",
    "File",
    "Folder",
    "MeasuredCamera",
    "NewFile",
    "Options",
    "Recordings",
    "Simulation",
    "SimulationFlags",
    "Switch",
    "TopicFlags",
    "Topics",
]


def _called(metavar: str | None = None) -> object:
    """Name a value in the help; a default of None or False tells nobody anything, so it is left out."""
    return tyro.conf.arg(metavar=metavar, help_behavior_hint="")


File: TypeAlias = Annotated[Path | None, _called("FILE")]
NewFile: TypeAlias = Annotated[Path, tyro.conf.arg(metavar="FILE")]
Folder: TypeAlias = Annotated[Path | None, _called("FOLDER")]
Switch: TypeAlias = Annotated[bool, _called()]
Recordings: TypeAlias = Annotated[tuple[Path, ...], tyro.conf.Positional, _called("RECORDING...")]


@dataclass(frozen=True, slots=True)
class TopicFlags(RecordingOptions):
    """RecordingOptions with their values named; what each means is told there."""

    radar_topic: Annotated[str | None, _called("TOPIC")] = None
    image_topic: Annotated[str | None, _called("TOPIC")] = None
    camera_info_topic: Annotated[str | None, _called("TOPIC")] = None
    radar_axes: Annotated[str | None, _called("AXES")] = None
    video_start: Annotated[str | None, _called("TIME")] = None


@dataclass(frozen=True, slots=True)
class SimulationFlags(SimulationOptions):
    """SimulationOptions with a value named; what each means is told there."""

    field_of_view_deg: Annotated[float | None, _called("FLOAT")] = None


Topics: TypeAlias = Annotated[TopicFlags, tyro.conf.arg(name="")]
Simulation: TypeAlias = Annotated[SimulationFlags, tyro.conf.arg(name=""), tyro.conf.FlagConversionOff]


@dataclass(frozen=True, slots=True)
class MeasuredCamera:
    """A tape-measured camera position: the most valuable extra fact there is."""

    camera_position_m: Annotated[tuple[float, float, float] | None, _called("X Y Z")] = None
    """Where the camera's lens sits in the radar frame: forward, left, up [m]."""
    camera_position_sigma_m: float = 0.01
    """How well that is known, per axis [m]."""

    def over(self, options: CalibrationOptions) -> CalibrationOptions:
        """Lay the measured position over the options."""
        if self.camera_position_m is None:
            return options
        prior = CameraPositionPrior(self.camera_position_m, self.camera_position_sigma_m)
        return dataclasses.replace(options, solving=dataclasses.replace(options.solving, camera_position=prior))


CameraPosition: TypeAlias = Annotated[MeasuredCamera, tyro.conf.arg(name="")]
# The camera position has flags of its own; here it would become a sub-command.
Options: TypeAlias = Annotated[
    CalibrationOptions, tyro.conf.arg(name=""), tyro.conf.AvoidSubcommands, tyro.conf.FlagConversionOff
]
