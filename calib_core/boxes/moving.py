"""Boxes around what moves before a fixed camera: the difference of each frame from the scene without movement.

The background is the median of frames spread over the recording, its noise the median deviation from it. A frame's
brightness is fitted to the background per channel, pixels that differ by many sigmas are joined to regions, regions to
boxes, and boxes that overlap from frame to frame to tracks. Everything happens in images of at most 480 pixels across.
"""

import contextlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.errors import InputError, MessageError, NoAnswerError
from calib_core.measurements import Box, Boxes, FrameBoxes, TimeNs

MOVING = "moving"
"""The label of every box, and the word for --boxes."""

_WORKING_WIDTH_PX = 480
_BACKGROUND_FRAMES = 25
_FEWEST_FRAMES = 5
_LEAST_SIGMA = 2.5
"""Grey levels: what JPEG and a sensor do to a pixel in which nothing happens."""
_UNSTEADY_SIGMA = 10.0
"""Grey levels: beyond it, a pixel shows different things at different times."""
_SIGMAS = 6.0
_LEAST_AREA = 40
"""Pixels of the working image: a person of 5 by 16 pixels has some 50."""
_DEEPEST_SHADOW = 0.5
_SHADOW_TINT = 0.12
"""Of the factor by which a shadow darkens the channels: the sky still lights it, bluer than the sun."""
_MOST_CHANGED = 0.4
_MOST_CHANGED_FRAMES = 0.5
_TURNED_SHARE = 0.1
"""By how much more of the image changes for good when the camera turns by a degree; traffic covers less, and passes."""
_JOIN_PX = 5
_STEP_NS = 200_000_000
_STRETCH_FRAMES = 30


@dataclass(frozen=True, slots=True, eq=False)
class Background:
    """The scene without movement, in the working size.

    Attributes:
        median: (h, w, 3) float32 grey levels.
        sigma: (h, w, 3) float32 of a pixel's usual deviation.
    """

    median: np.ndarray
    sigma: np.ndarray


def changed_boxes(
    read_image: Callable[[int], np.ndarray],
    image_times: TimesNs,
    *,
    source: str = MOVING,
    most_frames: int = 600,
    progress: Callable[[int, int], None] | None = None,
) -> Boxes:
    """Find what moves before a fixed camera; the boxes carry the label "moving" and tracks.

    At most most_frames frames and 25 for the background are decoded; of these, 25 are in memory, reduced. A recording with more
    frames is looked at in stretches of 6 s at 5 Hz, evenly spread: within a stretch an object keeps its track.

    Args:
        read_image: returns frame i as uint8 (h, w, 3); raises MessageError for one that cannot be read.
        image_times: (m,) stamps of the frames, ascending.
        source: for messages.
        most_frames: how many frames to look at.
        progress: called with the frames done and their number.

    Raises:
        InputError: there are too few readable frames, nothing moves, or the camera itself does.
    """
    images = list(_readable(read_image, _spread(len(image_times), _BACKGROUND_FRAMES)))
    if len(images) < _FEWEST_FRAMES:
        raise InputError(
            f"{source}: {len(images)} readable frames; finding movement needs {_FEWEST_FRAMES} or more: record for longer"
        )
    small = [reduced(image) for _, image in images]
    size = (images[0][1].shape[1], images[0][1].shape[0])
    turned = _turned_at(small)
    turned_index = images[turned][0] if turned else len(image_times)
    del images
    backgrounds = [background_of(part) for part in (small[:turned], small[turned:]) if part]
    for part, background in zip((small[:turned], small[turned:]) if turned else (small,), backgrounds, strict=True):
        _refuse_moving_camera([_changed_pixels(image, background) for image in part], background, source)
    found: list[tuple[TimeNs, list[Box]]] = []
    stretches = _stretches(image_times, most_frames)
    total = sum(map(len, stretches))
    named: list[FrameBoxes] = []
    first_track = 1
    for stretch in stretches:
        found = []
        for index, image in _readable(read_image, stretch):
            background = backgrounds[-1 if index >= turned_index else 0]
            found.append((TimeNs(int(image_times[index])), _regions(_changed_pixels(reduced(image), background), size)))
            if progress:
                progress(len(named) + len(found), total)
        tracks = tracked([boxes for _, boxes in found], first_track)
        first_track += len({box.track for boxes in tracks for box in boxes})
        named.extend(FrameBoxes(time, boxes) for (time, _), boxes in zip(found, tracks, strict=True))
    if not any(frame.boxes for frame in named):
        raise NoAnswerError(f"{source}: nothing moves in {len(named)} frames looked at; give a file or topic of boxes")
    notes = [
        f"boxes are around whatever changes in the image; {len(named)} of {len(image_times)} frames were looked at"
    ]
    if turned:
        notes.append(f"the camera turned before frame {turned_index}: each side of it has a background of its own")
    return Boxes(tuple(named), source, size, tuple(notes))


def _readable(read_image: Callable[[int], np.ndarray], indices: Sequence[int]) -> Iterator[tuple[int, np.ndarray]]:
    """Yield the frames that can be read and have one size: that of the first."""
    shape: tuple[int, ...] = ()
    for index in indices:
        with contextlib.suppress(MessageError):
            image = read_image(index)
            shape = shape or image.shape
            if image.shape == shape:
                yield index, image


def _spread(count: int, most: int) -> list[int]:
    """Return at most so many of the first count numbers, evenly spread."""
    if not count:
        return []
    spread: list[int] = np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64)).tolist()
    return spread


def _stretches(image_times: TimesNs, most: int) -> list[range]:
    """Return the frames to look at: all, or evenly spread stretches of neighbours 0.2 s apart."""
    count = len(image_times)
    if count <= most:
        return [range(count)]
    step = max(1, round(_STEP_NS / max(1.0, float(np.median(np.diff(image_times))))))
    if count <= most * step:
        return [range(0, count, step)]
    span = _STRETCH_FRAMES * step
    starts = _spread(count - span + 1, max(1, most // _STRETCH_FRAMES))
    return [range(start, start + span, step) for start in starts]


def reduced(image: np.ndarray) -> np.ndarray:
    """Reduce an image to the working size; each pixel is the mean of those it replaces."""
    import cv2

    height, width = image.shape[:2]
    if width <= _WORKING_WIDTH_PX:
        return np.ascontiguousarray(image)
    reduced_height = max(1, round(height * _WORKING_WIDTH_PX / width))
    return np.asarray(cv2.resize(image, (_WORKING_WIDTH_PX, reduced_height), interpolation=cv2.INTER_AREA))


def background_of(images: Sequence[np.ndarray]) -> Background:
    """Return the median of the frames, each brought to its brightness, and what is left of their deviations from it."""
    stack = np.stack(images)
    median = np.median(stack, axis=0).astype(np.float32)
    for image in stack:
        image[...] = np.clip(image / _gain(image.astype(np.float32), median), 0, 255)
    median = np.median(stack, axis=0).astype(np.float32)
    deviation = np.median(np.abs(stack - median), axis=0).astype(np.float32)
    return Background(median, np.maximum(1.4826 * deviation, _LEAST_SIGMA).astype(np.float32))


def _turned_at(images: Sequence[np.ndarray]) -> int:
    """Return the number of the first image after the camera turned for good; 0 if it did not.

    Images that differ from the first ones in much more of the scene than those between do are of a camera that turned.
    """
    if len(images) < 2 * _FEWEST_FRAMES:
        return 0
    first = background_of(images[:_FEWEST_FRAMES])
    shares = np.array([_changed_pixels(image, first).mean() for image in images])
    splits = range(_FEWEST_FRAMES, len(images) - _FEWEST_FRAMES + 1)
    steps = [float(np.median(shares[k:]) - np.median(shares[:k])) for k in splits]
    weights = [k * (len(images) - k) * (shares[k:].mean() - shares[:k].mean()) ** 2 for k in splits]
    best = int(np.argmax(weights))
    return splits[best] if steps[best] > _TURNED_SHARE else 0


def _gain(values: np.ndarray, middle: np.ndarray) -> np.ndarray:
    """Return by how much a frame is brighter than the background: (3,), the median over the pixels that are not at an end."""
    usable = (middle > 8) & (middle < 247)
    gains = [
        float(np.median(values[..., channel][mask] / middle[..., channel][mask])) if mask.any() else 1.0
        for channel, mask in enumerate(np.moveaxis(usable, -1, 0))
    ]
    return np.clip(np.array(gains, dtype=np.float32), 0.5, 2.0)


def _changed_pixels(image: np.ndarray, background: Background) -> np.ndarray:
    """Return which pixels of a frame differ from the background: (h, w) bool, cleaned of specks."""
    import cv2

    values = image.astype(np.float32)
    expected = _gain(values, background.median) * background.median
    off = np.abs(values - expected) / background.sigma
    strong = ((_over_channels(np.maximum, off) > _SIGMAS) & ~_is_shadow(values, expected)).astype(np.uint8)
    kernel = np.ones((3, 3), dtype=np.uint8)
    opened = cv2.morphologyEx(strong, cv2.MORPH_OPEN, kernel)
    framed = cv2.copyMakeBorder(opened, *(_JOIN_PX,) * 4, cv2.BORDER_CONSTANT, value=0)
    joined = cv2.morphologyEx(framed, cv2.MORPH_CLOSE, np.ones((2 * _JOIN_PX + 1,) * 2, dtype=np.uint8))
    return np.asarray(joined)[_JOIN_PX:-_JOIN_PX, _JOIN_PX:-_JOIN_PX].astype(bool)


def _over_channels(pick: np.ufunc, values: np.ndarray) -> np.ndarray:
    """Return the largest or smallest of three channels (h, w); a reduction over so short an axis takes ten times as long."""
    blue, green, red = np.moveaxis(values, -1, 0)
    return np.asarray(pick(pick(blue, green), red))


def _is_shadow(values: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Return which pixels are the background in shadow: (h, w) bool. A shadow darkens all channels by about one factor."""
    share = values / np.maximum(expected, 1.0)
    darkest, brightest = _over_channels(np.minimum, share), _over_channels(np.maximum, share)
    inside = (darkest > _DEEPEST_SHADOW) & (brightest < 1.0)
    return np.asarray(inside & (brightest - darkest < _SHADOW_TINT))


def _refuse_moving_camera(masks: Sequence[np.ndarray], background: Background, source: str) -> None:
    """Refuse frames in which most of the image changes.

    Raises:
        InputError: it does, in most frames.
    """
    unsteady = background.sigma.max(axis=-1) > _UNSTEADY_SIGMA
    shares = np.array([(mask | unsteady).mean() for mask in masks])
    moved = int(np.count_nonzero(shares > _MOST_CHANGED))
    if moved > _MOST_CHANGED_FRAMES * len(shares):
        raise InputError(
            f"{source}: more than {100 * _MOST_CHANGED:.0f} % of the image changes in {moved} of {len(shares)} frames, so "
            "the camera itself moves; movement is found for a fixed camera only: give a file or topic of boxes"
        )


def _regions(mask: np.ndarray, size: tuple[int, int]) -> list[Box]:
    """Return a box around each region of a mask, in pixels of the recorded image."""
    import cv2

    if mask.mean() > _MOST_CHANGED:  # a flash, or the exposure at work
        return []
    _, _, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    parts = [row for row in stats[1:].tolist() if row[cv2.CC_STAT_AREA] >= _LEAST_AREA]
    edges = _merged([(left, top, left + width, top + height) for left, top, width, height, _ in parts])
    across, down = size[0] / mask.shape[1], size[1] / mask.shape[0]
    return [
        Box(left * across - 0.5, top * down - 0.5, right * across - 0.5, bottom * down - 0.5, MOVING)
        for left, top, right, bottom in edges
    ]


def _merged(parts: list[tuple[int, int, int, int]]) -> list[tuple[int, int, int, int]]:
    """Join boxes that overlap, or that stand above each other with a small gap, as head and legs of a person."""
    merged: list[tuple[int, int, int, int]] = []
    for part in sorted(parts):
        found = part
        while True:
            touching = [one for one in merged if _belong_together(one, found)]
            if not touching:
                break
            merged = [one for one in merged if one not in touching]
            every = [found, *touching]
            low, high = zip(*((one[:2], one[2:]) for one in every), strict=True)
            found = (*np.min(low, axis=0).tolist(), *np.max(high, axis=0).tolist())
        merged.append(found)
    return merged


def _belong_together(one: tuple[int, int, int, int], other: tuple[int, int, int, int]) -> bool:
    across = min(one[2], other[2]) - max(one[0], other[0])
    down = min(one[3], other[3]) - max(one[1], other[1])
    narrower = min(one[2] - one[0], other[2] - other[0])
    return (across > 0 and down > 0) or (across > narrower / 2 and down > -2 * _JOIN_PX)


_LEAST_OVERLAP = 0.2
_LONGEST_GAP = 3


@dataclass(frozen=True, slots=True)
class _Track:
    name: str
    box: Box
    frame: int


def tracked(frames: Sequence[Sequence[Box]], first: int = 1) -> list[tuple[Box, ...]]:
    """Return the boxes of each frame with the names of their tracks: numbers in order of appearance.

    A box continues the track whose last box it overlaps most, within three frames; the largest overlap of all first.

    Args:
        frames: boxes in order of time.
        first: number of the first track.
    """
    tracks: list[_Track] = []
    following = first
    named = []
    for number, boxes in enumerate(frames):
        tracks = [track for track in tracks if number - track.frame <= _LONGEST_GAP]
        choices = sorted(
            (
                (_overlap(track.box, box), which, at)
                for which, track in enumerate(tracks)
                for at, box in enumerate(boxes)
            ),
            key=lambda choice: -choice[0],
        )
        names: dict[int, str] = {}
        taken: set[int] = set()
        for overlap, which, at in choices:
            if overlap >= _LEAST_OVERLAP and which not in taken and at not in names:
                names[at] = tracks[which].name
                taken.add(which)
        for at in range(len(boxes)):
            if at not in names:
                names[at] = str(following)
                following += 1
        made = tuple(replace(box, track=names[at]) for at, box in enumerate(boxes))
        tracks = [track for which, track in enumerate(tracks) if which not in taken]
        tracks += [_Track(box.track, box, number) for box in made]
        named.append(made)
    return named


def _overlap(box: Box, other: Box) -> float:
    """Return the intersection of two boxes over their union."""
    across = min(box.right_px, other.right_px) - max(box.left_px, other.left_px)
    down = min(box.bottom_px, other.bottom_px) - max(box.top_px, other.top_px)
    if across <= 0 or down <= 0:
        return 0.0
    shared = across * down
    return shared / (_area(box) + _area(other) - shared)


def _area(box: Box) -> float:
    return (box.right_px - box.left_px) * (box.bottom_px - box.top_px)
