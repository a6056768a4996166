"""What each topic can be used for, and which ones are used: by name or by figures; errors list the available topics."""

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, TypeAlias

import numpy as np

from calib_core.errors import MessageError, RecordingError
from calib_core.measurements import DataWarning
from calib_core.options import option
from calib_core.recordings.box_topics import BoxLayout, box_layout
from calib_core.recordings.camera.images import ImageLayout, is_image
from calib_core.recordings.camera.recorded_intrinsics import is_camera_info
from calib_core.recordings.field_words import meaning_of, words_in
from calib_core.recordings.messages.definitions import PRIMITIVES, Definition
from calib_core.recordings.radar.column_plan import StatedReading
from calib_core.recordings.radar.layouts import RadarLayout, recognise
from calib_core.recordings.radar.message_layouts.list_messages import struct_lists
from calib_core.recordings.radar.message_layouts.samples import leaf_names
from calib_core.recordings.radar.message_layouts.single_returns import PointLayout
from calib_core.recordings.radar.scan_stream import RadarStream
from calib_core.recordings.radar.sensors import Examined, Figures, RadarSensor, sensors_of
from calib_core.recordings.time.clock_choice import HALF_DISTINCT, RETURNS_DISTINCT, Clock
from calib_core.recordings.topics import Topic, TopicKind

_RAW = (
    "raw sensor packets, which only the sensor's driver can decode; play the recording to the driver and record "
    "what it publishes"
)
_NOTHING = StatedReading()
_ENOUGH_BYTES = 16
_MOST_NAMES = 8
Need = Literal["radar", "image"]
Mount: TypeAlias = tuple[float, float, float, float, float, float]
"""x, y, z [m], roll, pitch, yaw [deg]."""
_WORDS = {"radar": "radar", "image": "camera image", "camera-info": "camera info"}
_FLAGS = {"radar": "--radar-topic", "image": "--image-topic", "camera-info": "--camera-info-topic"}
RADAR_WORDS = ("radar", "mmwave", "ars4", "ars5", "srr", "umrr", "esr", "oculii")
_OBJECT_WORDS = ("object", "track")
_MOST_RADARS = 12  # that are compared
_ADDED_BY_EXPORT = "/cocalib/"
_NOT_IMAGES = ("depth", "disparity", "mask", "infra", "debug")
_PLENTY = 0.25  # of the most static returns ahead: with fewer, a radar looks elsewhere
_COMPARABLE = 0.5  # with more than this of them, another radar could be meant
_NOTHING_STATIC = 1.0  # returns a scan: the recording was made on the move


_ROS_PACKAGES = words_in(
    "actionlib_msgs builtin_interfaces control_msgs diagnostic_msgs geometry_msgs map_msgs nav_msgs rcl_interfaces "
    "rosgraph_msgs sensor_msgs shape_msgs std_msgs stereo_msgs tf tf2_msgs trajectory_msgs unique_identifier_msgs "
    "vision_msgs visualization_msgs"
)
"""Packages of ROS itself, whose lists of structs are no radar returns and need no remark."""


@dataclass(frozen=True, slots=True, eq=False)
class Usage:
    """What a topic can be used for.

    Attributes:
        kind: see TopicSummary.
        problem: see TopicSummary.
        radar: its layout, if it is a radar topic.
        image: its layout, if it is an image topic.
        boxes: its layout, if it has boxes around objects.
    """

    kind: TopicKind
    problem: str | None = None
    radar: RadarLayout | None = None
    image: ImageLayout | None = None
    boxes: BoxLayout | None = None

    @property
    def distinct_times(self) -> float:
        """The least share of different times that is plausible among its messages."""
        return RETURNS_DISTINCT if isinstance(self.radar, PointLayout) else HALF_DISTINCT


def usage_of(topic: Topic, stated: StatedReading = _NOTHING) -> Usage:
    """Determine what a topic can be used for, from its definition and its first readable message.

    Args:
        topic: the topic.
        stated: what the user states about the radar's messages.
    """
    try:
        definition = topic.definition()
    except MessageError as error:
        return Usage("other", problem=str(error))
    if is_camera_info(definition):
        return Usage("camera-info")
    boxes = box_layout(definition)
    if boxes is not None:
        return Usage("other", boxes=boxes)
    images = is_image(definition)
    usage = Usage("image" if images else "other", problem="no messages")
    for row in sorted({0, len(topic) // 2, len(topic) - 1}) if len(topic) else ():
        try:
            payload = topic.payload(row)
            return (
                _image_usage(topic, definition, payload) if images else _radar_usage(topic, definition, payload, stated)
            )
        except MessageError as error:
            usage = usage if usage.problem != "no messages" else replace(usage, problem=str(error))
        except RecordingError as error:
            usage = replace(usage, problem=f"its messages cannot be read: {error}")
    if usage.problem != "no messages" and "radar" in topic.name.lower() and not images:
        return replace(usage, kind="radar")
    return usage


def _image_usage(topic: Topic, definition: Definition, payload: bytes) -> Usage:
    layout = ImageLayout(definition, topic.name)
    layout.check(payload)
    return Usage("image", image=layout)


def _radar_usage(topic: Topic, definition: Definition, payload: bytes, stated: StatedReading) -> Usage:
    def more(count: int) -> list[bytes]:
        rows = np.unique(np.linspace(0, len(topic) - 1, min(count, len(topic))).astype(np.int64))
        rows = rows[topic.part[rows] == topic.part[0]]
        return list(_readable(topic, rows.tolist()))

    try:
        radar = recognise(definition, payload, more, stated)
    except MessageError as error:
        if not stated.column_map:
            raise
        if recognise(definition, payload, more) is None:
            return _no_radar(definition, topic.name)
        return Usage("radar", problem=str(error))
    return _no_radar(definition, topic.name) if radar is None else Usage("radar", radar=radar)


def _readable(topic: Topic, rows: Sequence[int]) -> Iterator[bytes]:
    """Read messages; unreadable ones are left out: they are reported when they are used."""
    for row in rows:
        with contextlib.suppress(RecordingError):
            yield topic.payload(row)


def _no_radar(definition: Definition, topic: str) -> Usage:
    """Say why a message that might be a radar's is not read."""
    if _holds_packets(definition):
        return Usage("other", problem=_RAW)
    if definition.type.partition("/")[0] in _ROS_PACKAGES:
        return Usage("other")
    for place in struct_lists(definition):
        names, _ = leaf_names(definition, place.element)
        if len(names) > 2 and place.element.partition("/")[0] not in _ROS_PACKAGES:
            return _unrecognised(f"its list '{place.name}' has structs with the fields", names)
    names, _ = leaf_names(definition, definition.type)
    if "radar" in f"{topic}{definition.type}".lower() and any(map(meaning_of, names)):
        return _unrecognised("it has the fields", names)
    return Usage("other")


def _unrecognised(what: str, names: Sequence[str]) -> Usage:
    shown = ", ".join(names[:_MOST_NAMES]) + (", …" if len(names) > _MOST_NAMES else "")
    return Usage("other", problem=(
        f"not read as a radar: {what} {shown}, and no position and speed or amplitude is recognized among them; if it is "
        "one, say which is which, such as --map x=FIELD:m --map y=FIELD:m"
    ))  # fmt: skip


def _holds_packets(definition: Definition) -> bool:
    """Return whether a message holds a list of structs that are little more than bytes: what a driver receives."""
    for place in struct_lists(definition):
        fields = definition.types[place.element]
        blobs = [field for field in fields if field.count is not None and PRIMITIVES.get(field.type, "")[1:] == "1"]
        numbers = [
            name for name in leaf_names(definition, place.element)[0] if not name.startswith(("stamp.", "header."))
        ]
        if any((blob.count or _ENOUGH_BYTES) >= _ENOUGH_BYTES for blob in blobs) and len(numbers) <= len(blobs) + 3:
            return True
    return False


@dataclass(frozen=True, slots=True)
class RecordingOptions:
    """How to open a recording."""

    radar_topic: str | None = option(
        None,
        "The radar's topic, several of one radar joined by commas, or a radar's name as printed by `cocalib info`; chosen "
        "automatically if not given.",
    )
    image_topic: str | None = option(None, "The camera's image topic; chosen automatically if not given.")
    camera_info_topic: str | None = option(
        None, "The topic with the camera's intrinsics; by default, the one next to the image topic."
    )
    radar_axes: str | None = option(
        None,
        "Directions of the radar message's x, y and z, such as forward,right,up; add degrees or radians for its angles.",
    )
    map: tuple[str, ...] = option(
        (),
        "Which column of the radar holds which quantity, as QUANTITY=COLUMN:UNIT, such as x=posX:m; may be repeated. "
        "A minus before the column turns its sign.",
    )
    confirm_assumptions: bool = option(
        False, "Confirm the units, signs and meanings that the recording does not state and that `cocalib info` lists."
    )
    video_start: str | None = option(
        None,
        "Time of a video's first frame: seconds since 1970, or a date such as 2024-05-01T12:00:00.25+02:00.",
    )
    time_zone: str | None = option(
        None, "Time zone of dates in file names and columns that state none, such as +02:00; UTC if not given."
    )
    radar_start: str | None = option(
        None,
        "Time of the first frame of a TI data-port stream, as --video-start; after a comma, the seconds between frames.",
    )
    clock: Clock = option(
        "auto",
        "Times to use: stamps in the message headers, receive times, or auto: stamps unless they cannot be right.",
    )
    radar_late: float = option(
        0.0,
        "By how many seconds the radar's stamps are too late, which are reduced by it; negative if they are too early.",
    )
    radar_frame: Literal["sensor", "body"] | None = option(
        None,
        "Whose frame the radar's returns are in: its own, or the body's (base_link), out of which its mount takes them back; by "
        "default, as their frame_id and the returns themselves say.",
    )
    radar_mount: Mount | None = option(
        None,
        "Pose of the radar in the body frame: x y z [m], roll pitch yaw [deg], as of a URDF's origin; by default that of "
        "/tf_static.",
    )
    no_recording_file: bool = option(False, "Ignore a recording.toml beside the recording.")


@dataclass(frozen=True, slots=True, eq=False)
class Inventory:
    """All topics with what each can be used for, and the recording's name for messages.

    Attributes:
        counts: the total number of messages of topics that were only partly read.
    """

    name: str
    topics: tuple[Topic, ...]
    usages: Mapping[str, Usage]
    counts: Mapping[str, int] = field(default_factory=dict)

    def count(self, topic: Topic) -> int:
        """Return how many messages a topic has."""
        return max(len(topic), self.counts.get(topic.name, 0))

    def of_kind(self, kind: TopicKind) -> list[Topic]:
        """Return the readable topics of a kind; those that an export added repeat others, and are used only if named."""
        usable = [t for t in self.topics if self.usages[t.name].kind == kind and self.usages[t.name].problem is None]
        return [t for t in usable if not t.name.startswith(_ADDED_BY_EXPORT)]

    def list_topics(self) -> str:
        """List all topics with their types, for a message."""
        return ", ".join(f"{topic.name} ({topic.type})" for topic in self.topics) or "none"


@dataclass(frozen=True, slots=True, eq=False)
class Selection:
    """The topics to choose from or in use, None for each that is missing.

    Attributes:
        radars: those that may be used, the preferred ones first: what the user named, or all that can be read.
        radar_named: whether the user named the topics, which are then one radar.
        sensor: the name of a radar with several topics that the user asked for; None if not.
        image: the camera's.
        camera_info: with the intrinsics.
    """

    radars: tuple[Topic, ...]
    radar_named: bool
    sensor: str | None
    image: Topic | None
    camera_info: Topic | None


def select(inventory: Inventory, options: RecordingOptions, require: Sequence[Need]) -> Selection:
    """Choose the topics.

    Args:
        inventory: the available topics.
        options: what the user asked for.
        require: the kinds that must be present.

    Raises:
        RecordingError: a requested topic does not exist or cannot be used, or a required one is missing.
    """
    named, sensor = _named_radars(inventory, options.radar_topic)
    radars = named or _usable_radars(inventory)
    image = select_image(inventory, options.image_topic)
    for kind, found in (("radar", bool(radars)), ("image", image is not None)):
        if not found and kind in require:
            raise _missing(inventory, "radar" if kind == "radar" else "image")
    info = _topic_named(inventory, "camera-info", options.camera_info_topic)
    return Selection(radars, bool(named), sensor, image, info or _nearest_info(image, inventory))


def _named_radars(inventory: Inventory, requested: str | None) -> tuple[tuple[Topic, ...], str | None]:
    """Return the radar topics the user named, or the name of what may be a radar with several topics."""
    if requested is None:
        return (), None
    known = {topic.name for topic in inventory.topics}
    names = [requested] if requested in known else [name.strip() for name in requested.split(",") if name.strip()]
    if len(names) == 1 and names[0] not in known and len(inventory.of_kind("radar")) > 1:
        return (), names[0]
    topics = [_topic_named(inventory, "radar", name) for name in dict.fromkeys(names or [requested])]
    return tuple(topic for topic in topics if topic is not None), None


def unknown_radar(inventory: Inventory, name: str, sensors: Sequence[str]) -> RecordingError:
    """Return the error about a radar that does not exist."""
    able = ", ".join(topic.name for topic in inventory.of_kind("radar")) or "none"
    radars = f"; radars: {', '.join(sensors)}" if sensors else ""
    return RecordingError(f"{inventory.name}: no topic {name}; radar topics: {able}{radars}")


def _usable_radars(inventory: Inventory) -> tuple[Topic, ...]:
    """Return the readable radars, the preferred one first; lidars only if there is nothing else."""
    ranked = sorted(inventory.of_kind("radar"), key=lambda topic: radar_rank(topic, inventory), reverse=True)
    radars = [topic for topic in ranked if radar_rank(topic, inventory)[0]]
    return tuple(radars[:_MOST_RADARS] or ranked[:1])


def select_image(inventory: Inventory, requested: str | None) -> Topic | None:
    """Choose the camera's topic; None if there is none.

    Args:
        inventory: the available topics.
        requested: the topic the user asked for; None to choose automatically.

    Raises:
        RecordingError: the requested topic does not exist or cannot be used.
    """
    named = _topic_named(inventory, "image", requested)
    return named or max(inventory.of_kind("image"), key=lambda topic: _image_rank(topic, inventory), default=None)


def image_choice(inventory: Inventory, image: Topic | None, requested: str | None) -> str:
    """Say which image topic is used and why, as a sentence without its final period; "" if there is no other."""
    others = [topic for topic in inventory.of_kind("image") if topic is not image]
    if image is None or not others:
        return ""
    rest = f"not used: {', '.join(topic.name for topic in others)}"
    if requested is not None:
        return f"{image.name}, as requested; {rest}"
    second = max(others, key=lambda topic: _image_rank(topic, inventory))
    frames = f"it has the most frames ({inventory.count(image)} against {inventory.count(second)})"
    reasons = ("it shows no depth or mask", "it has intrinsics", "its name says front", frames, "it is compressed")
    both = zip(reasons, _image_rank(image, inventory), _image_rank(second, inventory), strict=True)
    why = next((reason for reason, mine, theirs in both if mine != theirs), "its name comes first")
    return f"{image.name}, used because {why}; {rest}; choose another with --image-topic"


def _topic_named(inventory: Inventory, kind: TopicKind, name: str | None) -> Topic | None:
    """Return the topic the user named."""
    if name is None:
        return None
    topic = next((topic for topic in inventory.topics if topic.name == name), None)
    able = ", ".join(topic.name for topic in inventory.of_kind(kind)) or "none"
    if topic is None:
        raise RecordingError(f"{inventory.name}: no topic {name}; {_WORDS[kind]} topics: {able}")
    usage = inventory.usages[name]
    if usage.problem is not None:
        raise MessageError(f"{inventory.name}: {_with_topic(name, usage.problem)}")
    if usage.kind != kind:
        raise RecordingError(
            f"{inventory.name}: topic {name} ({topic.type}) is not a {_WORDS[kind]} topic; {_WORDS[kind]} topics: {able}"
        )
    return topic


def _with_topic(name: str, problem: str) -> str:
    return problem if name in problem else f"topic {name}: {problem}"


def _missing(inventory: Inventory, kind: TopicKind) -> RecordingError:
    problems = [
        _with_topic(topic.name, str(usage.problem))
        for topic in inventory.topics
        if (usage := inventory.usages[topic.name]).kind == kind and usage.problem is not None
    ]
    why = f"; {'; '.join(problems[:3])}" if problems else ""
    return RecordingError(
        f"{inventory.name}: no readable {_WORDS[kind]} topic{why}; topics: {inventory.list_topics()}; "
        f"add the file that contains one, or choose one with {_FLAGS[kind]}"
    )


def radar_rank(topic: Topic, inventory: Inventory) -> tuple[int, ...]:
    """Rank radars above lidars, then by speed, radar-like name, returns above objects, and number of messages."""
    layout = inventory.usages[topic.name].radar
    assert layout is not None
    name = f"{topic.name} {topic.type}".lower()
    named = any(word in name for word in RADAR_WORDS)
    return (
        not layout.lidar_like or named,
        layout.plan.doppler is not None or bool(layout.plan.velocity),
        named,
        not holds_objects(topic),
        isinstance(layout, PointLayout),
        "front" in name,
        len(topic),
    )


def holds_objects(topic: Topic) -> bool:
    """Return whether a topic's name or type says that it holds tracked objects."""
    return any(word in f"{topic.name} {topic.type}".lower() for word in _OBJECT_WORDS)


def _image_rank(topic: Topic, inventory: Inventory) -> tuple[int, ...]:
    """Rank images above depth images, then by camera info, number of messages, and files above raw pixels."""
    layout = inventory.usages[topic.name].image
    assert layout is not None
    image = not any(word in topic.name.lower() for word in _NOT_IMAGES)
    front = "front" in topic.name.lower()
    return image, _nearest_info(topic, inventory) is not None, front, inventory.count(topic), layout.compressed


def _nearest_info(image: Topic | None, inventory: Inventory) -> Topic | None:
    """Return the camera info in the nearest enclosing namespace of the image topic, or else the only one."""
    infos = {topic.name: topic for topic in inventory.of_kind("camera-info") if inventory.count(topic)}
    if image is None:
        return None
    parts = image.name.split("/")
    for depth in range(len(parts) - 1, 0, -1):
        name = "/".join([*parts[:depth], "camera_info"])
        if name in infos:
            return infos[name]
    alone = len(infos) == 1 and len(inventory.of_kind("image")) == 1
    return next(iter(infos.values())) if alone else None


@dataclass(frozen=True, slots=True)
class RadarChoice:
    """The radar in use, and the others.

    Attributes:
        sensors: all that were compared, the chosen one first; empty if there is one topic only.
        reason: which one is used and why, with figures, as a sentence without its final period; "" if there is no other.
        warnings: about a choice that is not clear, and about topics that do not belong together.
    """

    sensors: tuple[RadarSensor, ...] = ()
    reason: str = ""
    warnings: tuple[DataWarning, ...] = ()


def choose_radar(
    streams: Sequence[RadarStream],
    frames: Sequence[str],
    stamped: Sequence[bool],
    inventory: Inventory,
    selection: Selection,
) -> RadarChoice:
    """Group the radar topics into sensors and choose one.

    Of topics with the same returns, one with Doppler is read, then one with stamps, then one with a frame.

    Args:
        streams: of the selection's radar topics, the preferred one first.
        frames: their frame_ids.
        stamped: whether their times are stamps.
        inventory: all topics.
        selection: what the user asked for.

    Raises:
        RecordingError: there is no radar of the name the user gave.
    """
    if not streams:
        return RadarChoice()
    examined = [
        Examined.of(stream, frame, returns=_has_returns(stream, inventory), stamped=has_stamps)
        for stream, frame, has_stamps in zip(streams, frames, stamped, strict=True)
    ]
    if selection.radar_named:
        (sensor,) = sensors_of(examined, together=True)
        return RadarChoice((sensor,), f"{_radar_text(sensor)}, as requested", tuple(_frame_warnings(examined)))
    examined.sort(key=lambda one: (one.figures.doppler, one.stamped, bool(one.frame)), reverse=True)
    sensors = sensors_of(examined)
    if selection.sensor is not None:
        wanted = [sensor for sensor in sensors if sensor.name == selection.sensor]
        if not wanted:
            raise unknown_radar(inventory, selection.sensor, [sensor.name for sensor in sensors])
        others = tuple(sensor for sensor in sensors if sensor is not wanted[0])
        return RadarChoice((wanted[0], *others), f"{_radar_text(wanted[0])}, as requested")
    return _chosen_radar(sensors, {one.name: one for one in examined}, inventory)


def _has_returns(stream: RadarStream, inventory: Inventory) -> bool:
    layout = inventory.usages[stream.topic.name].radar
    return not holds_objects(stream.topic) and layout is not None and not layout.lidar_like


def _chosen_radar(sensors: Sequence[RadarSensor], examined: dict[str, Examined], inventory: Inventory) -> RadarChoice:
    """Choose by figures first, then by names."""
    plain = [_ahead(sensor, sensors) for sensor in sensors if examined[sensor.topics[0]].returns]
    most = max(plain, default=0.0)

    def rank(sensor: RadarSensor) -> tuple[float, ...]:
        first = examined[sensor.topics[0]]
        share = _ahead(sensor, sensors) / most if most > 0 else 1.0
        figures = (first.returns, share >= _PLENTY, sensor.figures.doppler, share >= _COMPARABLE)
        return (*figures, *radar_rank(first.stream.topic, inventory))

    ordered = tuple(sorted(sensors, key=rank, reverse=True))
    best, others = ordered[0], ordered[1:]
    chosen = f"{_radar_text(best)}{_why_not_read(best, examined)}"
    if not others:
        return RadarChoice(ordered, chosen if len(best.topics) > 1 or best.copies else "")
    listed = "; ".join(_radar_text(sensor) for sensor in others)
    reason = f"{chosen}; {_why(best, others, examined)}; not used: {listed}"
    comparable = [
        sensor
        for sensor in others
        if examined[sensor.topics[0]].returns
        and _ahead(sensor, sensors) >= _COMPARABLE * _ahead(best, sensors)
        and sensor.figures.doppler == best.figures.doppler
    ]
    return RadarChoice(ordered, reason, (_unclear(best, comparable),) if comparable else ())


def _why_not_read(best: RadarSensor, examined: dict[str, Examined]) -> str:
    """Say what the topics lack whose returns are those of another one."""
    first = examined[best.topics[0]]
    reasons = []
    for name in best.copies:
        copy = examined[name]
        lacks = (
            (first.figures.doppler and not copy.figures.doppler, "no Doppler"),
            (first.stamped and not copy.stamped, "no stamps"),
            (bool(first.frame) and not copy.frame, "no frame"),
        )
        missing = [what for is_missing, what in lacks if is_missing]
        if missing:
            reasons.append(f"; {name} is not read because it has {' and '.join(missing)}")
    return "".join(reasons)


def _ahead(sensor: RadarSensor, sensors: Sequence[RadarSensor]) -> float:
    """Return the static returns a scan ahead of a radar; all its returns if hardly any is static."""
    still = max(other.figures.ahead_per_scan for other in sensors) >= _NOTHING_STATIC
    return sensor.figures.ahead_per_scan if still else sensor.figures.returns_per_scan


def _why(best: RadarSensor, others: Sequence[RadarSensor], examined: dict[str, Examined]) -> str:
    rivals = [sensor for sensor in others if examined[sensor.topics[0]].returns]
    if not rivals:
        return "used because the others are tracked objects or lidars"
    mine, *theirs = (_ahead(sensor, (best, *others)) for sensor in (best, *rivals))
    if best.figures.doppler and not any(sensor.figures.doppler for sensor in rivals):
        return "used because it has Doppler"
    if mine >= max(theirs):
        return f"used because it has the most static returns ahead ({mine:.1f} a scan against {max(theirs):.1f})"
    return "used because of its name and message type; its figures are comparable"


def _unclear(best: RadarSensor, comparable: Sequence[RadarSensor]) -> DataWarning:
    listed = "; ".join(_radar_text(sensor) for sensor in comparable)
    return DataWarning.reported(
        "several-radars",
        f"there are {len(comparable) + 1} radars with comparable returns: {_radar_text(best)} (used); {listed}",
        f"if another one is to be calibrated, choose it: --radar-topic {comparable[0].name}",
    )


def _frame_warnings(examined: Sequence[Examined]) -> list[DataWarning]:
    """Warn about topics that the user joined although their frames say that they are different sensors."""
    if len({one.frame for one in examined}) < 2:
        return []
    listed = ", ".join(f"{one.name} has frame '{one.frame}' ({figures_text(one.figures)})" for one in examined)
    return [
        DataWarning.reported(
            "radar-frames-differ",
            f"the radar topics that are read as one have different frames: {listed}",
            "positions are not moved from one frame to the other: name only topics of one radar with --radar-topic",
        )
    ]


def _radar_text(sensor: RadarSensor) -> str:
    """Describe a radar by its topics, frame and figures."""
    own = [name for index, name in enumerate(sensor.topics) if sensor.repeats[index] == index]
    second = [name for index, name in enumerate(sensor.topics) if sensor.repeats[index] != index]
    what = " + ".join(own)
    if len(own) > 1:
        what += " as one radar"
    if second:
        what += f" with other azimuths in {' + '.join(second)}"
    if sensor.copies:
        what += f" (the same returns as {', '.join(sensor.copies)})"
    return f"{what}, frame '{sensor.frame}': {figures_text(sensor.figures)}"


def figures_text(figures: Figures) -> str:
    """Describe a radar's figures."""
    rate = "" if figures.rate_hz is None else f" at {figures.rate_hz:.1f} Hz"
    static = "no Doppler" if figures.static_share is None else f"Doppler, {100.0 * figures.static_share:.0f} % static"
    reach = f"{figures.nearest_m:.1f} to {figures.farthest_m:.1f} m"
    return f"{figures.returns_per_scan:.0f} returns a scan{rate}, {reach}, {static}"
