"""Choose the topics to use, by name or automatically; errors list the available topics."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from calib_core.errors import MessageError, RecordingError
from calib_core.options import option
from calib_core.recordings.radar.message_layouts.single_returns import PointLayout
from calib_core.recordings.time.clock_choice import Clock
from calib_core.recordings.topics import Topic, TopicKind
from calib_core.recordings.usages import Usage

Need = Literal["radar", "image"]
_WORDS = {"radar": "radar", "image": "camera image", "camera-info": "camera info"}
_FLAGS = {"radar": "--radar-topic", "image": "--image-topic", "camera-info": "--camera-info-topic"}
_RADAR_WORDS = ("radar", "mmwave", "ars4", "ars5", "srr", "umrr", "esr", "oculii")
_OBJECT_WORDS = ("object", "track")
_MOST_RADARS = 12  # that are compared
_ADDED_BY_EXPORT = "/cocalib/"
_NOT_PICTURES = ("depth", "disparity", "mask", "infra", "debug")


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


def _no_counts() -> dict[str, int]:
    return {}


@dataclass(frozen=True, slots=True, eq=False)
class Inventory:
    """All topics with what each can be used for, and the recording's name for messages.

    Attributes:
        counts: the total number of messages of topics that were only partly read.
    """

    name: str
    topics: tuple[Topic, ...]
    usages: Mapping[str, Usage]
    counts: Mapping[str, int] = field(default_factory=_no_counts)

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
    info = _chosen(inventory, "camera-info", options.camera_info_topic)
    return Selection(radars, bool(named), sensor, image, info or _nearest_info(image, inventory))


def _named_radars(inventory: Inventory, requested: str | None) -> tuple[tuple[Topic, ...], str | None]:
    """Return the radar topics the user named, or the name of what may be a radar with several topics."""
    if requested is None:
        return (), None
    known = {topic.name for topic in inventory.topics}
    names = [requested] if requested in known else [name.strip() for name in requested.split(",") if name.strip()]
    if len(names) == 1 and names[0] not in known and len(inventory.of_kind("radar")) > 1:
        return (), names[0]
    found = [_chosen(inventory, "radar", name) for name in dict.fromkeys(names or [requested])]
    return tuple(topic for topic in found if topic is not None), None


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
    return _chosen(inventory, "image", requested) or _best(inventory.of_kind("image"), inventory, _image_rank)


def _chosen(inventory: Inventory, kind: TopicKind, name: str | None) -> Topic | None:
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


def _best(
    topics: Sequence[Topic], inventory: Inventory, rank: Callable[[Topic, Inventory], tuple[int, ...]]
) -> Topic | None:
    return max(topics, key=lambda topic: rank(topic, inventory), default=None)


def radar_rank(topic: Topic, inventory: Inventory) -> tuple[int, ...]:
    """Rank radars above lidars, then by speed, radar-like name, returns above objects, and number of messages."""
    layout = inventory.usages[topic.name].radar
    assert layout is not None
    name = f"{topic.name} {topic.type}".lower()
    named = any(word in name for word in _RADAR_WORDS)
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
    """Rank pictures above depth images, then by camera info, number of messages, and files above raw pixels."""
    layout = inventory.usages[topic.name].image
    assert layout is not None
    picture = not any(word in topic.name.lower() for word in _NOT_PICTURES)
    front = "front" in topic.name.lower()
    return picture, _nearest_info(topic, inventory) is not None, front, inventory.count(topic), layout.compressed


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
