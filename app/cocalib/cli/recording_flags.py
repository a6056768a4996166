"""Flags of the commands that read a recording: which files and topics, and the options of a calibration."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

import tyro

from calib_core.errors import InputError
from calib_core.options import (
    HOW_MEASURED,
    CalibrationOptions,
    CameraPositionPrior,
    HowMeasured,
    Method,
    checked_options,
)
from calib_core.recordings import RecordingOptions
from cocalib.cli.flags import MORE, File, MoreSwitch, called, same
from cocalib.cli.named_options import Settings, with_named
from cocalib.platform.files import keep

if TYPE_CHECKING:
    from calib_core.interchange.calibration_file import VehicleNote
    from calib_core.interchange.cameras.files import CameraFile
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
    radar_late: Annotated[float, called("SECONDS")] = same(RecordingOptions, "radar_late")
    radar_frame: Annotated[Literal["sensor", "body"] | None, called("{sensor,body}")] = same(
        RecordingOptions, "radar_frame"
    )
    radar_mount: Annotated[tuple[float, float, float, float, float, float] | None, called("X Y Z ROLL PITCH YAW")] = (
        same(RecordingOptions, "radar_mount")
    )
    no_recording_file: Annotated[bool, called()] = same(RecordingOptions, "no_recording_file")

    def open(self, paths: Sequence[Path], require: "Sequence[Need]" = ("radar", "image")) -> "Recording":
        """Open a recording; say on stderr what a recording.toml beside it states.

        Args:
            paths: of it.
            require: what it must have.

        Raises:
            RecordingError: it cannot be opened.
        """
        from calib_core.recordings import open_recording

        recording = open_recording(paths, self, require=require)
        keep(recording.files)
        if recording.recording_file:
            print(recording.recording_file, file=sys.stderr)
        return recording


Topics: TypeAlias = Annotated[TopicFlags, tyro.conf.arg(name=""), MORE]


@dataclass(frozen=True, slots=True)
class RecordedFlags:
    """A recording, and how it is read."""

    recording: Recordings = ()
    """Bags (.bag, .mcap, .db3, folders), or folders of images, radar CSV, videos; several are read as one recording."""
    topics: Topics = field(default_factory=TopicFlags)

    def open(self, require: "Sequence[Need]" = ("radar", "image")) -> "Recording":
        """Open the recording.

        Args:
            require: what it must have.

        Raises:
            RecordingError: it cannot be opened.
        """
        return self.topics.open(self.recording, require)


Recorded: TypeAlias = Annotated[RecordedFlags, tyro.conf.arg(name="")]


@dataclass(frozen=True, slots=True)
class CameraFlags:
    """Intrinsics from a file."""

    camera: File = None
    """Intrinsics to use if there are none, or instead of the recording's own: any format that `cocalib intrinsics` writes."""
    rescale_camera: MoreSwitch = False
    """With --camera: scale its intrinsics to the recorded images, if these are the calibrated ones resized."""

    def read(self) -> "CameraFile | None":
        """Read the file, if one is given.

        Raises:
            InputError: it cannot be read.
        """
        from calib_core.interchange.cameras.files import CameraFile

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


@dataclass(frozen=True, slots=True)
class OptionFlags:
    """The options of a calibration, with a tape-measured camera position; no other extra measurement helps as much."""

    camera_position_m: Annotated[tuple[float, float, float] | None, called("X Y Z")] = None
    """Measured position of the camera's lens in the radar frame: forward, left, up [m]."""
    camera_position_by: Annotated[HowMeasured | None, called("{housing,antenna,drawing}")] = None
    """How it was measured: from housing to housing (5 cm), antenna to lens (2 cm), or in a drawing (0.5 cm); else 3 cm."""
    camera_position_sigma_m: Annotated[float | None, called("FLOAT"), MORE] = None
    """Instead of how it was measured: its standard deviation per axis [m]."""
    method: Annotated[Method | None, called("{default,paper}")] = None
    """The robust estimator, or the paper's Algorithm 1 as printed."""
    options: File = None
    """Options by name in a TOML file, such as sigma_px = 3 below [noise]."""
    set: Settings = ()
    """An option by name, such as noise.sigma_px=3; may be repeated. `--help all` lists them."""

    def all(self, base: CalibrationOptions | None = None) -> CalibrationOptions:
        """Return all options of a calibration.

        Args:
            base: what is not typed; None takes the defaults.

        Raises:
            InputError: it is said in words and in figures how well the position is known, or of no position.
            OptionError: an option by name is unknown or out of range.
        """
        options = with_named(base or CalibrationOptions(), self.set, self.options)
        if self.method is not None:
            options = replace(options, method=self.method)
        position = self._position(options.solving.camera_position)
        return checked_options(replace(options, solving=replace(options.solving, camera_position=position)))

    def _position(self, known: CameraPositionPrior | None) -> CameraPositionPrior | None:
        """Return the camera's position as typed, else as it was known."""
        how, sigma_m = self.camera_position_by, self.camera_position_sigma_m
        if how is not None and sigma_m is not None:
            raise InputError(
                f"--camera-position-by {how} stands for a standard deviation of {HOW_MEASURED[how][1]:g} m, and "
                f"--camera-position-sigma-m states {sigma_m:g} m; give one of them"
            )
        if self.camera_position_m is not None:
            known = CameraPositionPrior(self.camera_position_m)
        stated_m = sigma_m if how is None else HOW_MEASURED[how][1]
        if stated_m is None:
            return known
        if known is None:
            raise InputError(
                "how well the camera's position is known is said, but not where it is: --camera-position-m"
            )
        return replace(known, sigma_m=stated_m)


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

        for entry in fields(self):
            if (text := getattr(self, entry.name)) is not None:
                require = require_name if entry.name in ("vehicle", "session_name") else require_label
                require(text, f"--{entry.name.replace('_', '-')}")
        return VehicleNote(self.vehicle, self.vehicle_type, self.session_name, self.radar_serial, self.camera_serial)


# Without a prefix, but in a group of their own in the help.
Vehicle: TypeAlias = Annotated[VehicleFlags, tyro.conf.OmitArgPrefixes, MORE]
GivenCamera: TypeAlias = Annotated[CameraFlags, tyro.conf.arg(name="")]
Options: TypeAlias = Annotated[OptionFlags, tyro.conf.arg(name="")]
