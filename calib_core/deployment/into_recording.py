"""Write a recording again with its calibration: every message as it was, and what viewers need to draw returns on images."""

import json
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import BinaryIO, Literal

import numpy as np

from calib_core.arrays import Points3
from calib_core.deployment.camera_info import ChosenTopic, InfoTemplate, choose_topic
from calib_core.deployment.placing import SensorFrames, place_transform, read_frames
from calib_core.errors import InputError, RecordingError
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.own.calibration_json import write_calibration
from calib_core.interchange.statement import statement
from calib_core.measurements import NS_PER_S, TimeNs, time_parts
from calib_core.radar import RadarErrors
from calib_core.recordings import Recording
from calib_core.recordings.containers.copying import CopiedFile, Losses, StoredMessage, copied_file, merged_messages
from calib_core.recordings.containers.mcap.writing import ChunkCompression, McapWriter
from calib_core.recordings.containers.sources import Channel, ChannelNotes, MessageIndex, StoredChannel
from calib_core.recordings.containers.writing import CameraInfoMessage, CloudMessage, MessageBuilder, TransformMessage
from calib_core.recordings.frame_transforms import is_transforms
from calib_core.recordings.messages.definitions import with_definition
from calib_core.recordings.messages.foxglove import ros_message
from calib_core.recordings.topics import join_topics
from calib_core.results import Calibration
from calib_core.words.warnings import warning_remark

_PROGRESS_MESSAGES = 256
_MEANING = "transforms are poses of the child in the parent, quaternion x y z w; calibration.json is attached"

_DAMAGE = frozenset({
    "checksum", "damaged-file", "definitions-damaged", "file-left-out", "messages-missing", "missing-file", "not-closed",
    "packed-file-damaged", "repeated-messages", "unknown-records",
})  # fmt: skip

_POINT_PX = 8
_3D_POINT_PX = 5
_NEAR_M, _FAR_M = 0, 60


@dataclass(frozen=True, slots=True)
class RecordingWritten:
    """A summary of what was written.

    Attributes:
        copied: number of messages of the original.
        added: number of messages added, by topic.
        lost: number of messages that could not be read, by topic.
        fault: why the first of those could not.
        notes: what the user must know.
        layout: for Foxglove, as JSON.
    """

    copied: int
    added: Mapping[str, int]
    lost: Mapping[str, int]
    fault: str
    notes: tuple[str, ...]
    layout: str


@dataclass(slots=True)
class _Original:
    """The files to copy, and which of their messages."""

    files: list[CopiedFile] = field(default_factory=list)
    rows: list[dict[int, MessageIndex]] = field(default_factory=list)

    @property
    def channels(self) -> tuple[StoredChannel, ...]:
        return tuple(channel for file in self.files for channel in file.channels.values())

    @property
    def count(self) -> int:
        return sum(len(index) for rows in self.rows for index in rows.values())

    @property
    def profile(self) -> str:
        """What the header states: the original's word, or the encoding that all topics share."""
        stated = {file.profile for file in self.files}
        encodings = {channel.encoding for channel in self.channels}
        named = {frozenset({"ros1"}): "ros1", frozenset({"cdr"}): "ros2"}.get(frozenset(encodings), "")
        return next(iter(stated)) if len(stated) == 1 and "" not in stated else named

    @property
    def compression(self) -> ChunkCompression:
        """Compressed if the original was, so that the size stays about the same."""
        kinds = " ".join(file.source.container for file in self.files)
        return "zstd" if "zstd" in kinds or "bz2" in kinds else "lz4" if "lz4" in kinds else ""


POINTS_TOPIC = "/cocalib/radar_points"
CORRECTED_TOPIC = "/cocalib/radar_points_corrected"
_LAST_STAMP_NS = (2**31 - 1) * NS_PER_S
_NAMES = ("x", "y", "z", "intensity", "velocity")
TRANSFORM_TOPIC = "/tf_static"

_REPEAT_NS = 1_000_000_000
"""A player that starts in the middle sees the transform after a second at most."""

_STAMP = struct.Struct("<II")
_QUALITY = "offered_qos_profiles"
_FOREVER = "{sec: 9223372036, nsec: 854775807}"


@dataclass(frozen=True, slots=True, eq=False)
class CloudTopic:
    """A topic of returns.

    Attributes:
        topic: its name.
        log_time: when to write the message [ns].
        cloud: the message.
    """

    topic: str
    log_time: int
    cloud: CloudMessage


def has_corrections(calibration: Calibration) -> bool:
    """Return whether a calibration knows errors of the radar that no transform can take out."""
    return calibration.angle_map is not None or calibration.radar_errors != RadarErrors()


def clouds(
    recording: Recording, frame: str, *, as_reported: bool, correction: Calibration | None
) -> Iterator[CloudTopic]:
    """Read the returns, a bounded number at a time, in order of time.

    Args:
        recording: with a radar.
        frame: of the returns.
        as_reported: whether to give them as the radar reports them.
        correction: also gives them with this calibration's radar errors and angle map applied; None for no such clouds.
    """
    for scans in recording.radar_windows():
        for number in range(len(scans)):
            scan = scans.scan(number)
            there = np.isfinite(scan.points_radar_m).all(axis=1)
            points_radar_m, rest = scan.points_radar_m[there], (scan.snr_db[there], scan.doppler_mps[there])
            log_time = int(scan.time) + recording.radar_delay_ns
            if as_reported:
                yield CloudTopic(POINTS_TOPIC, log_time, _cloud(scan.time, frame, points_radar_m, *rest))
            if correction is not None:
                corrected_m = _corrected(correction, points_radar_m)
                yield CloudTopic(CORRECTED_TOPIC, log_time, _cloud(scan.time, frame, corrected_m, *rest))


def stampable(time: int) -> TimeNs:
    """Return a time as a stamp of ROS can hold it, from 1970 to 2038; damaged recordings have others."""
    return TimeNs(min(max(time, 0), _LAST_STAMP_NS))


def _corrected(calibration: Calibration, points_radar_m: Points3) -> Points3:
    if not len(points_radar_m):
        return points_radar_m
    corrected_m = calibration.radar_errors.corrected(points_radar_m)
    return corrected_m if calibration.angle_map is None else calibration.angle_map.corrected(corrected_m)


def _cloud(
    time: TimeNs, frame: str, points_radar_m: Points3, snr_db: np.ndarray, doppler_mps: np.ndarray
) -> CloudMessage:
    return CloudMessage(stampable(time), frame, _NAMES, np.column_stack([points_radar_m, snr_db, doppler_mps]))


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """What to add.

    Attributes:
        frames: the frames of the sensors, with the transform to write.
        info: where the intrinsics are.
        calibration: to write.
        stamp_offset: of the image messages' stamp; None if they have none.
        as_reported: whether to write the returns as the radar reports them.
        corrected: whether to write them with the radar's errors taken out.
    """

    frames: SensorFrames
    info: ChosenTopic
    calibration: Calibration
    stamp_offset: int | None
    as_reported: bool
    corrected: bool


@dataclass(slots=True)
class Additions:
    """The added messages, in step with the recorded ones.

    Attributes:
        plan: what to add.
        recording: the open recording.
        build: serialises in the recording's encoding.
        channels: of the recording.
        counts: number of messages written so far, by topic.
    """

    plan: Plan
    recording: Recording
    build: MessageBuilder
    channels: tuple[StoredChannel, ...]
    counts: dict[str, int] = field(default_factory=dict)
    _transform: StoredChannel = field(init=False)
    _info: StoredChannel = field(init=False)
    _template: InfoTemplate = field(init=False)
    _clouds: Iterator[CloudTopic] = field(init=False)
    _cloud: CloudTopic | None = field(init=False)
    _cloud_channels: dict[str, StoredChannel] = field(default_factory=dict)
    _transform_due_ns: int | None = None
    _first_ns: int = 0

    def __post_init__(self) -> None:
        plan = self.plan
        self._transform = self._transform_channel()
        self._info = self.build.channel(plan.info.name, CameraInfoMessage)
        self._template = InfoTemplate(self.build, plan.calibration.camera, plan.frames.camera)
        correction = plan.calibration if plan.corrected else None
        wanted = plan.as_reported or plan.corrected
        self._clouds = (
            clouds(self.recording, plan.frames.radar, as_reported=plan.as_reported, correction=correction)
            if wanted
            else iter(())
        )
        self._cloud = next(self._clouds, None)

    def before(self, message: StoredMessage) -> Iterator[StoredMessage]:
        """Yield what belongs before a recorded message."""
        if self._transform_due_ns is None:  # the transform comes first of all
            self._first_ns = message.log_time
            yield from self._transforms(message.log_time)
        yield from self._due_clouds(message.log_time)
        yield from self._transforms(message.log_time)
        if message.channel.topic == self.recording.image_topic and self.plan.info.written:
            yield self._count_message(self._info, self._template.stamped(self._stamp(message)), message.log_time)

    def rest(self, last_ns: int) -> Iterator[StoredMessage]:
        """Yield what remains after the last recorded message."""
        while self._cloud is not None:
            yield from self._due_clouds(max(last_ns, self._cloud.log_time))

    def _transforms(self, log_time: int) -> Iterator[StoredMessage]:
        if self._transform_due_ns is not None and log_time < self._transform_due_ns:
            return
        self._transform_due_ns = log_time + _REPEAT_NS
        joint = self.plan.frames.joint
        if joint is not None and joint.parent_from_child is not None:
            body = TransformMessage(stampable(log_time), joint.parent, joint.child, joint.parent_from_child)
            yield self._count_message(self._transform, self.build.serialised(body), log_time)

    def _due_clouds(self, log_time: int) -> Iterator[StoredMessage]:
        while self._cloud is not None and self._cloud.log_time <= log_time:
            cloud, topic = self._cloud.cloud, self._cloud.topic
            if topic not in self._cloud_channels:
                self._cloud_channels[topic] = self.build.channel(topic, CloudMessage)
            due_ns = max(self._cloud.log_time, self._first_ns)
            yield self._count_message(self._cloud_channels[topic], self.build.serialised(cloud), due_ns)
            self._cloud = next(self._clouds, None)

    def _count_message(self, channel: StoredChannel, data: bytes, log_time: int) -> StoredMessage:
        number = self.counts[channel.topic] = self.counts.get(channel.topic, 0) + 1
        return StoredMessage(channel, data, log_time, log_time, number)

    def _stamp(self, message: StoredMessage) -> bytes:
        """Return an image's own stamp, which its intrinsics must share, in little-endian words."""
        place = self.plan.stamp_offset
        stored = message.channel
        read_as = Channel(
            0, stored.topic, stored.schema_name, stored.encoding, stored.schema_data.decode("latin-1"), ""
        )
        data = ros_message(read_as, message.data)
        stamp = b"" if place is None else data[place : place + _STAMP.size]
        if len(stamp) < _STAMP.size:
            return _STAMP.pack(*time_parts(stampable(message.log_time)))
        if message.channel.encoding == "cdr" and message.data[1] == 0:
            return stamp[3::-1] + stamp[:3:-1]
        return stamp

    def _transform_channel(self) -> StoredChannel:
        """Return the recording's own channel of static transforms, or one like it."""
        encoding = "ros1" if self.build.generation == 1 else "cdr"
        for channel in self.channels:
            if (channel.topic, channel.encoding) == (TRANSFORM_TOPIC, encoding) and is_transforms(channel.schema_name):
                return channel
        return self.build.channel(TRANSFORM_TOPIC, TransformMessage, latched(self.build.generation, self.channels))


def latched(generation: int, channels: tuple[StoredChannel, ...]) -> ChannelNotes:
    """Return the notes by which players publish a topic for late subscribers too.

    Args:
        generation: of ROS.
        channels: of the recording: bags of ROS 2 before Jazzy write the qualities of service as numbers, later ones as words.
    """
    if generation == 1:
        return (("callerid", "/cocalib"), ("latching", "1"))
    written = [
        value for channel in channels for key, value in channel.notes if key == _QUALITY and "durability" in value
    ]
    numbers = bool(written) and all("durability: 1" in value or "durability: 2" in value for value in written)
    history, reliability, durability, liveliness = (
        ("1", "1", "1", "1") if numbers else ("keep_last", "reliable", "transient_local", "automatic")
    )
    quality = (
        f"- history: {history}\n  depth: 1\n  reliability: {reliability}\n  durability: {durability}\n"
        f"  deadline: {_FOREVER}\n  lifespan: {_FOREVER}\n  liveliness: {liveliness}\n"
        f"  liveliness_lease_duration: {_FOREVER}\n  avoid_ros_namespace_conventions: false\n"
    )
    return ((_QUALITY, quality),)


def write_into_recording(
    recording: Recording,
    file: CalibrationFile,
    out: BinaryIO,
    *,
    version: str,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> RecordingWritten:
    """Write a recording again as MCAP, with a calibration. Memory is bounded whatever the recording's size.

    Args:
        recording: open, with images; of ROS 1 or ROS 2.
        file: the calibration of its radar and camera.
        out: the new file, written from front to back.
        version: of this program.
        progress: called with the number of messages done and their total.

    Raises:
        InputError: it is no ROS recording, or the calibration is not of its images.
        RecordingError: it can no longer be read.
    """
    original = _original(recording)
    build = MessageBuilder(_generation(recording, original))
    plan, notes = _plan(recording, file)
    additions = Additions(plan, recording, build, original.channels)
    writer = McapWriter(
        out, profile=original.profile, library="cocalib", version=version, compression=original.compression
    )
    _write_besides(original, file, writer, notes)
    losses = Losses()
    copied, last_ns = _copy(original, additions, writer, losses, progress)
    for message in additions.rest(last_ns):
        _write(writer, message)
    writer.finish()
    notes.extend(
        f"{warning_remark(warning).message} ({warning.code})"
        for warning in recording.warnings
        if warning.code in _DAMAGE
    )
    return RecordingWritten(
        copied, dict(additions.counts), losses.by_topic, losses.fault, tuple(notes), _layout(recording, plan)
    )


def _original(recording: Recording) -> _Original:
    """Collect the files and the places of their messages; those that several files repeat are taken once."""
    found, places = _Original(), {}
    for source in recording.sources:
        copied = copied_file(source)
        if copied is None:
            raise InputError(
                f"{source.path}: is no ROS recording; export into a recording takes .bag, .mcap and .db3 files and their folders"
            )
        places[id(source)] = len(found.files)
        found.files.append(copied)
        found.rows.append({})
    for topic in join_topics(recording.sources)[0]:
        for number, (source, channel) in enumerate(topic.parts):
            mine = topic if len(topic.parts) == 1 else topic.take((topic.part == number).nonzero()[0])
            index = MessageIndex(mine.receive_ns, mine.chunk, mine.offset)
            found.rows[places[id(source)]][channel.id] = index
    found.files = [_with_definitions(file) for file in found.files]
    return found


def _with_definitions(file: CopiedFile) -> CopiedFile:
    channels = {number: with_definition(channel) for number, channel in file.channels.items()}
    return CopiedFile(file.source, channels, file.profile, file.besides)


def _generation(recording: Recording, original: _Original) -> Literal[1, 2]:
    encodings = {channel.encoding for channel in original.channels if channel.topic == recording.image_topic}
    return 1 if "ros1" in encodings else 2


def _plan(recording: Recording, file: CalibrationFile) -> tuple[Plan, list[str]]:
    """Decide what to add, and say why."""
    _require_same_images(recording, file)
    frames, notes = _frames(recording, file)
    info = choose_topic(recording, file.calibration.camera, frames.camera)
    notes.extend(note for note in (info.note, _distortion_note(file), _player_note(recording)) if note)
    drawn = recording.has_plain_clouds and frames.radar == recording.radar_frame
    corrected = has_corrections(file.calibration) and recording.radar_topic is not None
    as_reported = not drawn and recording.radar_topic is not None
    if as_reported and not recording.has_plain_clouds:
        notes.append(f"viewers cannot draw {recording.radar_topic} as points; its returns are also on {POINTS_TOPIC}")
    if corrected:
        notes.append(
            f"{CORRECTED_TOPIC} has the returns with the radar's errors taken out, as the calibration states them; "
            "the layout draws these"
        )
    (topic,), _ = join_topics(recording.sources, (str(recording.image_topic),))
    plan = Plan(frames, info, file.calibration, topic.definition().stamp_offset, as_reported, corrected)
    return plan, notes


def _frames(recording: Recording, file: CalibrationFile) -> tuple[SensorFrames, list[str]]:
    """Choose the frames by the recording's own names, and place the transform among its own."""
    radar, camera = recording.radar_frame or file.frames.radar, recording.camera_frame or file.frames.camera
    notes = [
        f"the {role} frame is written as {recorded!r}, as in the recording's messages; the calibration calls it {own!r}"
        for role, recorded, own in (("radar", radar, file.frames.radar), ("camera", camera, file.frames.camera))
        if recorded != own
    ]
    recorded = read_frames(recording)
    if recorded.unreadable:
        notes.append(f"{recorded.unreadable} messages of {', '.join(recorded.topics)} cannot be read")
    why = ""
    if radar == camera:
        why = f"the recording's images and returns have the same frame_id {radar!r}"
    elif recording.radar_topic is not None and not recording.radar_frame:
        why = "the radar's messages name no frame"
    elif recording.radar_axes is not None:
        why = f"the radar's messages have other axes than the calibration ({recording.radar_axes})"
    placed = place_transform(
        file.calibration.camera_from_radar, radar=radar, camera=camera, frames=recorded, own_radar_frame=why
    )
    return placed, [*notes, *placed.notes]


def _require_same_images(recording: Recording, file: CalibrationFile) -> None:
    camera = file.calibration.camera
    if recording.image_topic is None or not len(recording.image_times):
        raise InputError(f"{recording.name}: has no images to draw returns on; give the recording of the camera too")
    try:
        image = recording.image_bytes(0)
    except RecordingError:
        return
    if (image.width_px, image.height_px) != (camera.width_px, camera.height_px):
        raise InputError(
            f"{recording.name}: the images of {recording.image_topic} have {image.width_px} x {image.height_px} pixels, but "
            f"the calibration is of a camera with {camera.width_px} x {camera.height_px}; give the calibration of this camera, "
            "or choose its images with --image-topic"
        )


def _distortion_note(file: CalibrationFile) -> str:
    if not file.calibration.camera.is_distorted:
        return ""
    return (
        "the lens distorts: Foxglove straightens the images itself; RViz draws returns without distortion, so give its Camera "
        "display rectified images (image_proc)"
    )


def _player_note(recording: Recording) -> str:
    if not any("ROS 1" in source.container for source in recording.sources):
        return ""
    return (
        "ROS 1 has no player for MCAP: open the file in Foxglove, or, for RViz, convert the recording to ROS 2 "
        "(rosbags-convert) and export into that"
    )


def _write_besides(original: _Original, file: CalibrationFile, writer: McapWriter, notes: list[str]) -> None:
    """Write the calibration as an attachment and as metadata, and copy what the original holds besides messages."""
    damaged = sum(one.copy_besides(writer) for one in original.files)
    if damaged:
        notes.append(f"{damaged} attachments or metadata records of the original are damaged and left out")
    first_ns = min(
        (int(index.receive_ns[0]) for rows in original.rows for index in rows.values() if len(index)), default=0
    )
    data = write_calibration(file).encode()
    writer.attachment("calibration.json", data, media_type="application/json", time=first_ns)
    lines = statement(file, _MEANING)
    writer.metadata("cocalib", {f"{number:02d}": line for number, line in enumerate(lines, 1)})


def _copy(
    original: _Original,
    additions: Additions,
    writer: McapWriter,
    losses: Losses,
    progress: Callable[[int, int], None],
) -> tuple[int, int]:
    """Copy every message, each behind what belongs before it; return their number and the last log time."""
    for channel in original.channels:
        writer.channel(channel)
    copied = last_ns = 0
    total = original.count
    for message in merged_messages(original.files, original.rows, losses):
        for one in (*additions.before(message), message):
            _write(writer, one)
        copied, last_ns = copied + 1, max(last_ns, message.log_time)
        if copied % _PROGRESS_MESSAGES == 0:
            progress(copied, total)
    return copied, last_ns


def _write(writer: McapWriter, message: StoredMessage) -> None:
    writer.message(
        writer.channel(message.channel),
        message.data,
        log_time=message.log_time,
        publish_time=message.publish_time,
        sequence=message.sequence,
    )


def _layout(recording: Recording, plan: Plan) -> str:
    drawn = (CORRECTED_TOPIC,) if plan.corrected else (POINTS_TOPIC,) if plan.as_reported else recording.radar_topics
    return foxglove_layout(
        image_topic=str(recording.image_topic),
        info_topic=plan.info.name,
        cloud_topics=drawn,
        camera=plan.frames.camera,
        radar=plan.frames.radar,
    )


def foxglove_layout(*, image_topic: str, info_topic: str, cloud_topics: Sequence[str], camera: str, radar: str) -> str:
    """Return the layout as JSON.

    Args:
        image_topic: the images.
        info_topic: their intrinsics.
        cloud_topics: the returns to draw; the others of the recording are hidden.
        camera: the optical frame.
        radar: the radar's frame, which the 3D view follows.
    """
    image = {
        "foxglovePanelTitle": "Radar returns on the image",
        "imageMode": {
            "imageTopic": image_topic,
            "calibrationTopic": info_topic,
            "rectifyImage": True,
            "annotations": {},
        },
        "scene": {"transforms": {"showLabel": False, "enablePreloading": True}},
        "topics": {topic: _points(_POINT_PX) for topic in cloud_topics},
        "layers": {},
        "synchronize": False,
    }
    grid = {
        "layerId": "foxglove.Grid",
        "instanceId": "grid",
        "frameId": radar,
        "visible": True,
        "size": 40,
        "divisions": 40,
    }
    scene = {
        "foxglovePanelTitle": "Radar and camera",
        "cameraState": {
            "perspective": True,
            "distance": 25,
            "phi": 60,
            "thetaOffset": 90,
            "target": [0, 0, 0],
            "targetOffset": [8, 0, 0],
            "targetOrientation": [0, 0, 0, 1],
            "fovy": 45,
            "near": 0.1,
            "far": 1000,
        },
        "followMode": "follow-pose",
        "followTf": radar,
        "scene": {"transforms": {"enablePreloading": True}},
        "transforms": {f"frame:{frame}": {"visible": True} for frame in (radar, camera)},
        "topics": {
            **{topic: _points(_3D_POINT_PX) for topic in cloud_topics},
            info_topic: {"visible": True, "distance": 3},
            image_topic: {"visible": True, "cameraInfoTopic": info_topic, "distance": 3},
        },
        "layers": {"grid": grid},
    }
    layout = {
        "configById": {"Image!cocalib": image, "3D!cocalib": scene},
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": {"direction": "row", "first": "Image!cocalib", "second": "3D!cocalib", "splitPercentage": 62},
    }
    return json.dumps(layout, indent=2) + "\n"


def _points(size_px: int) -> dict[str, object]:
    """Draw points coloured by the distance forward."""
    return {
        "visible": True,
        "pointSize": size_px,
        "pointShape": "circle",
        "colorMode": "colormap",
        "colorMap": "turbo",
        "colorField": "x",
        "minValue": _NEAR_M,
        "maxValue": _FAR_M,
    }
