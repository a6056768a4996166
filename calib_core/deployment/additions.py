"""The messages that an export adds to a recording: the transform, the intrinsics, the returns as clouds."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from calib_core.arrays import Points3
from calib_core.deployment.camera_info import ChosenTopic, InfoTemplate
from calib_core.deployment.placing import SensorFrames, is_transforms
from calib_core.measurements import NS_PER_S, TimeNs, time_parts
from calib_core.radar import RadarErrors
from calib_core.recordings import Recording
from calib_core.recordings.containers.copying import StoredMessage
from calib_core.recordings.containers.sources import ChannelNotes, StoredChannel
from calib_core.recordings.containers.writing import CameraInfoMessage, CloudMessage, MessageBuilder, TransformMessage
from calib_core.results import Calibration

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
        stamp_offset: of the picture messages' stamp; None if they have none.
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
            yield self._counted(self._info, self._template.stamped(self._stamp(message)), message.log_time)

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
            yield self._counted(self._transform, self.build.serialised(body), log_time)

    def _due_clouds(self, log_time: int) -> Iterator[StoredMessage]:
        while self._cloud is not None and self._cloud.log_time <= log_time:
            cloud, topic = self._cloud.cloud, self._cloud.topic
            if topic not in self._cloud_channels:
                self._cloud_channels[topic] = self.build.channel(topic, CloudMessage)
            due_ns = max(self._cloud.log_time, self._first_ns)
            yield self._counted(self._cloud_channels[topic], self.build.serialised(cloud), due_ns)
            self._cloud = next(self._clouds, None)

    def _counted(self, channel: StoredChannel, data: bytes, log_time: int) -> StoredMessage:
        number = self.counts[channel.topic] = self.counts.get(channel.topic, 0) + 1
        return StoredMessage(channel, data, log_time, log_time, number)

    def _stamp(self, message: StoredMessage) -> bytes:
        """Return a picture's own stamp, which its intrinsics must share, in little-endian words."""
        place = self.plan.stamp_offset
        stamp = b"" if place is None else message.data[place : place + _STAMP.size]
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
