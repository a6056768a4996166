"""Warnings about a recording: no overlap, lost messages, lidars, radars without elevation, columns that contradict each other."""

from collections.abc import Collection

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.errors import MessageError, RecordingError
from calib_core.measurements import NS_PER_S, DataWarning, TimeNs
from calib_core.radar import polar_from_cartesian
from calib_core.recordings.camera.image_stream import ImageStream
from calib_core.recordings.containers.sources import Assumption
from calib_core.recordings.messages.foxglove import pose_target
from calib_core.recordings.radar.column_guess import forward_axis
from calib_core.recordings.radar.column_plan import ColumnPlan
from calib_core.recordings.radar.columns import Returns
from calib_core.recordings.radar.merging import MergedStream
from calib_core.recordings.radar.scan_stream import RadarStream
from calib_core.recordings.time.written_times import utc
from calib_core.recordings.topics import StampedTopic, Topic

_FEW = 5
_MIN_ANGLE_RAD = 0.02
_MIRROR = "--radar-axes forward,right,up"
_SAMPLED_SCANS = 12
_ZONES_S = range(-12 * 3600, 14 * 3600 + 1, 15 * 60)
_HOURS_S = range(-14 * 3600, 14 * 3600 + 1, 3600)


def claim_warnings(radar: RadarStream) -> list[DataWarning]:
    """Warn about contradictions in a sample of a radar's messages."""
    plan, name = radar.layout.plan, radar.topic.name
    return _contradictions(name, plan, radar.claims(_SAMPLED_SCANS)) if any(plan.claimed) else []


def _contradictions(name: str, plan: ColumnPlan, returns: Returns) -> list[DataWarning]:
    if returns.claimed_polar is None:
        return []
    sound = np.isfinite(returns.points_radar_m).all(axis=1)
    points, claimed = returns.points_radar_m[sound], returns.claimed_polar[sound]
    if len(points) < _FEW:
        return []
    if plan.polar:
        return _angle_unit(name, plan, claimed[:, 1:])
    own = polar_from_cartesian(points)
    return [
        *_range(name, plan, claimed[:, 0], own[:, 0]),
        *_azimuth(name, plan, claimed[:, 1], own[:, 1]),
    ]


def _angle_unit(name: str, plan: ColumnPlan, angles: np.ndarray) -> list[DataWarning]:
    """Warn about angles whose values do not fit the unit they are read in."""
    angles = np.abs(angles[np.isfinite(angles)])
    if not len(angles) or not angles.any():
        return []
    largest = float(angles.max())
    if not plan.degrees and largest > 2.0 * np.pi:
        what, hint = f"has angles up to {largest:.1f}, which cannot be radians", "degrees"
    elif plan.degrees and largest < np.pi / 2 and len(angles) >= 4 * _FEW:
        what, hint = f"has no angle above {largest:.2f}, which is small for degrees", "radians"
    else:
        return []
    read = "degrees" if plan.degrees else "radians"
    return [
        DataWarning.reported(
            "radar-angle-unit", f"{name} {what}; they are read as {read}", f"if they are {hint}: --radar-axes {hint}"
        )
    ]


def _range(name: str, plan: ColumnPlan, claimed: np.ndarray, own: np.ndarray) -> list[DataWarning]:
    known = np.isfinite(claimed) & (claimed != 0)
    if np.count_nonzero(known) < _FEW:
        return []
    apart = np.abs(claimed[known] - own[known])
    typical = float(np.median(apart))
    if typical <= 0.1 + 0.02 * float(np.median(own[known])):
        return []
    return [
        DataWarning.reported(
            "radar-range-contradicts",
            f"{name}: {plan.claimed[0]} and the length of {', '.join(plan.position)} differ by {typical:.2f} m (median); "
            "the positions are used",
            "ask the driver's authors which is right: positions may be in another unit or frame, such as the vehicle's",
        )
    ]


def _azimuth(name: str, plan: ColumnPlan, claimed: np.ndarray, own: np.ndarray) -> list[DataWarning]:
    """Find the sign and unit in which the message's azimuth matches its x and y."""
    telling = np.isfinite(claimed) & (np.abs(own) > _MIN_ANGLE_RAD)
    if plan.axes is not None or np.count_nonzero(telling) < _FEW or not np.any(claimed[telling]):
        return []
    claimed, own = claimed[telling], own[telling]
    apart = {
        (sign, unit): float(np.median(np.abs(np.angle(np.exp(1j * (sign * scale * claimed - own))))))
        for sign in (1, -1)
        for unit, scale in (("rad", 1.0), ("deg", np.pi / 180.0))
    }
    (sign, _), error = min(apart.items(), key=lambda item: item[1])
    columns = f"{name}: {plan.claimed[1]} and the direction of {plan.position[0]}, {plan.position[1]}"
    if error > 0.1:
        return [
            DataWarning.reported(
                "radar-azimuth-contradicts",
                f"{columns} disagree in every unit and sign (by {np.degrees(error):.0f} degrees at best); "
                "the positions are used",
                "ask the driver's authors which is right; if x is not forward, say so with --radar-axes",
            )
        ]
    if sign > 0:
        return []
    return [
        DataWarning.reported(
            "radar-azimuth-mirrored",
            f"{columns} have opposite signs; the positions are used, with y to the left",
            f"if y points to the right: {_MIRROR}; the handedness check of the calibration shows which is right",
        )
    ]


def lost_message_warnings(name: str, count: int, stamped: StampedTopic) -> list[DataWarning]:
    """Warn about the unreadable messages of a topic.

    Raises:
        MessageError: none of them can be read.
    """
    if not stamped.lost:
        return []
    if not len(stamped.topic):
        raise MessageError(f"topic {name}: none of its {count} messages can be read: {stamped.fault}")
    return [
        DataWarning.reported(
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
    elif (hours_s := _zone_between(a, b, _HOURS_S)) is not None:
        hint = f"they overlap if the radar's clock is {hours_s // 3600:+d} h off, as of another time zone: --radar-late {hours_s}"
    if required:
        raise RecordingError(f"{name}: {what}; {hint}")
    return [DataWarning.reported("no-overlap", what, hint)]


def without_certain_zone(
    assumptions: tuple[Assumption, ...], radar: RadarStream | MergedStream | None, images: ImageStream | None
) -> tuple[Assumption, ...]:
    """Leave out that dates are UTC where radar and camera would never meet in any other time zone.

    Args:
        assumptions: about the topics in use.
        radar: the radar stream, if any.
        images: the image stream, if any.
    """
    zoneless = {assumption.topic for assumption in assumptions if assumption.key == "time-zone"}
    if radar is None or images is None or not zoneless:
        return assumptions
    of_radar = {part.topic.name for part in radar.parts} <= zoneless
    if of_radar == (images.topic.name in zoneless):
        return assumptions
    local_ns, others_ns = (radar.times_ns, images.times_ns) if of_radar else (images.times_ns, radar.times_ns)
    met = [offset_s for offset_s, overlap_ns in _zone_overlaps(local_ns, others_ns).items() if overlap_ns >= 0]
    return (
        assumptions if met != [0] else tuple(assumption for assumption in assumptions if assumption.key != "time-zone")
    )


def _zone_between(local_ns: TimesNs, others_ns: TimesNs, zones_s: range = _ZONES_S) -> int | None:
    """Return the offset from UTC [s] with which local times overlap the others most; None if none does."""
    overlaps = _zone_overlaps(local_ns, others_ns, zones_s)
    best = max(overlaps, key=lambda offset_s: (overlaps[offset_s], offset_s % 3600 == 0))
    return best if overlaps[best] >= 0 else None


def _zone_overlaps(local_ns: TimesNs, others_ns: TimesNs, zones_s: range = _ZONES_S) -> dict[int, int]:
    """Return for each offset from UTC [s] for how long [ns] local times overlap the others; negative if they do not."""
    overlaps = {}
    for offset_s in zones_s:
        low, high = (int(end) - offset_s * NS_PER_S for end in (local_ns[0], local_ns[-1]))
        overlaps[offset_s] = min(high, int(others_ns[-1])) - max(low, int(others_ns[0]))
    return overlaps


def _interval(times_ns: TimesNs) -> str:
    return f"{utc(TimeNs(int(times_ns[0])))} to {utc(TimeNs(int(times_ns[-1])))}"


def radar_warnings(radar: RadarStream | MergedStream | None) -> list[DataWarning]:
    """Warn if the radar looks like a lidar or measures no elevation, judging by a dozen scans."""
    if radar is None:
        return []
    name, layout = radar.topic.name, radar.layout
    warnings = []
    if layout.lidar_like:
        warnings.append(
            DataWarning.reported(
                "looks-like-lidar",
                f"{name} looks like a lidar: {layout.description}",
                "choose the radar with --radar-topic, or add the file that contains it",
            )
        )
    points = radar.sample(_SAMPLED_SCANS).points_radar_m
    if not layout.lidar_like and layout.plan.axes is None and forward_axis(*points[:, :2].T) == "y":
        warnings.append(
            DataWarning.reported(
                "radar-looks-left",
                f"{name}: y is never negative and x has both signs: y seems to point forward and x to the right",
                "if so, read it with --radar-axes right,forward,up; if the radar looks to the left of the vehicle, its returns "
                "are in the vehicle's frame, and its own is needed",
            )
        )
    height = points[:, 2]
    height = height[np.isfinite(height)]
    if len(height) > 1 and np.all(height == height[0]):
        warnings.append(
            DataWarning.reported(
                "flat-radar",
                f"{name} has the same height ({height[0]:g} m) for every return: it measures no elevation",
                "put the reflector's center at the radar's height at every placement, and measure the camera position",
            )
        )
    return warnings


def camera_frame_warnings(name: str, frame: str, of_images: str) -> list[DataWarning]:
    """Warn if the intrinsics are of another frame than the images.

    Args:
        name: of the topic with the intrinsics.
        frame: its frame_id.
        of_images: that of the images.
    """
    if not frame or not of_images or frame == of_images:
        return []
    return [
        DataWarning.reported(
            "camera-frame",
            f"{name} is of the frame '{frame}', the images are of '{of_images}'",
            "if it is another camera's, choose the intrinsics with --camera-info-topic or --camera",
        )
    ]


def posed_cloud_warnings(topic: Topic) -> list[DataWarning]:
    """Warn if the points of a radar's clouds have a pose of their own: they are read without it, as the radar measured them."""
    frame = pose_target(*topic.stored(0)) if len(topic) else None
    if frame is None:
        return []
    return [
        DataWarning.reported(
            "radar-cloud-posed",
            f"{topic.name}: its points have a pose in '{frame}', and are read in their own frame, without it",
            "no action needed if that is the radar's own; the calibration is of this frame, which has no name",
        )
    ]


def image_warnings(images: ImageStream | None) -> list[DataWarning]:
    """Warn about images skipped because of repeated stamps."""
    if images is None or not images.repeated:
        return []
    return [
        DataWarning.reported(
            "repeated-stamps",
            f"{images.repeated} images of {images.topic.name} have the stamp of another image; only the first of each is shown",
            "no action needed for a few; if there are many, the camera driver writes wrong stamps: try --clock receive",
        )
    ]
