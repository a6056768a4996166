"""The contents of a recording as plain values and as text, for `cocalib info --json` and `cocalib info`."""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import msgspec
import numpy as np

from calib_core.arrays import TimesNs
from calib_core.errors import RecordingError
from calib_core.input_files import name_text
from calib_core.measurements import NS_PER_S, Stamp, TimeNs
from calib_core.recordings.assembly import times_from
from calib_core.recordings.containers.sources import StatedAssumption
from calib_core.recordings.radar.column_plan import ColumnReading
from calib_core.recordings.radar.message_layouts.single_returns import PointLayout, first_of_scans
from calib_core.recordings.radar.sensors import RadarSensor
from calib_core.recordings.recording import Recording
from calib_core.recordings.selection import usage_of
from calib_core.recordings.time.clock_choice import choose_clock
from calib_core.recordings.time.clock_diagnosis import ClockDiagnosis, diagnose
from calib_core.recordings.time.written_times import span_text, utc
from calib_core.recordings.topics import Rhythm, StampedTopic, TopicSummary, join_topics, read_stamps
from calib_core.words.outcomes import WarningText, warning_text

_GAP_PERIODS = 5.0
_STRETCH_GAP_NS = NS_PER_S
_SAMPLED_SCANS = 200
_STAMP_BYTES = 12
_KINDS = ("radar", "image")
_SLOWEST_HZ = 0.1
"""What is slower is no film."""
_CLOCKS = {"header": "stamps", "receive": "receive times"}
_USE = {"radar": "radar", "image": "camera", "camera-info": "intrinsics"}


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
        choice: why it is used; "" if there is no other.
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
    choice: str
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
    warnings: tuple[WarningText, ...]
    assumptions: tuple[StatedAssumption, ...] = ()


def recording_summary(recording: Recording) -> RecordingSummary:
    """Summarize an open recording; reads a few radar scans, one image, and the stamps of other usable topics."""
    used = [topic for topic in recording.topics if topic.chosen and topic.kind in ("radar", "image")]
    timed = used or recording.topics
    start = min((topic.start.time for topic in timed if topic.start is not None), default=None)
    end = max((topic.end.time for topic in timed if topic.end is not None), default=None)
    radar, images = recording.radar_times, recording.image_times
    shared = shared_time(radar, images) if len(radar) and len(images) else None
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
        warnings=tuple(map(warning_text, recording.warnings)),
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


def _radar(recording: Recording) -> RadarSummary | None:
    topic = _topic(recording, recording.radar_topic)
    times = recording.radar_times
    if topic is None or not len(times):
        return None
    places = np.unique(np.linspace(0, len(times) - 1, min(_SAMPLED_SCANS, len(times))).astype(int))
    stamps = np.unique(times[places])
    scans = [recording.radar_scans(TimeNs(int(stamp)), TimeNs(int(stamp))) for stamp in stamps]
    counts = np.concatenate([np.diff(scan.first_return) for scan in scans])
    rhythm = Rhythm() if topic.rate_hz is None else Rhythm.of(times)
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


def _topic(recording: Recording, name: str | None) -> TopicSummary | None:
    return next((topic for topic in recording.topics if topic.name == name), None)


def _camera(recording: Recording) -> CameraSummary | None:
    topic = _topic(recording, recording.image_topic)
    if recording.image_topic is None or topic is None or not len(recording.image_times):
        return None
    try:
        image, kind = recording.image_bytes(0), recording.recorded_format(0)
    except RecordingError:
        image, kind = None, None
    camera = recording.camera()
    rhythm = Rhythm() if topic.rate_hz is None else Rhythm.of(recording.image_times)
    return CameraSummary(
        topic=recording.image_topic,
        choice=recording.image_choice,
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
    told = times_from(both.topic)
    diagnosis = diagnose(
        stamps, times_ns=scans, chosen=clock, requested="auto", one_per_return=one_per_return, times_from=told
    )
    rhythm = Rhythm() if diagnosis.is_assumed else Rhythm.of(times)
    return replace(
        topic,
        start=Stamp.of(TimeNs(int(times.min()))),
        end=Stamp.of(TimeNs(int(times.max()))),
        clock=clock,
        rate_hz=rhythm.rate_hz,
        longest_gap_s=rhythm.longest_gap_s,
        jitter_s=rhythm.jitter_s,
        clocks=diagnosis,
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


def describe(recording: Recording) -> str:
    """Describe an open recording as text."""
    return summary_text(recording_summary(recording))


def summary_text(summary: RecordingSummary) -> str:
    """Format a summary as text: one fact per line, numbers with units, warnings last."""
    lines = [
        *_labelled(
            "files", table_lines([(f.name, size_text(f.size_bytes), f.container) for f in summary.files], right={1})
        ),
        *_times(summary),
        "",
        *_topic_table(summary.topics),
        "",
        *_labelled("clocks", _clocks(summary.topics)),
        *_labelled("radar", _radar_lines(summary.radar)),
        *_labelled("radars", _sensors(summary)),
        *_labelled("camera", _camera_lines(summary.camera)),
        *_labelled("boxes", _boxes(summary.topics)),
    ]
    confirmed = [assumption.assumption.text for assumption in summary.assumptions if assumption.confirmed]
    lines.extend(_labelled("confirmed", [f"{text}." for text in confirmed]))
    if summary.warnings:
        lines.append("")
        for warning in summary.warnings:
            lines.extend(_labelled("warning", [f"{warning.message}.", f"{warning.hint}. [{warning.code}]"]))
    return "\n".join(line.rstrip().replace("\n", "\\u000a") for line in lines)  # a name may hold a line feed


def _count_text(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"


def _labelled(label: str, lines: Iterable[str]) -> list[str]:
    return [f"{label if not number else '':<9} {line}" for number, line in enumerate(lines)]


def _times(summary: RecordingSummary) -> list[str]:
    if summary.start is None or summary.end is None:
        return _labelled("time", ["no messages"])
    lines = [
        f"{utc(summary.start.time)} to {utc(summary.end.time)}, {duration_text(summary.duration_s)}",
        f"{_seconds(summary.start)} to {_seconds(summary.end)} s since 1970",
    ]
    counts = [topic.count for topic in summary.topics]
    lines.append(f"{_count_text(sum(counts), 'message')} in {_count_text(len(counts), 'topic')}")
    if summary.overlap_s is not None:
        lines.append(_shared_text(summary.overlap_s, summary.overlap_stretches or 0))
    return _labelled("time", lines)


def _shared_text(seconds: float, stretches: int) -> str:
    if not stretches:
        return "radar and camera never have data at the same time"
    pieces = f", in {stretches} stretches" if stretches > 1 else ""
    return f"radar and camera both have data for {duration_text(seconds)}{pieces}"


def _seconds(stamp: Stamp) -> str:
    return f"{stamp.sec}.{stamp.nanosec // 1_000_000:03d}"


def _topic_table(topics: Sequence[TopicSummary]) -> list[str]:
    if not topics:
        return _labelled("topics", ["none"])
    rows = [("used as", "topic", "type", "messages", "rate", "longest gap", "jitter", "times used")]
    for topic in topics:
        rows.append(
            (
                _USE.get(topic.kind, "") if topic.chosen else "",
                topic.name,
                topic.type,
                str(topic.count),
                _rate_text(topic.rate_hz).removeprefix(" at "),
                "" if topic.longest_gap_s is None else f"{topic.longest_gap_s:.3f} s",
                "" if topic.jitter_s is None else f"{topic.jitter_s * 1e3:.1f} ms",
                _times_used(topic),
            )
        )
    lines = list(table_lines(rows, right={3, 4, 5, 6}))
    problems = [
        topic.problem if topic.name in topic.problem else f"{topic.name}: {topic.problem}"
        for topic in topics
        if topic.problem and topic.problem != "no messages"
    ]
    return [*lines, *(line for problem in problems for line in ("", *_labelled("problem", [problem])))]


def _rate_text(rate_hz: float | None) -> str:
    """Describe a rate; of stills, the time between them."""
    if rate_hz is None:
        return ""
    return f" at {rate_hz:.1f} Hz" if rate_hz >= _SLOWEST_HZ else f" {1.0 / rate_hz:.0f} s apart"


def _times_used(topic: TopicSummary) -> str:
    if not topic.chosen or topic.clocks is None:
        return ""
    from_files = topic.clocks.times_from
    return _CLOCKS[topic.clock] if not from_files else "assumed" if topic.clocks.is_assumed else "of the files"


def _clocks(topics: Sequence[TopicSummary]) -> list[str]:
    """List for each topic which clock is used and why, and what is known about both clocks."""
    lines = []
    for topic in topics:
        if topic.clocks is not None:
            first, *others = clock_lines(topic.clocks)
            lines.append(f"{topic.name}: {'' if topic.chosen else 'not in use; '}{first}")
            lines.extend(f"  {line}" for line in others)
    return lines


def clock_lines(diagnosis: ClockDiagnosis) -> tuple[str, ...]:
    """Describe which clock a topic uses and why, and in a second line, if needed, what is known about both clocks."""
    if diagnosis.times_from:
        return (f"times are {diagnosis.times_from}", *(["; ".join(diagnosis.remarks)] if diagnosis.remarks else []))
    used = {"header": "header stamps", "receive": "the recorder's receive times"}[diagnosis.chosen]
    about = []
    if diagnosis.delay_s == 0 and diagnosis.delay_jitter_s == 0:
        about.append("the recorder's receive times are equal to the stamps")
    elif diagnosis.delay_s is not None:
        jitter = f"± {(diagnosis.delay_jitter_s or 0) * 1e3:.1f} ms"
        about.append(f"the recorder received each message {_delay_text(diagnosis.delay_s)} its stamp ({jitter})")
    about.extend(diagnosis.remarks)
    return (f"times are {used}, because {diagnosis.reason}", *(["; ".join(about)] if about else []))


def _delay_text(delay_s: float) -> str:
    near = abs(delay_s) < 2
    span = f"{abs(delay_s) * 1e3:.1f} ms" if near else span_text(delay_s)
    return f"{span} {'after' if delay_s >= 0 else 'before'}"


def _radar_lines(radar: RadarSummary | None) -> list[str]:
    if radar is None:
        return ["no readable topic"]
    low, middle, high = radar.returns_per_scan
    rate = _rate_text(radar.rate_hz)
    gap = "" if radar.longest_gap_s is None else f", longest gap {radar.longest_gap_s:.3f} s"
    sample = "" if radar.sampled_scans >= radar.scans else f", from {radar.sampled_scans} scans"
    twice = ", each at every azimuth reported for it" if radar.other_azimuths else ""
    return [
        f"{' + '.join(radar.topics)}, frame '{radar.frame}': {_count_text(radar.scans, 'scan')}{rate}{gap}",
        f"returns per scan: {middle:.0f} ({low} to {high}{sample}){twice}",
        radar.layout,
        *([f"other azimuths of the same returns: {', '.join(radar.other_azimuths)}"] if radar.other_azimuths else []),
        *_readings(radar),
        *(f"{note}." for note in radar.notes),
    ]


def _sensors(summary: RecordingSummary) -> list[str]:
    """List the radars and their figures if there are several or one has several topics, and why one is used."""
    if summary.radar is None or not summary.radar.choice:
        return []
    rows = [("used", "radar", "frame", "returns a scan", "rate", "range", "static", "topics")]
    for index, sensor in enumerate(summary.sensors):
        figures = sensor.figures
        rows.append(
            (
                "" if index else "yes",
                sensor.name,
                sensor.frame,
                f"{figures.returns_per_scan:.0f}",
                "" if figures.rate_hz is None else f"{figures.rate_hz:.1f} Hz",
                f"{figures.nearest_m:.1f} to {figures.farthest_m:.1f} m",
                "no Doppler" if figures.static_share is None else f"{100.0 * figures.static_share:.0f} %",
                _topics_of(sensor),
            )
        )
    return [*table_lines(rows, right={3, 4, 5, 6}), summary.radar.choice]


def _topics_of(sensor: RadarSensor) -> str:
    second = [f"{name} (other azimuths)" for index, name in enumerate(sensor.topics) if sensor.repeats[index] != index]
    own = [name for index, name in enumerate(sensor.topics) if sensor.repeats[index] == index]
    return ", ".join([*own, *second, *(f"{name} (the same returns, not read)" for name in sensor.copies)])


def _readings(radar: RadarSummary) -> list[str]:
    """List what was taken for what, unless it is all as ROS or the registry defines it."""
    if not any(
        column.why.startswith(("unit:", "--map", "only")) or column.unit == "not stated" for column in radar.columns
    ):
        return []
    rows = [("quantity", "read from", "unit", "grows", "known by")]
    rows += [(column.quantity, column.column, column.unit, column.sign, column.why) for column in radar.columns]
    return list(table_lines(rows))


def _camera_lines(camera: CameraSummary | None) -> list[str]:
    if camera is None:
        return ["no readable topic"]
    rate = _rate_text(camera.rate_hz)
    gap = "" if camera.longest_gap_s is None else f", longest gap {camera.longest_gap_s:.3f} s"
    size = "the first image cannot be read"
    if camera.width_px is not None:
        size = f"{camera.width_px} x {camera.height_px} px, {camera.format}"
    return [
        f"{camera.topic}, frame '{camera.frame}': {_count_text(camera.frames, 'image')}{rate}{gap}",
        size,
        _intrinsics(camera),
        *([camera.choice] if camera.choice else []),
    ]


def _boxes(topics: Sequence[TopicSummary]) -> list[str]:
    """List the topics that can be given as --boxes."""
    return [
        f"{topic.name}: {topic.layout}, {_count_text(topic.count, 'message')}" for topic in topics if topic.has_boxes
    ]


def _intrinsics(camera: CameraSummary) -> str:
    if camera.matrix_px is None or camera.distortion is None:
        return (
            "no usable intrinsics in the recording: give them with --camera FILE, "
            "or calibrate the lens from images of a board (cocalib intrinsics)"
        )
    k = camera.matrix_px
    lens = ", ".join(f"{value:.5g}" for value in camera.distortion)
    return (
        f"{camera.model} from {camera.camera_info_topic}: fx {k[0][0]:.2f} fy {k[1][1]:.2f} "
        f"cx {k[0][2]:.2f} cy {k[1][2]:.2f} px" + (f"; distortion {lens}" if lens else "")
    )


def table_lines(rows: Sequence[Sequence[str]], *, right: Collection[int] = ()) -> Iterator[str]:
    """Yield the lines of a table.

    Args:
        rows: the cells of each, as many in every row; the heads come first.
        right: numbers of the columns that are aligned to the right.
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)] if rows else []
    for row in rows:
        cells = [
            cell.rjust(width) if number in right else cell.ljust(width)
            for number, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        yield "  ".join(cells).rstrip()


def size_text(size_bytes: int) -> str:
    """Format a size in B, kB, MB or GB."""
    size = float(size_bytes)
    for unit in ("B", "kB", "MB", "GB"):
        if size < 1000 or unit == "GB":
            return f"{size:.0f} {unit}" if unit == "B" else f"{size:.1f} {unit}"
        size /= 1000
    raise AssertionError


def duration_text(seconds: float) -> str:
    """Format a duration in seconds, or in minutes and seconds from two minutes on."""
    if seconds < 1:
        return f"{seconds:.3f} s"
    if seconds < 120:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(seconds, 60)
    return f"{int(minutes)} min {rest:04.1f} s"
