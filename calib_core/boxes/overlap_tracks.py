"""Follow boxes from frame to frame by their overlap."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from calib_core.detections import Box

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


def _overlap(one: Box, other: Box) -> float:
    """Return the intersection of two boxes over their union."""
    across = min(one.right_px, other.right_px) - max(one.left_px, other.left_px)
    down = min(one.bottom_px, other.bottom_px) - max(one.top_px, other.top_px)
    if across <= 0 or down <= 0:
        return 0.0
    shared = across * down
    return shared / (_area(one) + _area(other) - shared)


def _area(box: Box) -> float:
    return (box.right_px - box.left_px) * (box.bottom_px - box.top_px)
