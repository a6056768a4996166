"""The stretches of a track that are followed in the pictures: from a frame in which the box is stated to the next such frame."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

from app.session import BoxEdges, BoxTrack, RecordingFacts

__all__ = ["MOST_FRAMES", "Stretch", "stretches_of"]

MOST_FRAMES = 900
"""A box is followed through so many frames at most after it was drawn: half a minute at 30 Hz."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """A box to be followed.

    Attributes:
        first: index of the frame in which it is stated.
        edges_px: there.
        last: index of the last frame to follow it to, at least `first`.
    """

    first: int
    edges_px: BoxEdges
    last: int

    @property
    def length(self) -> int:
        """Number of frames to follow it through."""
        return self.last - self.first


def stretches_of(track: BoxTrack, facts: RecordingFacts) -> Iterator[tuple[Stretch, BoxEdges | None, bool]]:
    """Yield the stretches of a track in order of time.

    Args:
        track: with its keyframes.
        facts: the recording's frames.

    Yields:
        the stretch, the edges in the frame after its end (None if nothing is stated there, or that the object is hidden), and
        whether the stretch ends only because it is long enough.
    """
    frames = [facts.frame_at(one.image_time) for one in track.keyframes]
    ends = (*pairwise(zip(track.keyframes, frames, strict=True)), ((track.keyframes[-1], frames[-1]), (None, None)))
    count = len(facts.image_times)
    for (keyframe, first), (following, stop) in ends:
        if keyframe.edges_px is None or first is None:
            continue
        if not track.is_carried:
            yield Stretch(first, keyframe.edges_px, first), None, False
            continue
        edges = following.edges_px if following is not None else None
        end = count - 1 if stop is None else stop if edges is not None else stop - 1
        last = min(end, first + MOST_FRAMES)
        yield Stretch(first, keyframe.edges_px, last), edges, last < end
