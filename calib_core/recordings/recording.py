"""A recording: one or more files, presented as one radar and one camera on a common timeline."""

import hashlib
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.camera import Camera
from calib_core.errors import InputError, RecordingError
from calib_core.input_files import name_text, no_such, special_kind
from calib_core.measurements import NS_PER_S, Boxes, DataWarning, RadarScans, TimeNs
from calib_core.recordings.assembly import Assembly, assemble
from calib_core.recordings.box_topics import boxes_in_topic
from calib_core.recordings.camera.image_stream import ImageStream
from calib_core.recordings.camera.images import EncodedImage, is_image
from calib_core.recordings.camera.recorded_intrinsics import is_camera_info
from calib_core.recordings.containers.opening import open_beginnings, open_sources
from calib_core.recordings.containers.sources import Assumption, Channel, Source, StatedAssumption
from calib_core.recordings.field_words import parse_column_map
from calib_core.recordings.messages.definitions import definition_of
from calib_core.recordings.plain_files.opening import files_behind, open_plain_sources
from calib_core.recordings.plain_files.source import PlainOptions, PlainSource
from calib_core.recordings.plain_files.ti_uart import open_uart_streams
from calib_core.recordings.plain_files.video import VIDEO_SUFFIXES
from calib_core.recordings.radar.column_plan import ColumnReading, parse_radar_axes
from calib_core.recordings.radar.merging import MergedStream
from calib_core.recordings.radar.returns_origin import ReturnsOrigin
from calib_core.recordings.radar.scan_stream import Losses
from calib_core.recordings.radar.sensors import RadarSensor, figures_of
from calib_core.recordings.recording_file import RecordingFile, recording_file_of, with_recording_file
from calib_core.recordings.selection import Inventory, Need, RecordingOptions, Usage, select_image, usage_of
from calib_core.recordings.time.written_times import parse_zone
from calib_core.recordings.topics import Topic, TopicSummary, join_topics, read_stamps
from calib_core.results import InputFile
from calib_core.results.confirmation import lost_returns
from calib_core.words.warnings import warning_remark

_HASH_BYTES = 1 << 22
_GAP = 5.0  # times the usual time between scans
_STAMP_BYTES = 12


LOSSES = frozenset({
    "checksum", "damaged-file", "definitions-damaged", "file-left-out", "messages-missing", "missing-file", "not-closed",
    "packed-file-damaged", "unreadable-messages",
})  # fmt: skip
"""The codes of warnings that a part of the recording is damaged or missing."""


class Recording:
    """An open recording. Created by open_recording; use it in a with statement.

    Reading is thread-safe. Memory use is bounded whatever the file size: frames are read one at a time, radar scans in
    blocks, and uncompressed chunks and decoded blocks are kept in small caches.

    Attributes:
        paths: as given.
        sources: the files behind them.
        topics: every topic; those in use are marked as chosen.
        radar_topic: the radar topic in use, if any; of several the one with the most returns.
        radar_topics: all topics of the radar in use.
        radar_choice: which radar is used and why, if there was a choice or it has several topics; else "".
        image_choice: which image topic is used and why, if there are several; else "".
        image_topic: the image topic in use, if any.
        camera_info_topic: the camera-info topic in use, if any.
        radar_frame: frame_id of the radar, without a leading slash; "" if unknown.
        camera_frame: frame_id of the images.
        image_times: (m,) stamps of the frames, ascending and unique.
        radar_times: (k,) stamps of the scans, ascending.
    """

    def __init__(
        self,
        paths: tuple[Path, ...],
        sources: tuple[Source, ...],
        assembly: Assembly,
        video_start: str | None = None,
        file: RecordingFile | None = None,
    ) -> None:
        self.paths = paths
        self.sources = sources
        self._assembly = assembly
        self._video_start = video_start
        self._file = file
        self._closed = threading.Event()
        self._fingerprint: tuple[InputFile, ...] = ()
        self.topics: tuple[TopicSummary, ...] = assembly.topics
        self.radar_topics = assembly.radar_topics
        self.radar_topic = assembly.radar_topics[0] if assembly.radar_topics else None
        self.radar_choice = assembly.radar_choice
        self.image_choice = assembly.image_choice
        self.image_topic = assembly.image_topic
        self.camera_info_topic = assembly.camera_info_topic
        self.radar_frame = assembly.radar_frame
        self.camera_frame = assembly.camera_frame
        nothing: TimesNs = np.zeros(0, dtype=np.int64)
        self.image_times: TimesNs = assembly.images.times_ns if assembly.images else nothing
        self.radar_times: TimesNs = assembly.radar.times_ns if assembly.radar else nothing

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close all files."""
        self._closed.set()
        for source in self.sources:
            source.close()

    @property
    def name(self) -> str:
        """The name of the recording for messages."""
        return " + ".join(name_text(path.name) for path in self.paths)

    @property
    def files(self) -> tuple[Path, ...]:
        """What it is read from: the file of each source, or its folder and the files in it, and a recording.toml."""
        inner = (
            file
            for source in self.sources
            if isinstance(source, PlainSource) and source.path.is_dir()
            for file in files_behind(source.path)
            if file.stem in source.names
        )
        beside = () if self._file is None else map(recording_file_of, self.paths)
        return (*(source.path for source in self.sources), *inner, *beside)

    @property
    def recording_file(self) -> str:
        """What is used of a recording.toml beside the recording, in words; "" if there is none."""
        return "" if self._file is None else self._file.words

    @property
    def radar_clock(self) -> str | None:
        """The clock of radar_times: "header" or "receive"; None without a radar."""
        return self._clock_of(self.radar_topic)

    @property
    def image_clock(self) -> str | None:
        """The clock of image_times: "header" or "receive"; None without images."""
        return self._clock_of(self.image_topic)

    @property
    def radar_axes(self) -> str | None:
        """The user's --radar-axes (axes and units of the radar); None if not given."""
        axes = self._assembly.radar.layout.plan.axes if self._assembly.radar else None
        return axes.words if axes else None

    @property
    def video_start(self) -> str | None:
        """The user's --video-start (time of a video's first frame); None if the images do not come from a video."""
        videos = [source for source in self.sources if source.path.suffix.lower() in VIDEO_SUFFIXES]
        used = any(channel.topic == self.image_topic for source in videos for channel in source.channels)
        return self._video_start if used else None

    def _clock_of(self, name: str | None) -> str | None:
        return next((topic.clock for topic in self.topics if topic.name == name), None)

    @property
    def assumptions(self) -> tuple[Assumption, ...]:
        """What the files do not state, reading takes for granted, and the user has not confirmed."""
        return () if self._assembly.confirmed else self._assembly.assumptions

    @property
    def stated_assumptions(self) -> tuple[StatedAssumption, ...]:
        """Every assumption, with whether the user has confirmed it."""
        return tuple(
            StatedAssumption(assumption, self._assembly.confirmed) for assumption in self._assembly.assumptions
        )

    @property
    def column_map(self) -> tuple[str, ...]:
        """The user's --map of the radar's columns."""
        return self._assembly.column_map

    @property
    def radar_columns(self) -> tuple[ColumnReading, ...]:
        """What was taken for what in the radar's messages; empty without a radar."""
        return self._assembly.radar.layout.plan.readings if self._assembly.radar else ()

    @property
    def radar_notes(self) -> tuple[str, ...]:
        """What else the user should know about the radar's messages, as sentences without their final periods."""
        return (*self.radar_option_notes, *(self._assembly.radar.layout.plan.notes if self._assembly.radar else ()))

    @property
    def returns_origin(self) -> ReturnsOrigin | None:
        """Whose frame the radar's returns are in; None without a radar."""
        return self._assembly.returns_origin

    @property
    def radar_option_notes(self) -> tuple[str, ...]:
        """What --radar-late and the radar's mount do, as sentences without their final periods."""
        late_s = self._assembly.radar_late_s
        side, change = ("late", "reduced") if late_s > 0 else ("early", "increased")
        words = (
            f"the radar's stamps are {abs(late_s):.9g} s too {side}, and {change} by that (--radar-late {late_s:.9g})"
        )
        origin = self.returns_origin
        return (*((words,) if late_s else ()), *(() if origin is None else origin.notes))

    @property
    def warnings(self) -> tuple[DataWarning, ...]:
        """What the user must know, including unreadable messages and damage found so far."""
        warnings = (*self._assembly.warnings, *(late for source in self.sources for late in source.later_warnings))
        return (*warnings, *self._unreadable(), *self._lost_warnings())

    @property
    def damage(self) -> tuple[DataWarning, ...]:
        """The warnings that a part of the recording is damaged or missing."""
        return tuple(warning for warning in self.warnings if warning.code in LOSSES)

    def _unreadable(self) -> Iterator[DataWarning]:
        """Warn about radar messages that could not be read so far."""
        for part in self._assembly.radar.parts if self._assembly.radar else ():
            if part.unreadable:
                row, why = next(iter(sorted(part.unreadable.items())))
                yield DataWarning.reported(
                    "unreadable-messages",
                    f"{len(part.unreadable)} radar messages could not be read and count as empty; "
                    f"the first is number {row}: {why}",
                    "if there are many, copy the file again from its source",
                )

    def _lost_warnings(self) -> Iterator[DataWarning]:
        losses = self.losses()
        if losses.lost:
            yield lost_returns(losses.lost, losses.read, "the radar")

    def lost_spans(self) -> tuple[TimesNs, TimesNs]:
        """Return where radar data of a damaged recording are lost: first (n,) and last (n,) stamps of its gaps, its cut-off end
        and its unreadable messages.
        """
        radar = self._assembly.radar
        if not self.damage or radar is None:
            return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
        unread = np.unique(np.concatenate([part.unreadable_times() for part in radar.parts]))
        seen = np.setdiff1d(self.radar_times, unread)
        seen = np.append(seen, self.image_times[self.image_times > self.radar_times[-1]][-1:])
        long = np.diff(seen) > _GAP * np.median(np.diff(self.radar_times)) if len(seen) > 1 else np.zeros(0, np.bool_)
        return np.append(seen[:-1][long], unread), np.append(seen[1:][long], unread)

    def losses(self, times: Sequence[TimeNs] | None = None, half_window_s: float = 0.0) -> Losses:
        """Count the radar's lost returns among the scans read so far.

        Args:
            times: those within half_window_s [s] of any of these; None for all.
            half_window_s: half the length of the windows.
        """
        parts = self._assembly.radar.parts if self._assembly.radar else ()
        return sum((part.losses(times, half_window_s) for part in parts), Losses())

    @property
    def other_azimuths(self) -> tuple[str, ...]:
        """The topics or columns with other azimuths of the radar's returns, of which at most one is true."""
        radar = self._assembly.radar
        return radar.other_azimuths if isinstance(radar, MergedStream) else ()

    @property
    def has_plain_clouds(self) -> bool:
        """Whether all radar messages are PointCloud2 with x, y, z in meters in the radar's axes, as any viewer draws them."""
        parts = self._assembly.radar.parts if self._assembly.radar else ()
        return bool(parts) and all(
            part.topic.type.replace("/msg/", "/") == "sensor_msgs/PointCloud2" and part.layout.plan.is_plain_xyz
            for part in parts
        )

    @property
    def radar_delay_ns(self) -> int:
        """The median time from a scan's stamp to its arrival [ns]; 0 by receive time or without a radar."""
        if self._assembly.radar is None:
            return 0
        return self._assembly.radar.parts[0].delay_ns - round(self._assembly.radar_late_s * NS_PER_S)

    @property
    def radar_sensors(self) -> tuple[RadarSensor, ...]:
        """The radars that were compared, the one in use first, with their figures; reads a sample if there is only one."""
        radar = self._assembly.radar
        if self._assembly.radar_sensors or radar is None:
            return self._assembly.radar_sensors
        name = radar.topic.name
        return (RadarSensor(name, (name,), (0,), (), self.radar_frame, figures_of(radar.parts[0])),)

    def other_image_times(self) -> Mapping[str, TimesNs]:
        """Return the stamps of the frames of each image topic that is not in use (m,), ascending; they are read here."""
        spare = {
            topic.name
            for topic in self.topics
            if topic.kind == "image" and not topic.chosen and not topic.problem and topic.count
        }
        topics = join_topics(self.sources, spare)[0]
        stamped = {both.topic.name: both for both in read_stamps([(topic, 12) for topic in topics]) if len(both.topic)}
        by_receive = self.image_clock == "receive"
        return {
            name: np.unique(both.topic.receive_ns if by_receive or both.header_ns is None else both.header_ns)
            for name, both in stamped.items()
        }

    def image_bytes(self, index: int) -> EncodedImage:
        """Return a frame as an image file: the recorded JPEG or PNG, or raw pixels encoded as JPEG.

        Args:
            index: into image_times.

        Raises:
            MessageError: the frame cannot be read.
            IndexError: there is no such frame.
        """
        return self._frames_with(index).encoded(index)

    def image(self, index: int) -> np.ndarray:
        """Return a frame's pixels: uint8 (h, w, 3), blue first as in OpenCV.

        Args:
            index: into image_times.

        Raises:
            MessageError: the frame cannot be read.
            IndexError: there is no such frame.
        """
        return self._frames_with(index).image(index)

    def recorded_format(self, index: int) -> str:
        """Return the format a frame was recorded in: "jpeg", "png", "raw bgr8", "h264 video" or "video file".

        Args:
            index: into image_times.

        Raises:
            MessageError: the frame cannot be read.
            IndexError: there is no such frame.
        """
        frames = self._frames_with(index)
        return "video file" if self.video_start is not None else frames.recorded_as(index)

    def _frames_with(self, index: int) -> ImageStream:
        self._check_open()
        images = self._assembly.images
        if images is None or not 0 <= index < len(self.image_times):
            raise IndexError(f"frame {index} of {len(self.image_times)}")
        return images

    def _check_open(self) -> None:
        if self._closed.is_set():
            raise RecordingError(f"{self.name}: the recording is closed")

    @property
    def image_names(self) -> tuple[str, ...]:
        """The names (m,) of the frames' files, without suffix; empty if the frames are not the files of a folder."""
        images = self._assembly.images
        source = images.topic.parts[0][0] if images is not None else None
        if images is None or len(images.topic.parts) > 1 or not isinstance(source, PlainSource):
            return ()
        return tuple(source.names[row] for row in images.topic.chunk[images.row].tolist()) if source.names else ()

    def camera(self) -> Camera | None:
        """Return the recorded intrinsics; None if there are no usable ones (see warnings)."""
        return self._assembly.camera

    def radar_scans(self, start: TimeNs | None = None, end: TimeNs | None = None) -> RadarScans:
        """Decode the scans with start <= stamp <= end; by default all of them, which uses unbounded memory.

        Args:
            start: first stamp; None for the beginning.
            end: last stamp; None for the end.
        """
        self._check_open()
        return self._assembly.radar.scans(start, end) if self._assembly.radar else RadarScans()

    def radar_windows(self) -> Iterator[RadarScans]:
        """Decode all scans in time order, a bounded number of returns at a time: for processing a whole recording."""
        self._check_open()
        return self._assembly.radar.windows() if self._assembly.radar else iter(())

    def radar_scans_around(self, times: Sequence[TimeNs], half_window_s: float) -> RadarScans:
        """Decode the scans within half_window_s [s] of any of the times, each scan once, in time order."""
        self._check_open()
        return self._assembly.radar.around(times, half_window_s) if self._assembly.radar else RadarScans()

    def boxes(self, topic: str) -> Boxes:
        """Decode a topic's boxes around objects, and give them the stamps of the frames they were made from.

        Args:
            topic: its name, such as /detections with vision_msgs/Detection2DArray.

        Raises:
            InputError: there is no such topic, it has no boxes, or they are not of the frames in use.
            MessageError: it cannot be read.
        """
        self._check_open()
        if self._assembly.images is None:
            raise InputError(f"{self.name}: has no camera frames that boxes could belong to; add the camera's file")
        found = next((one for one in join_topics(self.sources, {topic})[0] if len(one)), None)
        if found is None:
            able = ", ".join(one.name for one in self.topics if one.has_boxes) or "none"
            raise InputError(f"{self.name}: no messages of a topic {topic}; topics with boxes: {able}")
        images = self._assembly.images
        return boxes_in_topic(found, stamps_ns=_header_stamps(images, self.image_clock), times_ns=images.times_ns)

    def fingerprint(self, progress: Callable[[int, int], None] | None = None) -> tuple[InputFile, ...]:
        """Hash all files. The result is cached, since hashing takes about a second per gigabyte.

        Args:
            progress: called with the bytes done and the total bytes.
        """
        if self._fingerprint:
            return self._fingerprint
        total = sum(source.size_bytes for source in self.sources)
        done = 0
        files = []
        for source in self.sources:
            digest = hashlib.sha256()
            try:
                for path in files_behind(source.path):
                    with path.open("rb") as file:
                        while piece := file.read(_HASH_BYTES):
                            digest.update(piece)
                            done += len(piece)
                            if progress:
                                progress(min(done, total), total)
            except OSError as error:
                raise RecordingError(f"{source.path}: can no longer be read: {error.strerror}") from error
            files.append(InputFile(name_text(source.path.name), source.size_bytes, digest.hexdigest()))
        self._fingerprint = (*files, *(() if self._file is None else (self._file.file,)))
        return self._fingerprint


def _header_stamps(images: ImageStream, clock: str | None) -> TimesNs:
    """Return the stamps in the frames' messages, which boxes repeat; they are not those in use if receive times are."""
    if clock == "header":
        return images.times_ns
    stamped = read_stamps([(images.topic, _STAMP_BYTES)])[0]
    stamps = stamped.header_ns
    usable = stamps is not None and len(stamps) == len(images.topic) and bool((np.diff(stamps[images.row]) > 0).all())
    return stamps[images.row] if stamps is not None and usable else images.times_ns


def open_recording(
    paths: "str | Path | Sequence[str | Path]",
    options: RecordingOptions | None = None,
    *,
    require: Sequence[Need] = ("radar", "image"),
) -> Recording:
    """Open files and folders, in any mix of formats, as one recording.

    Opening reads the indexes and the stamps of the radar and camera messages: a few bytes per message in uncompressed
    chunks; compressed chunks that contain such messages are read once in full.

    Args:
        paths: ROS 1 .bag, ROS 2 .mcap and .db3 files, and folders of them; folders of images or of radar .pcd, .bin, CSV
            and JSON files; radar CSV and JSON lines; videos; folders of data sets.
        options: topics and clock.
        require: what it must contain; to read intrinsics, "image" is enough.

    Raises:
        RecordingError: it cannot be opened, or lacks what is required.
    """
    given = [Path(path) for path in ([paths] if isinstance(paths, str | Path) else paths)]
    chosen = tuple(path if path.name else path.absolute() for path in given)
    options, file = with_recording_file(require_files(chosen), options or RecordingOptions())
    streams, rest, taken = open_uart_streams(chosen, options.radar_start)
    sources: tuple[Source, ...] = streams
    try:
        plain, others = streams, rest
        if rest:
            plain, others = open_plain_sources(rest, replace(plain_options(options), taken=taken), streams)
        sources = plain
        sources = (*(open_sources(others) if others else ()), *plain)
        if file is not None:
            options, file = file.fitting(options, {c.topic for one in sources for c in one.channels}, require)
        return Recording(chosen, sources, _assembled(chosen, sources, options, require), options.video_start, file)
    except BaseException as error:
        for source in sources:
            source.close()
        if isinstance(error, OSError):
            where = error.filename or ", ".join(map(str, chosen))
            raise RecordingError(
                f"{where}: cannot be read: {error.strerror or error}; check it and its rights"
            ) from None
        if file is not None and file.used and isinstance(error, RecordingError):
            raise type(error)(f"{error} ({file.words}; --no-recording-file ignores it)") from error
        raise


def plain_options(options: RecordingOptions) -> PlainOptions:
    """Return what applies to files outside ROS containers.

    Raises:
        OptionError: --map, --radar-axes or --time-zone is malformed.
    """
    axes = None if options.radar_axes is None else parse_radar_axes(options.radar_axes)
    unit = "" if axes is None or axes.degrees is None else "deg" if axes.degrees else "rad"
    only_unit = options.radar_axes is not None and options.radar_axes.strip().lower() in ("degrees", "radians")
    return PlainOptions(
        video_start=options.video_start,
        mapped=parse_column_map(options.map),
        axes_given=axes is not None and not only_unit,
        angle_unit=unit,
        zone_s=parse_zone(options.time_zone),
    )


def _assembled(
    paths: tuple[Path, ...], sources: tuple[Source, ...], options: RecordingOptions, require: Sequence[Need]
) -> Assembly:
    """Assemble; if something is missing, say what was found in a folder and not used."""
    try:
        return assemble(paths, sources, options, require)
    except RecordingError as error:
        unused = next((w for source in sources for w in source.warnings if w.code == "unused-files"), None)
        if unused is None:
            raise
        raise type(error)(f"{error}; {warning_remark(unused).message}") from error


def inspect_recording(paths: "str | Path | Sequence[str | Path]", options: RecordingOptions | None = None) -> Recording:
    """Open files and folders for inspection; they need not contain a radar, a camera or any messages.

    Raises:
        RecordingError: a file cannot be opened, or a requested topic does not exist.
    """
    return open_recording(paths, options, require=())


def require_files(paths: Sequence[Path]) -> tuple[Path, ...]:
    """Return the paths if all of them are files or folders.

    Raises:
        RecordingError: one does not exist or is a pipe, a device or a socket, or none was given.
    """
    if not paths:
        raise RecordingError("no recording given; name one or more .bag, .mcap, .db3 files or bag folders")
    for path in paths:
        if not path.exists():
            raise RecordingError(no_such(path))
        if (kind := special_kind(path)) is not None:
            raise RecordingError(
                f"{path}: is {kind}; a recording must be a regular file or a folder: save it to a file first"
            )
    return tuple(paths)


def first_image(paths: Sequence[Path], options: RecordingOptions | None = None) -> EncodedImage | None:
    """Return an image from the beginning of a recording, reading very little of it.

    It comes from the camera that opening the recording will most likely choose, and is not always the first frame of the
    timeline.

    Args:
        paths: as for open_recording.
        options: as for open_recording.

    Returns:
        None if the whole recording must be read first: it is damaged, compressed, a video, or not a recording.
    """
    options = options or RecordingOptions()
    try:
        for source in open_beginnings(paths, _is_image):
            try:
                image = _image(source, options)
            finally:
                source.close()
            if image is not None:
                return image
    except (RecordingError, OSError):
        return None  # opening the recording reports what is wrong
    return None


def _is_image(channel: Channel) -> bool:
    try:
        return is_image(definition_of(channel))
    except RecordingError:
        return False


def _image(source: Source, options: RecordingOptions) -> EncodedImage | None:
    topics, _ = join_topics((source,))
    inventory = Inventory(source.path.name, topics, {topic.name: _usage(topic) for topic in topics}, _counts(source))
    topic = select_image(inventory, options.image_topic if options.image_topic in inventory.usages else None)
    layout = inventory.usages[topic.name].image if topic is not None else None
    if topic is None or layout is None:
        return None
    payload = topic.payload(0)
    return None if layout.packet(payload) is not None else layout.encoded(payload)


def _usage(topic: Topic) -> Usage:
    """Inspect the messages of image topics; of other topics, only the declaration."""
    channel = topic.parts[0][1]
    if _is_image(channel):
        return usage_of(topic)
    try:
        return Usage("camera-info" if is_camera_info(definition_of(channel)) else "other")
    except RecordingError:
        return Usage("other")


def _counts(source: Source) -> Mapping[str, int]:
    found: dict[str, int] = {}
    for channel in source.channels:
        found[channel.topic] = found.get(channel.topic, 0) + source.counts.get(channel.id, 0)
    return found
