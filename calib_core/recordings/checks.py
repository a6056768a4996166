"""Warnings about a recording: no overlap, lost messages, lidars, radars without elevation, repeated stamps."""

from collections.abc import Collection

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.errors import MessageError, RecordingError
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.recordings.assumptions import Assumption
from calib_core.recordings.camera.image_stream import ImageStream
from calib_core.recordings.radar.scan_stream import RadarStream
from calib_core.recordings.radar.several_topics.merged_stream import MergedStream
from calib_core.recordings.stamping import StampedTopic
from calib_core.recordings.time.written_times import utc
from calib_core.results import DataWarning

_SAMPLED_SCANS = 12
_ZONES_S = range(-12 * 3600, 14 * 3600 + 1, 15 * 60)


def about_lost(name: str, count: int, stamped: StampedTopic) -> list[DataWarning]:
    """Warn about the unreadable messages of a topic.

    Raises:
        MessageError: none of them can be read.
    """
    if not stamped.lost:
        return []
    if not len(stamped.topic):
        raise MessageError(f"topic {name}: none of its {count} messages can be read: {stamped.fault}")
    return [
        DataWarning(
            "unreadable-messages",
            f"{stamped.lost} of {count} messages of {name} cannot be read and are skipped: {stamped.fault}",
            "if there are many, copy the file again from its source",
        )
    ]


def check_overlap(
    name: str,
    radar: RadarStream | MergedStream | None,
    images: ImageStream | None,
    *,
    required: bool,
    zoneless: Collection[str] = (),
) -> list[DataWarning]:
    """Check that the time intervals of both sensors overlap.

    Args:
        name: of the recording.
        radar: the radar stream, if any.
        images: the image stream, if any.
        required: raise an error if they do not overlap, instead of returning a warning.
        zoneless: topics whose times come from dates without a time zone.

    Raises:
        RecordingError: they do not overlap, but are required to.
    """
    if radar is None or images is None:
        return []
    a, b = radar.times_ns, images.times_ns
    if a[0] <= b[-1] and b[0] <= a[-1]:
        return []
    gap_s = max(int(a[0] - b[-1]), int(b[0] - a[-1])) / NS_PER_S
    what = (
        f"{radar.topic.name} ({_interval(a)}) and {images.topic.name} ({_interval(b)}) do not overlap in time: "
        f"{gap_s:.1f} s apart"
    )
    hint = "open recordings made at the same time; if only the clocks differ, try --clock receive or --clock header"
    local = [stream.topic.name for stream in (radar, images) if stream.topic.name in zoneless]
    offset_s = _zone_between(*((a, b) if local == [radar.topic.name] else (b, a))) if len(local) == 1 else None
    if offset_s is not None:
        hours, minutes = divmod(abs(offset_s) // 60, 60)
        zone = f"{'-' if offset_s < 0 else '+'}{hours:02d}:{minutes:02d}"
        hint = f"the dates of {local[0]} have no time zone; with --time-zone {zone} they overlap"
    if required:
        raise RecordingError(f"{name}: {what}; {hint}")
    return [DataWarning("no-overlap", what, hint)]


def without_certain_zone(
    assumptions: tuple[Assumption, ...], radar: RadarStream | MergedStream | None, images: ImageStream | None
) -> tuple[Assumption, ...]:
    """Leave out that dates are UTC where radar and camera would never meet in any other time zone.

    Args:
        assumptions: about the topics in use.
        radar: the radar stream, if any.
        images: the image stream, if any.
    """
    zoneless = {one.topic for one in assumptions if one.key == "time-zone"}
    if radar is None or images is None or not zoneless:
        return assumptions
    of_radar = {part.topic.name for part in radar.parts} <= zoneless
    if of_radar == (images.topic.name in zoneless):
        return assumptions
    local_ns, others_ns = (radar.times_ns, images.times_ns) if of_radar else (images.times_ns, radar.times_ns)
    met = [offset_s for offset_s, overlap_ns in _zone_overlaps(local_ns, others_ns).items() if overlap_ns >= 0]
    return assumptions if met != [0] else tuple(one for one in assumptions if one.key != "time-zone")


def _zone_between(local_ns: TimesNs, others_ns: TimesNs) -> int | None:
    """Return the offset from UTC [s] with which local times overlap the others most; None if none does."""
    overlaps = _zone_overlaps(local_ns, others_ns)
    best = max(overlaps, key=lambda offset_s: (overlaps[offset_s], offset_s % 3600 == 0))
    return best if overlaps[best] >= 0 else None


def _zone_overlaps(local_ns: TimesNs, others_ns: TimesNs) -> dict[int, int]:
    """Return for each offset from UTC [s] for how long [ns] local times overlap the others; negative if they do not."""
    overlaps = {}
    for offset_s in _ZONES_S:
        low, high = (int(end) - offset_s * NS_PER_S for end in (local_ns[0], local_ns[-1]))
        overlaps[offset_s] = min(high, int(others_ns[-1])) - max(low, int(others_ns[0]))
    return overlaps


def _interval(times_ns: TimesNs) -> str:
    return f"{utc(TimeNs(int(times_ns[0])))} to {utc(TimeNs(int(times_ns[-1])))}"


def about_radar(radar: RadarStream | MergedStream | None) -> list[DataWarning]:
    """Warn if the radar looks like a lidar or measures no elevation, judging by a dozen scans."""
    if radar is None:
        return []
    name, layout = radar.topic.name, radar.layout
    warnings = []
    if layout.lidar_like:
        warnings.append(
            DataWarning(
                "looks-like-lidar",
                f"{name} looks like a lidar: {layout.description}",
                "choose the radar with --radar-topic, or add the file that contains it",
            )
        )
    height = radar.sample(_SAMPLED_SCANS).points_radar_m[:, 2]
    height = height[np.isfinite(height)]
    if len(height) > 1 and np.all(height == height[0]):
        warnings.append(
            DataWarning(
                "flat-radar",
                f"{name} has the same height ({height[0]:g} m) for every return: it measures no elevation",
                "put the reflector's centre at the radar's height at every placement, and measure the camera position",
            )
        )
    return warnings


def about_images(images: ImageStream | None) -> list[DataWarning]:
    """Warn about images skipped because of repeated stamps."""
    if images is None or not images.repeated:
        return []
    return [
        DataWarning(
            "repeated-stamps",
            f"{images.repeated} images of {images.topic.name} have the stamp of another image; only the first of each is shown",
            "no action needed for a few; if there are many, the camera driver writes wrong stamps: try --clock receive",
        )
    ]
