"""Clicks from a file, moved to the frames they were made in: another program may have rounded their stamps."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.errors import InputError
from calib_core.measurements import NS_PER_S, ReflectorClick, TimeNs, time_parts

_ROUNDED_NS = 1_000
"""Names of images and many programs state microseconds: a click that is off by less names its frame all the same."""


@dataclass(frozen=True, slots=True)
class ClicksAtFrames:
    """Clicks with the stamps of frames.

    Attributes:
        clicks: sorted by time.
        notes: one sentence per click whose stamp was no frame's, rounding to microseconds aside: moved, or set aside.
    """

    clicks: tuple[ReflectorClick, ...]
    notes: tuple[str, ...]


def clicks_at_frames(
    clicks: Sequence[ReflectorClick],
    image_times: TimesNs,
    *,
    source: str,
    others: Callable[[], Mapping[str, TimesNs]] = dict,
) -> ClicksAtFrames:
    """Move each click to the nearest frame if that is at most half a frame interval away, and set others aside.

    Args:
        clicks: as read from a file.
        image_times: (m,) stamps of the frames [ns], ascending; at least one.
        source: name of the file, for messages.
        others: gives the stamps of the frames of the image topics that are not in use.

    Raises:
        InputError: half of the clicks or more are farther from every frame, and the first one is named; or the stamps are those
            of another topic.
    """
    _require_own_topic(clicks, image_times, source, others)
    half_ns = half_interval_ns(image_times)
    at_frames, moved, aside = [], [], []
    for click in clicks:
        index = nearest_frame(image_times, click.image_time)
        frame = TimeNs(int(image_times[index]))
        if frame == click.image_time:
            at_frames.append(click)
            continue
        what = f"click {click.id} at {_seconds(click.image_time)} has the stamp of no frame; the nearest is frame {index + 1}"
        where = f"at {_seconds(frame)}, {_milliseconds(frame - click.image_time)}"
        if abs(frame - click.image_time) > half_ns:
            aside.append(f"{what} {where}, which is more than half a frame interval ({half_ns / 1e6:.1f} ms)")
            continue
        at_frames.append(replace(click, image_time=frame))
        if abs(frame - click.image_time) >= _ROUNDED_NS:
            moved.append(f"{what} {where}, and is used")
    if aside and 2 * len(aside) >= len(clicks):
        raise InputError(f"{source}: {aside[0]}; give the clicks of this recording, with the stamps of its frames")
    return ClicksAtFrames(tuple(sorted(at_frames)), (*moved, *(f"{line}, and is set aside" for line in aside)))


def _require_own_topic(
    clicks: Sequence[ReflectorClick], image_times: TimesNs, source: str, others: Callable[[], Mapping[str, TimesNs]]
) -> None:
    if _all_at(clicks, image_times):
        return
    for topic, times in others().items():
        if _all_at(clicks, times):
            raise InputError(
                f"{source}: its clicks have the stamps of the frames of {topic}, which is not in use; choose these images with "
                f"--image-topic {topic}, or give clicks in the images in use"
            )


def _all_at(clicks: Sequence[ReflectorClick], image_times: TimesNs) -> bool:
    nearest = (int(image_times[nearest_frame(image_times, click.image_time)]) - click.image_time for click in clicks)
    return all(abs(off_ns) < _ROUNDED_NS for off_ns in nearest)


def half_interval_ns(image_times: TimesNs) -> int:
    """Return half the usual time between two frames [ns]; 0 if there is only one."""
    return int(np.median(np.diff(image_times))) // 2 if len(image_times) > 1 else 0


def nearest_frame(image_times: TimesNs, time: TimeNs) -> int:
    """Return the index of the nearest frame; of two equally near, the earlier one.

    Args:
        image_times: (m,) stamps of the frames [ns], ascending; at least one.
        time: any stamp.
    """
    after = min(int(np.searchsorted(image_times, time)), len(image_times) - 1)
    before = max(after - 1, 0)
    return before if abs(time - int(image_times[before])) <= abs(int(image_times[after]) - time) else after


def _seconds(time: TimeNs) -> str:
    sec, nanosec = time_parts(time)
    return f"{sec}.{nanosec:09d} s"


def _milliseconds(later_ns: int) -> str:
    """Return a difference in time in words."""
    amount = abs(later_ns) * 1e3 / NS_PER_S
    text = f"{amount:.3f} ms" if amount < 1000 else f"{amount / 1e3:.3f} s"
    return f"{text} {'later' if later_ns > 0 else 'earlier'}"
