"""The manifest: which sessions of which vehicles are to be calibrated, from what, and how."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

import msgspec
from msgspec import Meta, Struct

from calib_core.errors import CalibrationError, InputError
from calib_core.input_files import read_text
from calib_core.interchange.calibration_file import MOST_CHARACTERS, require_label, require_name
from calib_core.interchange.formats.registry import format_named
from calib_core.interchange.syntax.strict_json import checked
from calib_core.options import CalibrationOptions, CameraPositionPrior
from calib_core.parsing import toml_table
from calib_core.recordings import RecordingOptions
from cocalib.option_changes import options_from_tree


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
        rescale_camera: scale these intrinsics to the recorded images, if they are the calibrated ones resized.
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


Name = Annotated[str, Meta(min_length=1, max_length=MOST_CHARACTERS)]


class SharedDocument(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What sessions can have in common."""

    vehicle_type: Name | None = None
    radar_serial: Name | None = None
    camera_serial: Name | None = None
    auto: bool = False
    camera: str | None = None
    rescale_camera: bool = False
    reflector_m: Annotated[float, Meta(ge=0.02, le=2.0)] = 0.24
    camera_position_m: tuple[float, float, float] | None = None
    camera_position_sigma_m: float | None = None
    exports: tuple[str, ...] = ()
    topics: RecordingOptions = msgspec.field(default_factory=RecordingOptions)
    options: dict[str, Any] = msgspec.field(default_factory=dict)


class SessionDocument(SharedDocument, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One session of one vehicle; paths are relative to the manifest."""

    vehicle: Name
    recording: str | tuple[str, ...]
    session: Name | None = None
    clicks: str | None = None
    boxes: str | None = None


class ManifestDocument(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A manifest: its sessions, each a SessionDocument, and what they share unless they say otherwise."""

    session: tuple[dict[str, Any], ...]
    defaults: SharedDocument = msgspec.field(default_factory=SharedDocument)


_MOST_BYTES = 64 * 1024 * 1024
_TEXTS = ("vehicle", "session", "vehicle_type", "radar_serial", "camera_serial")

_EXAMPLE = 'a [[session]] for each: vehicle = "V17", session = "1", recording = "drive.bag", clicks = "clicks.json"'


def read_manifest(path: Path) -> Manifest:
    """Read a TOML manifest. Paths in it are relative to its folder; whether they exist is not looked at.

    Raises:
        InputError: it cannot be read; a key is unknown or has a wrong value; two rows are of one session.
    """
    text = read_text(path, is_what="a manifest", max_bytes=_MOST_BYTES, if_missing=f"write one, with {_EXAMPLE}")
    if path.suffix.lower() != ".toml":
        raise InputError(f"{path}: a manifest is a .toml file, with {_EXAMPLE}")
    places, content = _toml(text, path)
    document = checked(content, ManifestDocument, source=str(path))
    if not document.session:
        raise InputError(f"{path}: no session in it; add {_EXAMPLE}")
    defaults = content.get("defaults", {})
    sessions = [
        checked(_merged(defaults, one), SessionDocument, source=f"{path}: {place}")
        for one, place in zip(content["session"], places, strict=True)
    ]
    rows = tuple(_row(session, place, path) for session, place in zip(sessions, places, strict=True))
    _require_different(rows, path)
    _require_own_recordings(rows, path)
    return Manifest(path, rows)


def _toml(text: str, path: Path) -> tuple[list[str], dict[str, Any]]:
    content = toml_table(text, source=str(path))
    sessions = content.setdefault("session", [])
    if isinstance(sessions, dict):
        raise InputError(f"{path}: [session] is one table; write [[session]], with two brackets, above each session")
    for number, one in enumerate(sessions if isinstance(sessions, list) else [], start=1):
        _require_quoted(one, f"{path}: session {number}")
    _require_quoted(content.get("defaults"), f"{path}: defaults")
    count = len(sessions) if isinstance(sessions, list) else 0
    return [f"session {number}" for number in range(1, count + 1)], content


def _require_quoted(table: object, where: str) -> None:
    """Refuse numbers and dates where TOML wants text in quotes.

    Raises:
        InputError: names the first.
    """
    for key, value in table.items() if isinstance(table, dict) else ():
        if key in _TEXTS and not isinstance(value, str):
            raise InputError(f'{where}: {key}: {value} is no text; write it in quotes: {key} = "{value}"')


def _merged(under: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a session says, and the defaults where it says nothing; tables are merged key by key."""
    merged = dict(under)
    for key, value in over.items():
        below = merged.get(key)
        merged[key] = _merged(below, value) if isinstance(below, Mapping) and isinstance(value, Mapping) else value
    return merged


def _row(document: SessionDocument, place: str, path: Path) -> ManifestRow:
    where = f"{path}: {place} ({document.vehicle})"
    recordings = (document.recording,) if isinstance(document.recording, str) else document.recording
    if not recordings or not all(recordings):
        raise InputError(f"{where}: recording: names no file; give one or more")
    for name in document.exports:
        try:
            format_named(name)
        except CalibrationError as error:
            raise InputError(f"{where}: exports: {error}") from None
    folder = path.parent
    session = document.session or Path(recordings[0]).stem
    for key, name in (("vehicle", document.vehicle), ("session", session)):
        require_name(name, f"{where}: {key}")
    for key in ("vehicle_type", "radar_serial", "camera_serial"):
        if (text := getattr(document, key)) is not None:
            require_label(text, f"{where}: {key}")
    return ManifestRow(
        document.vehicle,
        session,
        tuple(folder / name for name in recordings),
        vehicle_type=document.vehicle_type,
        radar_serial=document.radar_serial,
        camera_serial=document.camera_serial,
        clicks=_path(folder, document.clicks),
        auto=document.auto,
        camera=_path(folder, document.camera),
        boxes=_path(folder, document.boxes),
        topics=document.topics,
        options=_options(document, where),
        exports=document.exports,
        rescale_camera=document.rescale_camera,
        reflector_m=document.reflector_m,
        place=place,
    )


def _path(folder: Path, name: str | None) -> Path | None:
    return folder / name if name else None


def _options(document: SessionDocument, where: str) -> CalibrationOptions:
    """Return the options of a session with the position of its camera.

    Raises:
        InputError: an option is unknown or out of range, or there is a standard deviation of no position.
    """
    position = document.camera_position_m
    if position is None and document.camera_position_sigma_m is not None:
        raise InputError(f"{where}: camera_position_sigma_m: there is no camera_position_m; give it, too")
    try:
        options = options_from_tree(document.options)
    except CalibrationError as error:
        raise InputError(f"{where}: {error}") from None
    if position is None:
        return options
    prior = CameraPositionPrior(position)
    if document.camera_position_sigma_m is not None:
        prior = CameraPositionPrior(position, document.camera_position_sigma_m)
    if not 0.0 < prior.sigma_m < 10.0 or not all(abs(value) < 100.0 for value in position):
        raise InputError(f"{where}: camera_position_m: give meters, and a standard deviation above 0")
    solving = replace(options.solving, camera_position=prior)
    return replace(options, solving=solving)


def _require_different(rows: Sequence[ManifestRow], path: Path) -> None:
    """Refuse two rows of one session; names that differ only in capitals would share a folder on some systems."""
    for first, second in _twice(rows):
        raise InputError(
            f"{path}: {first.place} and {second.place} are both session '{second.session}' of vehicle "
            f"'{second.vehicle}'; give each its own session"
        )


def _require_own_recordings(rows: Sequence[ManifestRow], path: Path) -> None:
    """Refuse a recording of two vehicles or sessions: one of the rows names a wrong one.

    Raises:
        InputError: names both rows.
    """
    known: dict[frozenset[Path], ManifestRow] = {}
    for row in rows:
        files = frozenset(one.resolve() for one in row.recording)
        other = known.setdefault(files, row)
        if other is not row:
            raise InputError(
                f"{path}: {other.place} ({other.name}) and {row.place} ({row.name}) have the same recording; name the one that "
                "it is of, or try other options in a manifest with another --out"
            )


def _twice(rows: Sequence[ManifestRow]) -> Iterator[tuple[ManifestRow, ManifestRow]]:
    known: dict[tuple[str, str], ManifestRow] = {}
    for row in rows:
        key = (row.vehicle.casefold(), row.session.casefold())
        if key in known:
            yield known[key], row
        known[key] = row
