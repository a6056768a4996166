"""Write a recording again with its calibration: every message as it was, and what viewers need to draw returns on pictures."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import BinaryIO, Literal

from calib_core.deployment.additions import CORRECTED_TOPIC, POINTS_TOPIC, Additions, Plan, has_corrections
from calib_core.deployment.camera_info import choose_topic
from calib_core.deployment.placing import SensorFrames, place_transform, read_frames
from calib_core.errors import InputError, RecordingError
from calib_core.interchange import CalibrationFile, write_calibration
from calib_core.interchange.formats.statement import statement
from calib_core.recordings import Recording
from calib_core.recordings.containers.copying import CopiedFile, Losses, StoredMessage, copied_file, merged_messages
from calib_core.recordings.containers.mcap.writing import ChunkCompression, McapWriter
from calib_core.recordings.containers.sources import MessageIndex, StoredChannel
from calib_core.recordings.containers.writing import MessageBuilder
from calib_core.recordings.messages.definitions import with_definition
from calib_core.recordings.topics import join_topics

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
        recording: open, with pictures; of ROS 1 or ROS 2.
        file: the calibration of its radar and camera.
        out: the new file, written from front to back.
        version: of this program.
        progress: called with the number of messages done and their total.

    Raises:
        InputError: it is no ROS recording, or the calibration is not of its pictures.
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
    notes.extend(f"{warning.message} ({warning.code})" for warning in recording.warnings if warning.code in _DAMAGE)
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
    found.files = [_with_definitions(one) for one in found.files]
    return found


def _with_definitions(file: CopiedFile) -> CopiedFile:
    channels = {number: with_definition(channel) for number, channel in file.channels.items()}
    return CopiedFile(file.source, channels, file.profile, file.besides)


def _generation(recording: Recording, original: _Original) -> Literal[1, 2]:
    encodings = {channel.encoding for channel in original.channels if channel.topic == recording.image_topic}
    return 1 if "ros1" in encodings else 2


def _plan(recording: Recording, file: CalibrationFile) -> tuple[Plan, list[str]]:
    """Decide what to add, and say why."""
    _require_same_pictures(recording, file)
    frames, notes = _frames(recording, file)
    info = choose_topic(recording, file.calibration.camera, frames.camera)
    notes.extend(note for note in (info.note, _about_distortion(file), _about_players(recording)) if note)
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
        why = f"the recording's pictures and returns have the same frame_id {radar!r}"
    elif recording.radar_topic is not None and not recording.radar_frame:
        why = "the radar's messages name no frame"
    elif recording.radar_axes is not None:
        why = f"the radar's messages have other axes than the calibration ({recording.radar_axes})"
    placed = place_transform(
        file.calibration.camera_from_radar, radar=radar, camera=camera, frames=recorded, own_radar_frame=why
    )
    return placed, [*notes, *placed.notes]


def _require_same_pictures(recording: Recording, file: CalibrationFile) -> None:
    camera = file.calibration.camera
    if recording.image_topic is None or not len(recording.image_times):
        raise InputError(f"{recording.name}: has no pictures to draw returns on; give the recording of the camera too")
    try:
        image = recording.image_bytes(0)
    except RecordingError:
        return
    if (image.width_px, image.height_px) != (camera.width_px, camera.height_px):
        raise InputError(
            f"{recording.name}: the pictures of {recording.image_topic} have {image.width_px} x {image.height_px} pixels, but "
            f"the calibration is of a camera with {camera.width_px} x {camera.height_px}; give the calibration of this camera, "
            "or choose its pictures with --image-topic"
        )


def _about_distortion(file: CalibrationFile) -> str:
    if not file.calibration.camera.is_distorted:
        return ""
    return (
        "the lens distorts: Foxglove straightens the pictures itself; RViz draws returns without distortion, so give its Camera "
        "display rectified pictures (image_proc)"
    )


def _about_players(recording: Recording) -> str:
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
        image_topic: the pictures.
        info_topic: their intrinsics.
        cloud_topics: the returns to draw; the others of the recording are hidden.
        camera: the optical frame.
        radar: the radar's frame, which the 3D view follows.
    """
    image = {
        "foxglovePanelTitle": "Radar returns on the picture",
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
