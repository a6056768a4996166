"""The stretches of a track that are followed in the pictures: from a frame in which the box is stated to the next such frame."""

from collections.abc import Iterator
from dataclasses import dataclass

from cocalib.session import BoxEdges, BoxTrack, RecordingFacts

MOST_FRAMES = 900
"""A box is followed through so many frames at most after it was drawn: half a minute at 30 Hz."""


@dataclass(frozen=True, slots=True)
class Start:
    """A box that a person stated: what comes of following it depends on nothing else.

    Attributes:
        frame: index of its frame.
        edges_px: there.
    """

    frame: int
    edges_px: BoxEdges


@dataclass(frozen=True, slots=True)
class Stretch:
    """A box to be followed.

    Attributes:
        start: where it is stated.
        last: index of the last frame to follow it to, at least that of the start.
        next_edges_px: what is stated in that last frame; None if nothing is.
        is_cut: it ends only because it is long enough.
    """

    start: Start
    last: int
    next_edges_px: BoxEdges | None = None
    is_cut: bool = False

    @property
    def length(self) -> int:
        """Number of frames to follow it through."""
        return self.last - self.start.frame


def stretches_of(track: BoxTrack, facts: RecordingFacts) -> Iterator[Stretch]:
    """Yield the stretches of a track in order of time; those of a track that is not carried are one frame long.

    Args:
        track: with its keyframes.
        facts: the recording's frames.
    """
    frames = [facts.frame_at(one.image_time) for one in track.keyframes]
    stated = list(zip(track.keyframes, frames, strict=True))
    for (keyframe, first), (following, stop) in zip(stated, (*stated[1:], (None, None)), strict=True):
        if keyframe.edges_px is None or first is None:
            continue
        start = Start(first, keyframe.edges_px)
        if not track.is_carried:
            yield Stretch(start, first)
            continue
        edges = following.edges_px if following is not None else None
        end = len(facts.image_times) - 1 if stop is None else stop if edges is not None else stop - 1
        last = min(end, first + MOST_FRAMES)
        yield Stretch(start, last, edges if last == end else None, last < end)
