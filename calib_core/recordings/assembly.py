"""Assemble a recording: choose topics and clocks, build the streams, collect the warnings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.camera import Camera
from calib_core.errors import RecordingError
from calib_core.geometry import RigidTransform
from calib_core.measurements import NS_PER_S, DataWarning, Stamp, TimeNs
from calib_core.recordings.camera.image_stream import ImageStream, frames_of_one_size, image_stream, video_warnings
from calib_core.recordings.camera.images import ImageLayout
from calib_core.recordings.camera.recorded_intrinsics import published_camera, recorded_camera
from calib_core.recordings.checks import (
    camera_frame_warnings,
    check_overlap,
    claim_warnings,
    image_warnings,
    lost_message_warnings,
    posed_cloud_warnings,
    radar_warnings,
    without_certain_zone,
)
from calib_core.recordings.containers.sources import Assumption, Source, assumption_warnings
from calib_core.recordings.field_words import parse_column_map
from calib_core.recordings.frame_transforms import recorded_mount
from calib_core.recordings.messages.decoding import Message
from calib_core.recordings.plain_files.file_stamps import COUNTED
from calib_core.recordings.plain_files.folder_cameras import FolderCamera
from calib_core.recordings.plain_files.source import PlainSource
from calib_core.recordings.radar.column_plan import StatedReading, parse_radar_axes
from calib_core.recordings.radar.layouts import layouts_of_parts
from calib_core.recordings.radar.merging import MergedStream
from calib_core.recordings.radar.message_layouts.single_returns import PointLayout
from calib_core.recordings.radar.returns_origin import ReturnsOrigin, mount_of, named_origin, origin_of, sampled
from calib_core.recordings.radar.scan_stream import RadarStream
from calib_core.recordings.radar.sensors import RadarSensor, other_azimuths
from calib_core.recordings.selection import (
    Inventory,
    Need,
    RadarChoice,
    RecordingOptions,
    Selection,
    Usage,
    choose_radar,
    image_choice,
    select,
    usage_of,
)
from calib_core.recordings.time.clock_choice import ClockChoice, Stamps, choose_clock, choose_clocks
from calib_core.recordings.time.clock_diagnosis import ClockDiagnosis, clock_warnings, diagnose
from calib_core.recordings.topics import BOX_LAYOUT, Rhythm, StampedTopic, Topic, TopicSummary, join_topics, read_stamps

_MOST_LATE_S = 1e10


@dataclass(frozen=True, slots=True, eq=False)
class Assembly:
    """Everything a Recording provides, under the same attribute names."""

    topics: tuple[TopicSummary, ...]
    radar_topics: tuple[str, ...]
    radar_sensors: tuple[RadarSensor, ...]
    radar_choice: str
    image_choice: str
    image_topic: str | None
    camera_info_topic: str | None
    radar_frame: str
    camera_frame: str
    radar: RadarStream | MergedStream | None
    images: ImageStream | None
    camera: Camera | None
    warnings: tuple[DataWarning, ...]
    assumptions: tuple[Assumption, ...]
    confirmed: bool
    column_map: tuple[str, ...]
    radar_late_s: float
    returns_origin: ReturnsOrigin | None

    @property
    def used(self) -> frozenset[str]:
        """The topics whose messages are read."""
        return frozenset((*self.radar_topics, *((self.image_topic,) if self.image_topic is not None else ())))

    @property
    def clocks(self) -> Mapping[str, Literal["header", "receive"]]:
        """The clock of each of these topics."""
        return {topic.name: topic.clock for topic in self.topics if topic.name in self.used}


def assemble(
    paths: Sequence[Path],
    sources: tuple[Source, ...],
    options: RecordingOptions,
    require: Sequence[Need],
    before: Assembly | None = None,
) -> Assembly:
    """Choose topics and clocks and build the streams.

    Args:
        paths: as the user gave them, for messages.
        sources: the open files.
        options: topics and clock asked for.
        require: what the recording must have; if both, they must also overlap in time.
        before: of the same recording when its files were shorter: its choices stay, and only the streams are built again.

    Raises:
        RecordingError: the recording lacks what the options ask for.
    """
    name = " + ".join(str(path) for path in paths)
    if not abs(options.radar_late) <= _MOST_LATE_S:
        raise RecordingError(f"--radar-late {options.radar_late:g}: give seconds, at most {_MOST_LATE_S:.0e}")
    topics, repeated = join_topics(sources, before.used if before else None)
    warnings = [warning for source in sources for warning in source.warnings] + list(repeated)
    if not any(len(topic) for topic in topics) and require:
        raise RecordingError(
            f"{name}: contains no messages; check that the recorder was set to record the right topics"
        )
    axes = None if options.radar_axes is None else parse_radar_axes(options.radar_axes)
    stated = StatedReading(parse_column_map(options.map), axes)
    usages = {topic.name: _usage(topic, stated) for topic in topics}
    inventory = Inventory(name, topics, usages)
    selection = select(inventory, options, require)
    stamped = _stamped(selection, inventory)
    choice = _radar_choice(selection, stamped, inventory)
    by_name = {topic.name: topic for topic in selection.radars}
    radars = choice.sensors[0].topics if choice.sensors else tuple(by_name)[:1]  # without a choice, the only one
    used = _Used(tuple(by_name[name] for name in radars), selection.image, selection.camera_info)
    lost = [
        warning for topic in used.all for warning in lost_message_warnings(topic.name, len(topic), stamped[topic.name])
    ]
    used = used.readable(stamped)
    clocks, stamps, about_choice = _clocks(used, stamped, inventory, options, before)
    warnings.extend([*lost, *choice.warnings, *about_choice])
    parts = [_topic_stream(topic, inventory, stamps[topic.name], stamped[topic.name].heads) for topic in used.radars]
    origin = before.returns_origin if before is not None else _returns_origin(parts, topics, options)
    radar = _radar_stream(parts, choice, None if origin is None else origin.moved_by)
    images, about_sizes = frames_of_one_size(_image_stream(used.image, inventory, stamps))
    if before is not None:
        return replace(before, radar=radar, images=images)
    warnings.extend(about_sizes)
    zoneless = {s.channel.topic for s in sources if isinstance(s, PlainSource) and s.zoneless}
    warnings.extend(check_overlap(name, radar, images, required=len(require) == 2, zoneless=zoneless))
    diagnoses = _diagnoses(stamped, (*(radar.parts if radar else ()), images), clocks, inventory, options)
    warnings.extend(clock_warnings(list(diagnoses.values())))
    camera, about_camera = recorded_camera(selection.camera_info, images)
    beside = _camera_beside(sources, selection)
    if beside is not None and images is not None:
        camera, about_camera = published_camera(beside, images)
    warnings.extend(
        [
            *about_camera,
            *radar_warnings(radar),
            *(warning for part in (radar.parts if radar else ()) for warning in claim_warnings(part)),
            *image_warnings(images),
            *video_warnings(images),
        ]
    )
    warnings.extend(() if origin is None else origin.warnings)
    for topic in used.radars[:1]:
        warnings.extend(posed_cloud_warnings(topic))
    if used.image is not None and used.camera_info is not None and camera is not None and beside is None:
        warnings.extend(camera_frame_warnings(used.camera_info.name, _frame(used.camera_info), _frame(used.image)))
    assumptions = without_certain_zone(_assumptions(sources, used, radar), radar, images)
    unconfirmed = () if options.confirm_assumptions else assumptions
    warnings.extend(assumption_warnings(unconfirmed))
    return Assembly(
        topics=tuple(_summary(topic, inventory, used, stamps, diagnoses.get(topic.name)) for topic in topics),
        radar_topics=tuple(topic.name for topic in used.radars),
        radar_sensors=choice.sensors,
        radar_choice=choice.reason,
        image_choice=image_choice(inventory, selection.image, options.image_topic),
        image_topic=used.image.name if used.image else None,
        camera_info_topic=used.camera_info.name if used.camera_info else str(beside.file) if beside else None,
        radar_frame="" if origin is None else origin.frame if origin.moved_by is None else origin.radar_frame,
        camera_frame=_frame(used.image) or _frame(used.camera_info),
        radar=radar,
        images=images,
        camera=camera,
        warnings=tuple(warnings),
        assumptions=assumptions,
        confirmed=options.confirm_assumptions,
        column_map=tuple(one.words for one in stated.column_map),
        radar_late_s=options.radar_late,
        returns_origin=origin,
    )


def _camera_beside(sources: Sequence[Source], selection: Selection) -> FolderCamera | None:
    """Return the intrinsics that a data set publishes for the images in use; a camera-info topic takes precedence."""
    image = selection.image
    if image is None or selection.camera_info is not None:
        return None
    mine = (s for s in sources if isinstance(s, PlainSource) and s.channel.topic == image.name)
    return next((source.camera for source in mine), None)


@dataclass(frozen=True, slots=True, eq=False)
class _Used:
    """The topics in use: the radar's, the first one with the most returns, and the camera's."""

    radars: tuple[Topic, ...]
    image: Topic | None
    camera_info: Topic | None

    @property
    def all(self) -> tuple[Topic, ...]:
        """Those of the radar and the camera."""
        return (*self.radars, *((self.image,) if self.image is not None else ()))

    def readable(self, stamped: Mapping[str, StampedTopic]) -> "_Used":
        """Leave out the unreadable messages."""
        radars = tuple(stamped[topic.name].topic for topic in self.radars)
        return replace(self, radars=radars, image=stamped[self.image.name].topic if self.image else None)


def _usage(topic: Topic, stated: StatedReading) -> Usage:
    """Determine what a topic can be used for; a file whose reader has applied the user's --map is read as it is."""
    mapped = any(isinstance(source, PlainSource) and source.mapped for source, _ in topic.parts)
    return usage_of(topic, replace(stated, column_map=()) if mapped else stated)


def _assumptions(
    sources: Sequence[Source], used: _Used, radar: RadarStream | MergedStream | None
) -> tuple[Assumption, ...]:
    """Return what the files of the topics in use and the radar's messages do not state."""
    names = {topic.name for topic in used.all}
    stated = [assumption for source in sources for assumption in source.assumptions if assumption.topic in names]
    parts = radar.parts if radar else ()
    found = (
        replace(assumption.assumption, topic=part.topic.name)
        for part in parts
        for assumption in part.layout.plan.assumptions
    )
    return (*stated, *dict.fromkeys(found))


def _stamped(selection: Selection, inventory: Inventory) -> Mapping[str, StampedTopic]:
    """Read the stamps of the topics to choose from, by name."""
    wanted = [*selection.radars, *((selection.image,) if selection.image is not None else ())]
    stamped = read_stamps([(topic, _head_bytes(inventory.usages[topic.name])) for topic in wanted])
    return {topic.name: both for topic, both in zip(wanted, stamped, strict=True)}


def _radar_choice(selection: Selection, stamped: Mapping[str, StampedTopic], inventory: Inventory) -> RadarChoice:
    """Compare the radar topics, each by its own clock, and choose those of one radar."""
    streams, frames, by_stamps = [], [], []
    for topic in selection.radars if len(selection.radars) > 1 else ():
        both = stamped[topic.name]
        if selection.radar_named:
            lost_message_warnings(topic.name, len(topic), both)  # what the user named must be readable
        if len(both.topic):
            stamps = _both_clocks(both, inventory)
            clock = choose_clock(stamps).clocks[0]
            times_ns = _times(stamps, clock)
            by_stamps.append(clock == "header")
            streams.append(_topic_stream(both.topic, inventory, times_ns, both.heads))
            frames.append(_frame(both.topic))
    return choose_radar(streams, frames, by_stamps, inventory, selection)


def _head_bytes(usage: Usage) -> int:
    return usage.radar.group_bytes if isinstance(usage.radar, PointLayout) else 12


def _both_clocks(both: StampedTopic, inventory: Inventory) -> Stamps:
    return both.clocks(inventory.usages[both.topic.name].distinct_times)


def _clocks(
    used: _Used,
    stamped: Mapping[str, StampedTopic],
    inventory: Inventory,
    options: RecordingOptions,
    before: Assembly | None,
) -> tuple[Mapping[str, Literal["header", "receive"]], Mapping[str, TimesNs], tuple[DataWarning, ...]]:
    """Choose the clock of the radar, all of whose topics share it, and of the camera; return clocks and times by topic."""
    read = {topic.name: _both_clocks(stamped[topic.name], inventory) for topic in used.all}
    if options.radar_late:
        late_ns = round(options.radar_late * NS_PER_S)
        read |= {topic.name: read[topic.name].earlier(late_ns) for topic in used.radars}
    if options.clock == "header":
        for both in read.values():
            if both.header_ns is None:
                raise RecordingError(f"topic {both.topic} has no stamps; use the receive times: --clock receive")
    sensors = [read[topic.name] for topic in (*used.radars[:1], *((used.image,) if used.image is not None else ()))]
    if before is not None:
        choice = ClockChoice(tuple(before.clocks[both.topic] for both in sensors), ())
    elif len(sensors) == 2:
        choice = choose_clocks(sensors[0], sensors[1], options.clock)
    else:
        choice = choose_clock(sensors[0], options.clock) if sensors else ClockChoice((), ())
    clocks = dict(zip((both.topic for both in sensors), choice.clocks, strict=True))
    for topic in used.radars[1:]:
        clocks[topic.name] = clocks[used.radars[0].name]
    stamps = {name: _times(both, clocks[name]) for name, both in read.items()}
    return clocks, stamps, choice.warnings


def _diagnoses(
    stamped: Mapping[str, StampedTopic],
    streams: Sequence[RadarStream | ImageStream | None],
    clocks: Mapping[str, Literal["header", "receive"]],
    inventory: Inventory,
    options: RecordingOptions,
) -> Mapping[str, ClockDiagnosis]:
    """Diagnose the clocks of the topics in use."""
    found = {}
    for stream in streams:
        if stream is not None:
            name = stream.topic.name
            found[name] = diagnose(
                _both_clocks(stamped[name], inventory),
                times_ns=stream.times_ns,
                chosen=clocks[name],
                requested=options.clock,
                one_per_return=isinstance(stream, RadarStream) and isinstance(stream.layout, PointLayout),
                times_from=times_from(stream.topic),
            )
    return found


def _times(both: Stamps, clock: str) -> TimesNs:
    """Return the times of a topic; isolated zero stamps are replaced by the receive time less the median delay."""
    if clock == "receive" or both.header_ns is None:
        return both.receive_ns
    missing = both.header_ns == 0
    if not missing.any() or missing.all():
        return both.header_ns
    delay = int(np.median((both.receive_ns - both.header_ns)[~missing]))
    return np.where(missing, both.receive_ns - delay, both.header_ns)


def _returns_origin(
    parts: Sequence[RadarStream], topics: Sequence[Topic], options: RecordingOptions
) -> ReturnsOrigin | None:
    """Judge whose frame the returns of the radar in use are in; None without one."""
    if not parts:
        return None
    topic, frame, stated = parts[0].topic, _frame(parts[0].topic), options.radar_mount
    body = named_origin(frame) == "body" or options.radar_frame == "body"
    if stated is not None and not np.isfinite(stated).all():
        raise RecordingError(
            f"--radar-mount {' '.join(map(str, stated))}: give x y z in meters, then roll pitch yaw in degrees"
        )
    mounted = (
        (mount_of(stated), "") if stated is not None else recorded_mount(topics, frame, radar=topic.name, body=body)
    )
    mount, radar_frame = mounted or (None, "")
    return origin_of(sampled(parts[0]), frame, mount, radar_frame=radar_frame, stated=options.radar_frame)


def _radar_stream(
    parts: Sequence[RadarStream], choice: RadarChoice, mount: RigidTransform | None
) -> RadarStream | MergedStream | None:
    """Build the stream of the radar in use, of one topic or of several, as seen from its mount if that is given."""
    parts = [part if mount is None else part.seen_from(mount) for part in parts]
    repeats = list(choice.sensors[0].repeats) if choice.sensors else list(range(len(parts)))
    for index, part in enumerate(tuple(parts)):
        others = other_azimuths(part)
        parts.extend(others)
        repeats.extend([repeats[index]] * len(others))
    if len(parts) < 2:
        return parts[0] if parts else None
    return MergedStream(parts, repeats)


def _topic_stream(topic: Topic, inventory: Inventory, times_ns: TimesNs, heads: np.ndarray) -> RadarStream:
    first = inventory.usages[topic.name].radar
    assert first is not None, "a topic to choose from has a layout"
    layouts = layouts_of_parts(first, [topic.definition(number) for number in range(len(topic.parts))])
    return RadarStream(topic, layouts, times_ns, heads, is_timed=times_from(topic) != COUNTED)


def _image_stream(topic: Topic | None, inventory: Inventory, stamps: Mapping[str, TimesNs]) -> ImageStream | None:
    if topic is None:
        return None
    layouts = [ImageLayout(topic.definition(number), topic.name) for number in range(len(topic.parts))]
    return image_stream(topic, layouts, stamps[topic.name])


def _frame(topic: Topic | None) -> str:
    """Read the frame_id of a topic's first message."""
    if topic is None or not len(topic):
        return ""
    try:
        message = topic.message(0)
    except RecordingError:
        return ""
    header = message.values.get("header", message)
    frame = header["frame_id"] if isinstance(header, Message) and "frame_id" in header else ""
    return str(frame).lstrip("/")


def times_from(topic: Topic) -> str:
    """Return where the times of a topic made of files come from; "" if its messages state them."""
    source = topic.parts[0][0]
    return source.times_from if isinstance(source, PlainSource) else ""


def _computed(topic: Topic) -> str:
    source = topic.parts[0][0]
    return source.computed if isinstance(source, PlainSource) else ""


def _layout(topic: Topic, usage: Usage) -> str:
    if usage.boxes is not None:
        return f"{BOX_LAYOUT}, {usage.boxes.name}"
    return "; ".join(filter(None, (usage.radar.description, _computed(topic)))) if usage.radar else ""


def _summary(
    topic: Topic,
    inventory: Inventory,
    used: _Used,
    stamps: Mapping[str, TimesNs],
    diagnosis: ClockDiagnosis | None,
) -> TopicSummary:
    usage = inventory.usages[topic.name]
    times = stamps.get(topic.name, topic.receive_ns)
    rhythm = Rhythm() if times_from(topic) == COUNTED else Rhythm.of(times)
    return TopicSummary(
        name=topic.name,
        type=topic.type,
        count=len(topic),
        kind=usage.kind,
        start=Stamp.of(TimeNs(int(times.min()))) if len(times) else None,
        end=Stamp.of(TimeNs(int(times.max()))) if len(times) else None,
        clock=diagnosis.chosen if diagnosis else "receive",
        problem=usage.problem,
        chosen=any(t and t.name == topic.name for t in (*used.all, used.camera_info)),
        layout=_layout(topic, usage),
        rate_hz=rhythm.rate_hz,
        longest_gap_s=rhythm.longest_gap_s,
        jitter_s=rhythm.jitter_s,
        clocks=diagnosis,
    )
