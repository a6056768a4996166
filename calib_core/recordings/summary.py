"""The contents of a recording as plain values, for `cocalib info` and `cocalib info --json`."""

from dataclasses import dataclass, replace

import msgspec
import numpy as np

from calib_core.arrays import TimesNs
from calib_core.errors import RecordingError
from calib_core.input_files import name_text
from calib_core.measurements import NS_PER_S, Stamp, TimeNs
from calib_core.recordings.assumptions import StatedAssumption
from calib_core.recordings.radar.column_plan import ColumnReading
from calib_core.recordings.radar.message_layouts.single_returns import PointLayout, first_of_scans
from calib_core.recordings.radar.several_topics.sensors import RadarSensor
from calib_core.recordings.recording import Recording
from calib_core.recordings.stamping import StampedTopic, read_stamps
from calib_core.recordings.time.clock_choice import choose_clock
from calib_core.recordings.time.clock_diagnosis import diagnose
from calib_core.recordings.topics import Rhythm, TopicSummary, join_topics
from calib_core.recordings.usages import usage_of
from calib_core.results import DataWarning

_GAP_PERIODS = 5.0


_STRETCH_GAP_NS = NS_PER_S


_SAMPLED_SCANS = 200


_STAMP_BYTES = 12


_KINDS = ("radar", "image")


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


@dataclass(frozen=True, slots=True)
class SharedTime:
    """When both sensors have data.

    Attributes:
        seconds: total time [s], without gaps of more than five cycles of either sensor.
        stretches: number of stretches, separated by more than a second.
    """

    seconds: float
    stretches: int


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


def with_other_clocks(recording: Recording) -> tuple[TopicSummary, ...]:
    """Return all topics; the times of usable ones that are not in use are by the clock that would be chosen for them.

    Their stamps are read in one pass. Topics whose messages cannot be read are left as they are.
    """
    spare = {
        topic.name: topic
        for topic in recording.topics
        if topic.clocks is None and topic.kind in _KINDS and topic.problem is None and topic.count
    }
    topics = [topic for topic in join_topics(recording.sources)[0] if topic.name in spare] if spare else []
    try:
        stamped = read_stamps([(topic, _STAMP_BYTES) for topic in topics])
    except RecordingError:
        return recording.topics
    timed = {both.topic.name: _timed(spare[both.topic.name], both) for both in stamped if len(both.topic)}
    return tuple(timed.get(topic.name, topic) for topic in recording.topics)


def _timed(topic: TopicSummary, both: StampedTopic) -> TopicSummary:
    usage = usage_of(both.topic)
    one_per_return = isinstance(usage.radar, PointLayout)
    stamps = both.clocks(usage.distinct_times)
    clock = choose_clock(stamps).clocks[0]
    times = both.header_ns if clock == "header" and both.header_ns is not None else both.topic.receive_ns
    scans = np.sort(times[first_of_scans(times)] if one_per_return else times)
    rhythm = Rhythm.of(times)
    return replace(
        topic,
        start=Stamp.of(TimeNs(int(times.min()))),
        end=Stamp.of(TimeNs(int(times.max()))),
        clock=clock,
        rate_hz=rhythm.rate_hz,
        longest_gap_s=rhythm.longest_gap_s,
        jitter_s=rhythm.jitter_s,
        clocks=diagnose(stamps, times_ns=scans, chosen=clock, requested="auto", one_per_return=one_per_return),
    )


def shared_time(a_ns: TimesNs, b_ns: TimesNs) -> SharedTime:
    """Measure the time covered by both series.

    Args:
        a_ns: (n,) stamps, ascending.
        b_ns: (m,) stamps, ascending.
    """
    both = _intersections(_stretches(a_ns), _stretches(b_ns))
    if not len(both):
        return SharedTime(0.0, 0)
    apart = both[1:, 0] - both[:-1, 1] > _STRETCH_GAP_NS
    return SharedTime(float((both[:, 1] - both[:, 0]).sum()) / NS_PER_S, 1 + int(np.count_nonzero(apart)))


def _stretches(times_ns: TimesNs) -> np.ndarray:
    """Return begin and end (k, 2) of each stretch of stamps without a gap of more than five cycles."""
    if not len(times_ns):
        return np.zeros((0, 2), dtype=np.int64)
    steps = np.diff(times_ns)
    moving = steps[steps > 0]
    cut = np.flatnonzero(steps > _GAP_PERIODS * np.median(moving)) if len(moving) else np.zeros(0, dtype=np.int64)
    return np.stack([times_ns[np.append(0, cut + 1)], times_ns[np.append(cut, len(times_ns) - 1)]], axis=1)


def _intersections(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Intersect two ascending lists of intervals (n, 2) and (m, 2)."""
    found = []
    first = second = 0
    while first < len(a) and second < len(b):
        begin, end = max(a[first, 0], b[second, 0]), min(a[first, 1], b[second, 1])
        if begin <= end:
            found.append((begin, end))
        if a[first, 1] <= b[second, 1]:
            first += 1
        else:
            second += 1
    return np.array(found, dtype=np.int64).reshape(-1, 2)
