"""Flags that several commands share."""

import dataclasses
from dataclasses import dataclass
from typing import Annotated, TypeAlias

import tyro

from calib_core.options import CalibrationOptions, CameraPositionPrior
from calib_core.recordings import RecordingOptions
from calib_core.synthetic import SimulationOptions

__all__ = ["CameraPosition", "MeasuredCamera", "Options", "Simulation", "Topics"]

Topics: TypeAlias = Annotated[RecordingOptions, tyro.conf.arg(name="")]
Simulation: TypeAlias = Annotated[SimulationOptions, tyro.conf.arg(name=""), tyro.conf.FlagConversionOff]


@dataclass(frozen=True, slots=True)
class MeasuredCamera:
    """A tape-measured camera position: the most valuable extra fact there is."""

    camera_position_m: Annotated[tuple[float, float, float] | None, tyro.conf.arg(metavar="X Y Z")] = None
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
