"""Put a recording together: topics chosen, clocks chosen, streams built, cautions gathered."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.camera import Camera
from calib_core.errors import MessageError, RecordingError
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.recordings.calendar import utc
from calib_core.recordings.camera_info import camera_from_info
from calib_core.recordings.clocks import ClockChoice, Stamps, choose_clock, choose_clocks
from calib_core.recordings.decoding import Message, decode
from calib_core.recordings.images import ImageLayout
from calib_core.recordings.radar_layouts import RadarLayout, recognise
from calib_core.recordings.radar_lists import PointLayout
from calib_core.recordings.selection import Inventory, Need, RecordingOptions, Selection, select
from calib_core.recordings.sources import Source
from calib_core.recordings.streams import ImageStream, RadarStream
from calib_core.recordings.topics import Rhythm, Topic, TopicSummary, join_topics, usage_of
from calib_core.results import Caution

__all__ = ["Assembly", "assemble"]

_SAMPLED_SCANS = 12


@dataclass(frozen=True, slots=True, eq=False)
class Assembly:
    """Everything a Recording serves; the attributes are its own."""

    topics: tuple[TopicSummary, ...]
    radar_topic: str | None
    image_topic: str | None
    camera_info_topic: str | None
    radar_frame: str
    camera_frame: str
    radar: RadarStream | None
    images: ImageStream | None
    camera: Camera | None
    cautions: tuple[Caution, ...]


def assemble(
    paths: Sequence[Path], sources: tuple[Source, ...], options: RecordingOptions, require: Sequence[Need]
) -> Assembly:
    """Choose topics and clocks and build the streams.

    Args:
        paths: as a person gave them, for messages.
        sources: the open files.
        options: topics and clock asked for.
        require: what the recording must have; with both, also a time in common.

    Raises:
        RecordingError: the recording lacks what the options ask for.
    """
    name = " + ".join(str(path) for path in paths)
    topics, repeated = join_topics(sources)
    cautions = [caution for source in sources for caution in source.cautions] + list(repeated)
    if not any(len(topic) for topic in topics) and require:
        raise RecordingError(f"{name}: holds no messages; was the recorder told which topics to record?")
    inventory = Inventory(name, topics, {topic.name: usage_of(topic) for topic in topics})
    selection = select(inventory, options, require)
    clocks, stamps, about_clocks = _clocks(selection, options)
    cautions.extend(about_clocks)
    radar = _radar_stream(selection.radar, inventory, stamps)
    images = _image_stream(selection.image, inventory, stamps)
    if radar and images:
        cautions.extend(_check_overlap(name, radar, images, selection, required=len(require) == 2))
    camera, about_camera = _camera(selection, images)
    cautions.extend([*about_camera, *_about_radar(radar, selection, inventory), *_about_images(images)])
    return Assembly(
        topics=tuple(_summary(topic, inventory, selection, clocks, stamps) for topic in topics),
        radar_topic=selection.radar.name if selection.radar else None,
        image_topic=selection.image.name if selection.image else None,
        camera_info_topic=selection.camera_info.name if selection.camera_info else None,
        radar_frame=_frame(selection.radar),
        camera_frame=_frame(selection.image) or _frame(selection.camera_info),
        radar=radar,
        images=images,
        camera=camera,
        cautions=tuple(cautions),
    )


def _clocks(
    selection: Selection, options: RecordingOptions
) -> tuple[Mapping[str, Literal["header", "receive"]], Mapping[str, TimesNs], tuple[Caution, ...]]:
    """Read both clocks of the topics in use and choose; return clock and times by topic."""
    used = [topic for topic in (selection.radar, selection.image) if topic is not None]
    read = [Stamps(topic.name, topic.receive_ns, topic.header_stamps()) for topic in used]
    if options.clock == "header":
        for both in read:
            if both.header_ns is None:
                raise RecordingError(f"topic {both.topic} carries no stamps; use the receive times: --clock receive")
    if len(read) == 2:
        choice = choose_clocks(read[0], read[1], options.clock)
    else:
        choice = choose_clock(read[0], options.clock) if read else ClockChoice((), ())
    clocks = dict(zip([topic.name for topic in used], choice.clocks, strict=True))
    stamps = {both.topic: _times(both, clock) for both, clock in zip(read, choice.clocks, strict=True)}
    return clocks, stamps, choice.cautions


def _times(both: Stamps, clock: str) -> TimesNs:
    """Return the times of a topic; a rare stamp of zero is filled in from the receive time and the usual delay."""
    if clock == "receive" or both.header_ns is None:
        return both.receive_ns
    missing = both.header_ns == 0
    if not missing.any() or missing.all():
        return both.header_ns
    delay = int(np.median((both.receive_ns - both.header_ns)[~missing]))
    return np.where(missing, both.receive_ns - delay, both.header_ns)


def _radar_stream(topic: Topic | None, inventory: Inventory, stamps: Mapping[str, TimesNs]) -> RadarStream | None:
    if topic is None:
        return None
    layouts: list[RadarLayout] = []
    for number in range(len(topic.parts)):
        rows = np.flatnonzero(topic.part == number)
        layout = recognise(topic.definition(number), topic.payload(int(rows[0]))) if number and len(rows) else None
        layouts.append(layout or inventory.usages[topic.name].radar)  # type: ignore[arg-type]
    kinds = {isinstance(layout, PointLayout) for layout in layouts}
    if len(kinds) > 1 or (len(layouts) > 1 and kinds == {True} and len({str(layout.dtype) for layout in layouts}) > 1):  # type: ignore[union-attr]
        raise MessageError(f"topic {topic.name}: its files hold different message layouts; open them one at a time")
    return RadarStream(topic, layouts, stamps[topic.name])  # type: ignore[arg-type]


def _image_stream(topic: Topic | None, inventory: Inventory, stamps: Mapping[str, TimesNs]) -> ImageStream | None:
    if topic is None:
        return None
    layouts = [ImageLayout(topic.definition(number), topic.name) for number in range(len(topic.parts))]
    return ImageStream.build(topic, layouts, stamps[topic.name])


def _check_overlap(
    name: str, radar: RadarStream, images: ImageStream, selection: Selection, *, required: bool
) -> list[Caution]:
    """Compare the intervals of both sensors.

    Raises:
        RecordingError: they have no time in common, and that is required.
    """
    a, b = radar.times_ns, images.times_ns
    if a[0] <= b[-1] and b[0] <= a[-1]:
        return []
    assert selection.radar is not None
    assert selection.image is not None
    gap_s = max(int(a[0] - b[-1]), int(b[0] - a[-1])) / NS_PER_S
    what = (
        f"{selection.radar.name} ({_interval(a)}) and {selection.image.name} ({_interval(b)}) have no time in common: "
        f"{gap_s:.1f} s apart"
    )
    hint = "give recordings made together; if only the clocks differ, try --clock receive or --clock header"
    if required:
        raise RecordingError(f"{name}: {what}; {hint}")
    return [Caution("no-overlap", what, hint)]


def _interval(times_ns: TimesNs) -> str:
    return f"{utc(TimeNs(int(times_ns[0])))} to {utc(TimeNs(int(times_ns[-1])))}"


def _camera(selection: Selection, images: ImageStream | None) -> tuple[Camera | None, list[Caution]]:
    """Read the intrinsics beside the images, and hold them against the images."""
    topic = selection.camera_info
    if topic is None or not len(topic):
        return None, []
    try:
        first, last = (_message(topic, row) for row in (0, len(topic) - 1))
    except RecordingError as error:
        return None, [Caution("camera-unreadable", str(error), "give the intrinsics with --camera FILE")]
    rectified = selection.image is not None and "rect" in selection.image.name.rpartition("/image")[2]
    reading = camera_from_info(first, topic=topic.name, rectified=rectified)
    cautions = list(reading.cautions)
    if reading.camera is None:
        return None, cautions
    other = camera_from_info(last, topic=topic.name, rectified=rectified).camera
    if other is None or not np.array_equal(other.matrix_px, reading.camera.matrix_px):
        cautions.append(
            Caution(
                "camera-changes",
                f"{topic.name} begins and ends with different intrinsics; the first are used",
                "turn off autofocus and zoom, or give the intrinsics with --camera FILE",
            )
        )
    if images is None or not len(images.times_ns):
        return reading.camera, cautions
    return _fitted(reading.camera, images, topic.name, cautions)


def _fitted(
    camera: Camera, images: ImageStream, name: str, cautions: list[Caution]
) -> tuple[Camera | None, list[Caution]]:
    """Scale the camera where its images are resized; refuse it where they are of another shape."""
    try:
        width, height = images.size_px(0)
    except MessageError:
        return camera, cautions
    if (camera.width_px, camera.height_px) == (width, height):
        return camera, cautions
    sizes = f"{name} is for {camera.width_px} x {camera.height_px} pixels, the images have {width} x {height}"
    if abs(camera.width_px * height - camera.height_px * width) <= 0.005 * camera.width_px * height:
        scaled = camera.scaled(width / camera.width_px)
        fitted = Camera(scaled.model, width, height, scaled.matrix_px, scaled.distortion)
        hint = "right for resized images, wrong for cropped ones: then give the intrinsics with --camera FILE"
        return fitted, [*cautions, Caution("camera-scaled", f"{sizes}: the intrinsics were scaled", hint)]
    hint = "give the intrinsics of these images with --camera FILE"
    return None, [*cautions, Caution("camera-size", f"{sizes}: the intrinsics cannot be used", hint)]


def _message(topic: Topic, row: int) -> Message:
    return decode(topic.definition(int(topic.part[row])), topic.payload(row))


def _about_radar(radar: RadarStream | None, selection: Selection, inventory: Inventory) -> list[Caution]:
    if radar is None or selection.radar is None:
        return []
    name = selection.radar.name
    layout = inventory.usages[name].radar
    cautions = []
    if layout is not None and layout.lidar_like:
        cautions.append(
            Caution(
                "looks-like-lidar",
                f"{name} looks like a lidar: {layout.description}",
                "choose the radar with --radar-topic, or give the file that has it",
            )
        )
    heights = [radar.scans(time, time).points_radar_m[:, 2] for time in _sample(radar.times_ns)]
    height = np.concatenate([*heights, np.zeros(0)])
    height = height[np.isfinite(height)]
    if len(height) > 1 and np.all(height == height[0]):
        cautions.append(
            Caution(
                "flat-radar",
                f"{name} gives every return the same height ({height[0]:g} m): it measures no elevation",
                "height, pitch and roll are then only as good as the reflectors lie at that height",
            )
        )
    return cautions


def _sample(times_ns: TimesNs) -> list[TimeNs]:
    count = min(_SAMPLED_SCANS, len(times_ns))
    return [TimeNs(int(times_ns[place])) for place in np.linspace(0, len(times_ns) - 1, count).astype(int)]


def _about_images(images: ImageStream | None) -> list[Caution]:
    if images is None or not images.repeated:
        return []
    return [
        Caution(
            "repeated-stamps",
            f"{images.repeated} images of {images.topic.name} have the stamp of another; the first of each is shown",
            "nothing to do, unless they are many: then the camera driver stamps wrongly; try --clock receive",
        )
    ]


def _frame(topic: Topic | None) -> str:
    """Read the frame_id a topic's messages begin with."""
    if topic is None or not len(topic):
        return ""
    try:
        message = _message(topic, 0)
    except RecordingError:
        return ""
    header = message.values.get("header", message)
    frame = header["frame_id"] if isinstance(header, Message) and "frame_id" in header else ""
    return str(frame).lstrip("/")


def _summary(
    topic: Topic,
    inventory: Inventory,
    selection: Selection,
    clocks: Mapping[str, Literal["header", "receive"]],
    stamps: Mapping[str, TimesNs],
) -> TopicSummary:
    usage = inventory.usages[topic.name]
    times = stamps.get(topic.name, topic.receive_ns)
    rhythm = Rhythm.of(times)
    return TopicSummary(
        name=topic.name,
        type=topic.type,
        count=len(topic),
        kind=usage.kind,
        start=TimeNs(int(times.min())) if len(times) else None,
        end=TimeNs(int(times.max())) if len(times) else None,
        clock=clocks.get(topic.name, "receive"),
        problem=usage.problem,
        chosen=any(topic is chosen for chosen in (selection.radar, selection.image, selection.camera_info)),
        layout=usage.radar.description if usage.radar else "",
        rate_hz=rhythm.rate_hz,
        longest_gap_s=rhythm.longest_gap_s,
        jitter_s=rhythm.jitter_s,
    )
