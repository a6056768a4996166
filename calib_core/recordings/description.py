"""The text that `cocalib info` prints."""

from collections.abc import Iterable, Sequence

from calib_core.measurements import Stamp
from calib_core.recordings.radar.several_topics.sensors import RadarSensor
from calib_core.recordings.recording import Recording
from calib_core.recordings.summary import (
    CameraSummary,
    RadarSummary,
    RecordingSummary,
    recording_summary,
)
from calib_core.recordings.time.clock_diagnosis import ClockDiagnosis
from calib_core.recordings.time.written_times import span_text, utc
from calib_core.recordings.topics import TopicSummary

_CLOCKS = {"header": "stamps", "receive": "receive times"}
_USE = {"radar": "radar", "image": "camera", "camera-info": "intrinsics"}


def describe(recording: Recording) -> str:
    """Describe an open recording as text."""
    return summary_text(recording_summary(recording))


def summary_text(summary: RecordingSummary) -> str:
    """Format a summary as text: one fact per line, numbers with units, warnings last."""
    lines = [
        *_labelled(
            "files", _columns([(f.name, size_text(f.size_bytes), f.container) for f in summary.files], right={1})
        ),
        *_times(summary),
        "",
        *_topic_table(summary.topics),
        "",
        *_labelled("clocks", _clocks(summary.topics)),
        *_labelled("radar", _radar(summary.radar)),
        *_labelled("radars", _sensors(summary)),
        *_labelled("camera", _camera(summary.camera)),
        *_labelled("boxes", _boxes(summary.topics)),
    ]
    confirmed = [one.assumption.text for one in summary.assumptions if one.confirmed]
    lines.extend(_labelled("confirmed", [f"{text}." for text in confirmed]))
    if summary.warnings:
        lines.append("")
        for warning in summary.warnings:
            lines.extend(_labelled("warning", [f"{warning.message}.", f"{warning.hint}. [{warning.code}]"]))
    return "\n".join(line.rstrip().replace("\n", "\\u000a") for line in lines)  # a name may hold a line feed


def _counted(count: int, what: str) -> str:
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
    lines.append(f"{_counted(sum(counts), 'message')} in {_counted(len(counts), 'topic')}")
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
                "" if topic.rate_hz is None else f"{topic.rate_hz:.1f} Hz",
                "" if topic.longest_gap_s is None else f"{topic.longest_gap_s:.3f} s",
                "" if topic.jitter_s is None else f"{topic.jitter_s * 1e3:.1f} ms",
                _CLOCKS[topic.clock] if topic.chosen and topic.clocks is not None else "",
            )
        )
    lines = list(_columns(rows, right={3, 4, 5, 6}))
    problems = [
        topic.problem if topic.name in topic.problem else f"{topic.name}: {topic.problem}"
        for topic in topics
        if topic.problem and topic.problem != "no messages"
    ]
    return [*lines, *(line for problem in problems for line in ("", *_labelled("problem", [problem])))]


def _clocks(topics: Sequence[TopicSummary]) -> list[str]:
    """List for each topic which clock is used and why, and what is known about both clocks."""
    lines = []
    for topic in topics:
        if topic.clocks is not None:
            first, *others = clock_lines(topic.clocks)
            lines.append(f"{topic.name}: {'' if topic.chosen else 'not in use; '}{first}")
            lines.extend(f"  {line}" for line in others)
    return lines


def clock_lines(found: ClockDiagnosis) -> tuple[str, ...]:
    """Describe which clock a topic uses and why, and in a second line, if needed, what is known about both clocks."""
    used = {"header": "header stamps", "receive": "the recorder's receive times"}[found.chosen]
    about = []
    if found.delay_s == 0 and found.delay_jitter_s == 0:
        about.append("the recorder's receive times are equal to the stamps")
    elif found.delay_s is not None:
        jitter = f"± {(found.delay_jitter_s or 0) * 1e3:.1f} ms"
        about.append(f"the recorder received each message {_delay_text(found.delay_s)} its stamp ({jitter})")
    about.extend(found.remarks)
    return (f"times are {used}, because {found.reason}", *(["; ".join(about)] if about else []))


def _delay_text(delay_s: float) -> str:
    near = abs(delay_s) < 2
    span = f"{abs(delay_s) * 1e3:.1f} ms" if near else span_text(delay_s)
    return f"{span} {'after' if delay_s >= 0 else 'before'}"


def _radar(radar: RadarSummary | None) -> list[str]:
    if radar is None:
        return ["no readable topic"]
    low, middle, high = radar.returns_per_scan
    rate = "" if radar.rate_hz is None else f" at {radar.rate_hz:.1f} Hz"
    gap = "" if radar.longest_gap_s is None else f", longest gap {radar.longest_gap_s:.3f} s"
    sample = "" if radar.sampled_scans >= radar.scans else f", from {radar.sampled_scans} scans"
    twice = ", each at every azimuth reported for it" if radar.other_azimuths else ""
    return [
        f"{' + '.join(radar.topics)}, frame '{radar.frame}': {_counted(radar.scans, 'scan')}{rate}{gap}",
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
    for place, sensor in enumerate(summary.sensors):
        figures = sensor.figures
        rows.append(
            (
                "" if place else "yes",
                sensor.name,
                sensor.frame,
                f"{figures.returns_per_scan:.0f}",
                "" if figures.rate_hz is None else f"{figures.rate_hz:.1f} Hz",
                f"{figures.nearest_m:.1f} to {figures.farthest_m:.1f} m",
                "no Doppler" if figures.static_share is None else f"{100.0 * figures.static_share:.0f} %",
                _topics_of(sensor),
            )
        )
    return [*_columns(rows, right={3, 4, 5, 6}), summary.radar.choice]


def _topics_of(sensor: RadarSensor) -> str:
    second = [f"{name} (other azimuths)" for place, name in enumerate(sensor.topics) if sensor.repeats[place] != place]
    own = [name for place, name in enumerate(sensor.topics) if sensor.repeats[place] == place]
    return ", ".join([*own, *second, *(f"{name} (the same returns, not read)" for name in sensor.copies)])


def _readings(radar: RadarSummary) -> list[str]:
    """List what was taken for what, unless it is all as ROS or the registry defines it."""
    if not any(one.why.startswith(("unit:", "--map", "only")) or one.unit == "not stated" for one in radar.columns):
        return []
    rows = [("quantity", "read from", "unit", "grows", "known by")]
    rows += [(one.quantity, one.column, one.unit, one.sign, one.why) for one in radar.columns]
    return list(_columns(rows))


def _camera(camera: CameraSummary | None) -> list[str]:
    if camera is None:
        return ["no readable topic"]
    rate = "" if camera.rate_hz is None else f" at {camera.rate_hz:.1f} Hz"
    gap = "" if camera.longest_gap_s is None else f", longest gap {camera.longest_gap_s:.3f} s"
    size = "the first image cannot be read"
    if camera.width_px is not None:
        size = f"{camera.width_px} x {camera.height_px} px, {camera.format}"
    return [
        f"{camera.topic}, frame '{camera.frame}': {_counted(camera.frames, 'image')}{rate}{gap}",
        size,
        _intrinsics(camera),
    ]


def _boxes(topics: Sequence[TopicSummary]) -> list[str]:
    """List the topics that can be given as --boxes."""
    return [f"{one.name}: {one.layout}, {_counted(one.count, 'message')}" for one in topics if one.has_boxes]


def _intrinsics(camera: CameraSummary) -> str:
    if camera.matrix_px is None or camera.distortion is None:
        return (
            "no usable intrinsics in the recording: give them with --camera FILE, "
            "or calibrate the lens from pictures of a board (cocalib intrinsics)"
        )
    k = camera.matrix_px
    lens = ", ".join(f"{value:.5g}" for value in camera.distortion)
    return (
        f"{camera.model} from {camera.camera_info_topic}: fx {k[0][0]:.2f} fy {k[1][1]:.2f} "
        f"cx {k[0][2]:.2f} cy {k[1][2]:.2f} px" + (f"; distortion {lens}" if lens else "")
    )


def _columns(rows: Sequence[Sequence[str]], *, right: frozenset[int] | set[int] = frozenset()) -> Iterable[str]:
    """Pad cells to align the columns."""
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
