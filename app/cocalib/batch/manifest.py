"""The manifest: which sessions of which vehicles are to be calibrated, from what, and how."""

from dataclasses import dataclass, field
from pathlib import Path

from calib_core.options import CalibrationOptions
from calib_core.recordings import RecordingOptions


@dataclass(frozen=True, slots=True)
class ManifestRow:
    """One session of one vehicle.

    Attributes:
        vehicle: its name.
        session: name of the session, such as a date; unique for the vehicle.
        recording: files or folders that are read as one recording.
        vehicle_type: vehicles of one type are mounted alike.
        radar_serial: of the radar.
        camera_serial: of the camera.
        clicks: file of clicks in this recording; None without.
        auto: place clicks without a person where there are none.
        camera: file of intrinsics; None for the recording's own.
        rescale_camera: scale these intrinsics to the recorded pictures, if they are the calibrated ones resized.
        reflector_m: width of the reflector as the camera sees it [m], for auto.
        boxes: file of boxes to evaluate by; None without.
        topics: which topics, and how they are read.
        options: of the calibration, the tape-measured camera position included.
        exports: names of export formats.
        place: where the row stands in the manifest, for error messages.
    """

    vehicle: str
    session: str
    recording: tuple[Path, ...]
    vehicle_type: str | None = None
    radar_serial: str | None = None
    camera_serial: str | None = None
    clicks: Path | None = None
    auto: bool = False
    camera: Path | None = None
    boxes: Path | None = None
    topics: RecordingOptions = field(default_factory=RecordingOptions)
    options: CalibrationOptions = field(default_factory=CalibrationOptions)
    exports: tuple[str, ...] = ()
    rescale_camera: bool = False
    reflector_m: float = 0.24
    place: str = ""

    @property
    def name(self) -> str:
        """Vehicle and session, for people."""
        return f"{self.vehicle} / {self.session}"


@dataclass(frozen=True, slots=True)
class Manifest:
    """A manifest that was read.

    Attributes:
        source: its file.
        rows: in the file's order; no two have the same vehicle and session.
    """

    source: Path
    rows: tuple[ManifestRow, ...]
