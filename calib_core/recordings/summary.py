"""The contents of a recording as plain values, for `cocalib info` and `cocalib info --json`."""

from dataclasses import dataclass

import msgspec
import numpy as np

from calib_core.errors import RecordingError
from calib_core.input_files import name_text
from calib_core.measurements import NS_PER_S, Stamp, TimeNs
from calib_core.recordings.assumptions import StatedAssumption
from calib_core.recordings.other_clocks import with_other_clocks
from calib_core.recordings.radar.column_plan import ColumnReading
from calib_core.recordings.radar.several_topics.sensors import RadarSensor
from calib_core.recordings.recording import Recording
from calib_core.recordings.time.shared_time import SharedTime, shared_time
from calib_core.recordings.topics import Rhythm, TopicSummary
from calib_core.results import DataWarning

_SAMPLED_SCANS = 200


@dataclass(frozen=True, slots=True)
class FileSummary:
    """One file of the recording."""

    name: str
    size_bytes: int
    container: str


@dataclass(frozen=True, slots=True)
class RadarSummary:
    """The radar in use.

    Attributes:
        topic: its topic.
        frame: its frame_id.
        layout: what is read from its messages.
        topics: all topics of this radar.
        other_azimuths: topics or columns with other azimuths of its returns, of which at most one is true.
        choice: why it is used, with the figures of the others; "" if there was no choice.
        scans: number of scans.
        rate_hz: scans per second; None with fewer than two.
        longest_gap_s: longest time between scans [s].
        returns_per_scan: minimum, median and maximum over at most 200 scans spread over the recording.
        sampled_scans: number of scans used for returns_per_scan.
        columns: what was taken for what in its messages, and why.
        notes: what else its messages hold.
        column_map: the user's --map.
    """

    topic: str
    frame: str
    layout: str
    topics: tuple[str, ...]
    other_azimuths: tuple[str, ...]
    choice: str
    scans: int
    rate_hz: float | None
    longest_gap_s: float | None
    returns_per_scan: tuple[int, float, int]
    sampled_scans: int
    columns: tuple[ColumnReading, ...] = ()
    notes: tuple[str, ...] = ()
    column_map: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class CameraSummary:
    """The camera in use.

    Attributes:
        topic: its image topic.
        frame: frame_id of the images.
        frames: number of images.
        rate_hz: images per second; None with fewer than two.
        longest_gap_s: longest time between images [s].
        format: as recorded: "jpeg", "png", "raw bgr8", "h264 video"; None if the first cannot be read.
        width_px: of the first image.
        height_px: of the first image.
        camera_info_topic: the source of the intrinsics; None if there are none.
        model: lens model; None if there are no usable intrinsics.
        matrix_px: rows of K.
        distortion: coefficients.
    """

    topic: str
    frame: str
    frames: int
    rate_hz: float | None
    longest_gap_s: float | None
    format: str | None
    width_px: int | None
    height_px: int | None
    camera_info_topic: str | None
    model: str | None
    matrix_px: tuple[tuple[float, ...], ...] | None
    distortion: tuple[float, ...] | None


class RecordingSummary(msgspec.Struct, frozen=True, rename={"warnings": "cautions"}):
    """Everything `cocalib info` shows. In the JSON, the warnings keep the key of version 0.1, "cautions".

    Attributes:
        files: as opened.
        start: first stamp of the topics in use, or of all topics if none is in use.
        end: last stamp of the same topics.
        duration_s: from start to end.
        overlap_s: time for which radar and camera both have data, without gaps of either [s]; None if one is missing.
        overlap_stretches: number of stretches of that time; None if one is missing.
        topics: by name.
        radar: None if there is none.
        sensors: the radars that were compared, the one in use first.
        camera: None if there is none.
        warnings: what the user must know.
        assumptions: what the files do not state and reading them takes for granted.
    """

    files: tuple[FileSummary, ...]
    start: Stamp | None
    end: Stamp | None
    duration_s: float
    overlap_s: float | None
    overlap_stretches: int | None
    topics: tuple[TopicSummary, ...]
    radar: RadarSummary | None
    sensors: tuple[RadarSensor, ...]
    camera: CameraSummary | None
    warnings: tuple[DataWarning, ...]
    assumptions: tuple[StatedAssumption, ...] = ()


def recording_summary(recording: Recording) -> RecordingSummary:
    """Summarize an open recording; reads a few radar scans, one image, and the stamps of other usable topics."""
    used = [topic for topic in recording.topics if topic.chosen and topic.kind in ("radar", "image")]
    timed = used or recording.topics
    start = min((topic.start.time for topic in timed if topic.start is not None), default=None)
    end = max((topic.end.time for topic in timed if topic.end is not None), default=None)
    shared = _shared(recording)
    return RecordingSummary(
        files=files_of(recording),
        start=Stamp.of(start) if start is not None else None,
        end=Stamp.of(end) if end is not None else None,
        duration_s=(end - start) / NS_PER_S if start is not None and end is not None else 0.0,
        overlap_s=shared.seconds if shared is not None else None,
        overlap_stretches=shared.stretches if shared is not None else None,
        topics=with_other_clocks(recording),
        radar=_radar(recording),
        sensors=recording.radar_sensors,
        camera=_camera(recording),
        warnings=recording.warnings,
        assumptions=recording.stated_assumptions,
    )


def files_of(recording: Recording) -> tuple[FileSummary, ...]:
    """Return its files, as opened; of a compressed one the size once decompressed."""
    return tuple(FileSummary(name_text(s.path.name), s.size_bytes, s.container) for s in recording.sources)


def _shared(recording: Recording) -> SharedTime | None:
    radar, images = recording.radar_times, recording.image_times
    return shared_time(radar, images) if len(radar) and len(images) else None


def _radar(recording: Recording) -> RadarSummary | None:
    topic = next((topic for topic in recording.topics if topic.name == recording.radar_topic), None)
    times = recording.radar_times
    if topic is None or not len(times):
        return None
    places = np.unique(np.linspace(0, len(times) - 1, min(_SAMPLED_SCANS, len(times))).astype(int))
    stamps = np.unique(times[places])
    scans = [recording.radar_scans(TimeNs(int(stamp)), TimeNs(int(stamp))) for stamp in stamps]
    counts = np.concatenate([np.diff(scan.first_return) for scan in scans])
    rhythm = Rhythm.of(times)
    return RadarSummary(
        topic=topic.name,
        frame=recording.radar_frame,
        layout=topic.layout,
        topics=recording.radar_topics,
        other_azimuths=recording.other_azimuths,
        choice=recording.radar_choice,
        scans=len(times),
        rate_hz=rhythm.rate_hz,
        longest_gap_s=rhythm.longest_gap_s,
        returns_per_scan=(int(counts.min()), float(np.median(counts)), int(counts.max())),
        sampled_scans=len(counts),
        columns=recording.radar_columns,
        notes=recording.radar_notes,
        column_map=recording.column_map,
    )


def _camera(recording: Recording) -> CameraSummary | None:
    if recording.image_topic is None or not len(recording.image_times):
        return None
    try:
        image, kind = recording.image_bytes(0), recording.recorded_format(0)
    except RecordingError:
        image, kind = None, None
    camera = recording.camera()
    rhythm = Rhythm.of(recording.image_times)
    return CameraSummary(
        topic=recording.image_topic,
        frame=recording.camera_frame,
        frames=len(recording.image_times),
        rate_hz=rhythm.rate_hz,
        longest_gap_s=rhythm.longest_gap_s,
        format=kind,
        width_px=image.width_px if image else None,
        height_px=image.height_px if image else None,
        camera_info_topic=recording.camera_info_topic,
        model=camera.model if camera else None,
        matrix_px=tuple(tuple(float(value) for value in row) for row in camera.matrix_px) if camera else None,
        distortion=tuple(float(value) for value in camera.distortion) if camera else None,
    )
