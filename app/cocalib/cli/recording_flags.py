"""Flags of the commands that read a recording: which files and topics, and the options of a calibration."""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import tyro

from calib_core.errors import InputError
from calib_core.options import CalibrationOptions, CameraPositionPrior, HowMeasured
from calib_core.recordings import RecordingOptions
from cocalib.cli.flags import File, Switch, called, same

if TYPE_CHECKING:
    from calib_core.interchange import CameraFile, VehicleNote
    from calib_core.recordings import Recording
    from calib_core.recordings.selection import Need

Recordings: TypeAlias = Annotated[tuple[Path, ...], tyro.conf.Positional, called("RECORDING...")]


@dataclass(frozen=True, slots=True)
class TopicFlags(RecordingOptions):
    """RecordingOptions with names for their values in the help; their texts are defined there."""

    radar_topic: Annotated[str | None, called("TOPIC")] = same(RecordingOptions, "radar_topic")
    image_topic: Annotated[str | None, called("TOPIC")] = same(RecordingOptions, "image_topic")
    camera_info_topic: Annotated[str | None, called("TOPIC")] = same(RecordingOptions, "camera_info_topic")
    radar_axes: Annotated[str | None, called("AXES")] = same(RecordingOptions, "radar_axes")
    map: Annotated[tuple[str, ...], called("QUANTITY=COLUMN:UNIT"), tyro.conf.UseAppendAction] = same(
        RecordingOptions, "map"
    )
    confirm_assumptions: Annotated[bool, called()] = same(RecordingOptions, "confirm_assumptions")
    video_start: Annotated[str | None, called("TIME")] = same(RecordingOptions, "video_start")
    time_zone: Annotated[str | None, called("OFFSET")] = same(RecordingOptions, "time_zone")
    radar_start: Annotated[str | None, called("TIME[,SECONDS]")] = same(RecordingOptions, "radar_start")


Topics: TypeAlias = Annotated[TopicFlags, tyro.conf.arg(name="")]


@dataclass(frozen=True, slots=True)
class RecordedFlags:
    """A recording, and how it is read."""

    recording: Recordings = ()
    """Bags (.bag, .mcap, .db3, folders), or folders of pictures, radar CSV, videos; several are read as one recording."""
    topics: Topics = field(default_factory=TopicFlags)

    def open(self, require: "Sequence[Need]" = ("radar", "image")) -> "Recording":
        """Open the recording.

        Args:
            require: what it must have.

        Raises:
            RecordingError: it cannot be opened.
        """
        from calib_core.recordings import open_recording

        return open_recording(self.recording, self.topics, require=require)


Recorded: TypeAlias = Annotated[RecordedFlags, tyro.conf.arg(name="")]


@dataclass(frozen=True, slots=True)
class CameraFlags:
    """Intrinsics from a file."""

    camera: File = None
    """Intrinsics to use if there are none, or instead of the recording's own: any format that `cocalib intrinsics` writes."""
    rescale_camera: Switch = False
    """With --camera: scale its intrinsics to the recorded pictures, if these are the calibrated ones resized."""

    def read(self) -> "CameraFile | None":
        """Read the file, if one is given.

        Raises:
            InputError: it cannot be read.
        """
        from calib_core.interchange import CameraFile

        return None if self.camera is None else CameraFile.read(self.camera, rescale=self.rescale_camera)


_LEAST_M, _MOST_M = 0.02, 2.0


def checked_reflector_m(reflector_m: float) -> float:
    """Return the width of the reflector.

    Raises:
        InputError: no corner reflector has it.
    """
    if not _LEAST_M <= reflector_m <= _MOST_M:
        raise InputError(
            f"--reflector-m {reflector_m:g}: give the width of the reflector as the camera sees it, "
            f"from {_LEAST_M:g} to {_MOST_M:g} m"
        )
    return reflector_m


# The camera position has its own flags; in the options it would become a subcommand.
_Options: TypeAlias = Annotated[
    CalibrationOptions, tyro.conf.arg(name=""), tyro.conf.AvoidSubcommands, tyro.conf.FlagConversionOff
]


@dataclass(frozen=True, slots=True)
class OptionFlags:
    """The options of a calibration, with a tape-measured camera position; no other extra measurement helps as much."""

    camera_position_m: Annotated[tuple[float, float, float] | None, called("X Y Z")] = None
    """Measured position of the camera's lens in the radar frame: forward, left, up [m]."""
    camera_position_by: Annotated[HowMeasured | None, called("{housing,antenna,drawing}")] = None
    """How it was measured: from housing to housing (5 cm), antenna to lens (2 cm), or in a drawing (0.5 cm); else 3 cm."""
    camera_position_sigma_m: float = CameraPositionPrior().sigma_m
    """Its standard deviation per axis [m], where it is not said how it was measured."""
    options: _Options = field(default_factory=CalibrationOptions)

    @classmethod
    def of(cls, options: CalibrationOptions) -> "OptionFlags":
        """Return the flags that give these options."""
        position = options.solving.camera_position
        if position is None:
            return cls(options=options)
        free = replace(options, solving=replace(options.solving, camera_position=None))
        return cls(position.position_m, camera_position_sigma_m=position.sigma_m, options=free)

    def all(self) -> CalibrationOptions:
        """Return the options with the measured position, if there is one."""
        if self.camera_position_m is None:
            return self.options
        prior = CameraPositionPrior(self.camera_position_m, self.camera_position_sigma_m)
        if self.camera_position_by is not None:
            prior = CameraPositionPrior.measured(self.camera_position_m, self.camera_position_by)
        return replace(self.options, solving=replace(self.options.solving, camera_position=prior))


@dataclass(frozen=True, slots=True)
class VehicleFlags:
    """Which vehicle it is; the calibration names it, and so does the report."""

    vehicle: Annotated[str | None, called("NAME")] = None
    """Name of the vehicle."""
    vehicle_type: Annotated[str | None, called("TYPE")] = None
    """Its type: vehicles of one type are mounted alike."""
    session_name: Annotated[str | None, called("NAME")] = None
    """Name of this session with it, such as a date."""
    radar_serial: Annotated[str | None, called("SERIAL")] = None
    """Serial number of the radar."""
    camera_serial: Annotated[str | None, called("SERIAL")] = None
    """Serial number of the camera."""

    def note(self) -> "VehicleNote":
        """Return what is stated.

        Raises:
            InputError: a text is empty, too long or not printable, or a name has a slash; the message names the flag.
        """
        from calib_core.interchange.calibration_file import VehicleNote, require_label, require_name

        for one in fields(self):
            if (text := getattr(self, one.name)) is not None:
                require = require_name if one.name in ("vehicle", "session_name") else require_label
                require(text, f"--{one.name.replace('_', '-')}")
        return VehicleNote(self.vehicle, self.vehicle_type, self.session_name, self.radar_serial, self.camera_serial)


# Without a prefix, but in a group of their own in the help.
Vehicle: TypeAlias = Annotated[VehicleFlags, tyro.conf.OmitArgPrefixes]
GivenCamera: TypeAlias = Annotated[CameraFlags, tyro.conf.arg(name="")]
Options: TypeAlias = Annotated[OptionFlags, tyro.conf.arg(name="")]
