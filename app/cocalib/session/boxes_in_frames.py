"""Boxes in every frame, as a value: those that a person or a file stated, those that were followed, and those in between."""

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal, TypeAlias

import numpy as np

from calib_core.measurements import Box, Boxes, FrameBoxes, TimeNs
from cocalib.session.events import BoxesLoaded
from cocalib.session.state import BoxEdges, BoxKeyframe, BoxTrack, RecordingFacts, Session

MOST_FRAMES = 900
"""A box is followed through so many frames at most after it was drawn: half a minute at 30 Hz."""
_LEAST_PX = 3.0
"""Boxes of a file that are narrower or lower than this, after what is beyond the picture is cut off, are left out [px]."""
BoxKind: TypeAlias = Literal["stated", "followed", "between"]


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


@dataclass(frozen=True, slots=True)
class PlacedBox:
    """The box of an object in a frame.

    Attributes:
        frame: its index.
        edges_px: left, top, right, bottom.
        kind: stated by a person or a file, followed in the pictures, or in between where it was lost.
        confidence: 0 to 1: how much the picture in it looks like the box that was followed; 1 if stated.
    """

    frame: int
    edges_px: BoxEdges
    kind: BoxKind
    confidence: float = 1.0


@dataclass(frozen=True, slots=True)
class Followed:
    """What following a box has given so far.

    Attributes:
        boxes: from the frame after its start on, without gaps.
        ended: why it cannot be followed beyond them; "" if it can.
    """

    boxes: tuple[PlacedBox, ...] = ()
    ended: str = ""

    def within(self, stretch: Stretch) -> "Followed":
        """Return what of it belongs to a stretch."""
        if len(self.boxes) < stretch.length:
            return self
        return Followed(self.boxes[: stretch.length])

    def completes(self, stretch: Stretch) -> bool:
        """Return whether there is no more to come for a stretch."""
        return bool(self.ended) or len(self.boxes) >= stretch.length


@dataclass(frozen=True, slots=True)
class CarriedTrack:
    """An object through the frames.

    Attributes:
        id: of its track.
        label: its class.
        boxes: in order of frames.
        note: where and why its box ends, as a sentence; "" if there is nothing to say.
        is_complete: there is no more to come.
    """

    id: str
    label: str
    boxes: tuple[PlacedBox, ...]
    note: str
    is_complete: bool

    def at(self, frame: int) -> PlacedBox | None:
        """Return the box in a frame; None if it has none there."""
        place = bisect_left(self.boxes, frame, key=lambda box: box.frame)
        return self.boxes[place] if place < len(self.boxes) and self.boxes[place].frame == frame else None


_NOTHING: Mapping[Start, Followed] = MappingProxyType({})


def carried_tracks(
    tracks: Sequence[BoxTrack], facts: RecordingFacts, followed: Mapping[Start, Followed] = _NOTHING
) -> tuple[CarriedTrack, ...]:
    """Put together what was stated and what was followed.

    Args:
        tracks: of the session.
        facts: the recording's frames.
        followed: what is known from each start; one that is missing has yet to be followed.
    """
    return tuple(_carried(track, facts, followed) for track in tracks)


def carried_boxes(tracks: Sequence[CarriedTrack], session: Session, facts: RecordingFacts) -> Boxes:
    """Return the boxes as a file would state them: frames with boxes, and those that a file says are without.

    Args:
        tracks: through the frames.
        session: says which frames a file calls empty.
        facts: the recording's frames.
    """
    frames: dict[TimeNs, list[Box]] = {time: [] for time in session.empty_frames}
    for track in tracks:
        for one in track.boxes:
            time = TimeNs(int(facts.image_times[one.frame]))
            box = Box(*one.edges_px, label=track.label, score=one.confidence, track=track.id)
            frames.setdefault(time, []).append(box)
    found = tuple(FrameBoxes(time, tuple(frames[time])) for time in sorted(frames))
    return Boxes(found, "the boxes on the page", (facts.width_px, facts.height_px))


def boxes_loaded(boxes: Boxes, facts: RecordingFacts) -> BoxesLoaded:
    """Return the boxes of a file as a step of the session.

    Boxes of one track and class belong to one object; each box without a track is an object of its own.

    Args:
        boxes: with the stamps of recorded frames.
        facts: the recording's frames.
    """
    keyframes: dict[tuple[str, str, int], dict[TimeNs, BoxKeyframe]] = defaultdict(dict)
    empty: list[TimeNs] = []
    alone = 0
    for frame in boxes:
        seen = [(box, edges) for box in frame.boxes if (edges := _edges_within(box, facts)) is not None]
        if not seen:
            empty.append(frame.image_time)
        for box, edges in seen:
            key = (box.track, box.label, 0)
            if not box.track or frame.image_time in keyframes[key]:
                alone += 1
                key = ("", box.label, alone)
            keyframes[key][frame.image_time] = BoxKeyframe(frame.image_time, edges)
    tracks = [
        BoxTrack(name or f"b{number}", label, tuple(stated[time] for time in sorted(stated)), is_carried=False)
        for (name, label, number), stated in keyframes.items()
    ]
    return BoxesLoaded(tuple(_named_apart(tracks)), tuple(empty))


def _carried(track: BoxTrack, facts: RecordingFacts, followed: Mapping[Start, Followed]) -> CarriedTrack:
    boxes: list[PlacedBox] = []
    note, complete = "", True
    for stretch in stretches_of(track, facts):
        found = followed.get(stretch.start, Followed()).within(stretch)
        boxes.append(PlacedBox(stretch.start.frame, stretch.start.edges_px, "stated"))
        boxes += _bridged(stretch, stretch.next_edges_px, found) if stretch.next_edges_px else found.boxes
        complete &= found.completes(stretch)
        note = _note(found, stretch)
    return CarriedTrack(track.id, track.label, tuple(boxes), note, complete)


def _note(found: Followed, stretch: Stretch) -> str:
    """Say where the box ends in a stretch; nothing if it goes on to the next stated one."""
    last = stretch.start.frame + len(found.boxes) + 1
    if found.ended and not stretch.next_edges_px:
        return f"Ends in frame {last}: {found.ended}. To go on, draw it in a later frame while it is selected."
    if stretch.is_cut and found.completes(stretch):
        return f"Ends in frame {last}, after {MOST_FRAMES} frames. Correct it there to follow it farther."
    return ""


def _bridged(stretch: Stretch, next_edges: BoxEdges, found: Followed) -> Iterator[PlacedBox]:
    """Yield the boxes up to the next stated one: the drift taken out, and straight on from where the box was lost.

    What was followed to the end is off there by its drift, which is taken back evenly over the stretch.
    """
    boxes, target = found.boxes, np.array(next_edges)
    if not found.completes(stretch):
        yield from boxes
        return
    first = stretch.start.frame
    if boxes and boxes[-1].frame == stretch.last:
        drift = target - np.array(boxes[-1].edges_px)
        for box in boxes[:-1]:
            share = (box.frame - first) / stretch.length
            yield PlacedBox(box.frame, _edges(np.array(box.edges_px) + share * drift), "followed", box.confidence)
        return
    yield from boxes
    start, edges = (boxes[-1].frame, boxes[-1].edges_px) if boxes else (first, stretch.start.edges_px)
    for frame in range(start + 1, stretch.last):
        share = (frame - start) / (stretch.last - start)
        yield PlacedBox(frame, _edges((1 - share) * np.array(edges) + share * target), "between", 0.0)


def _edges(values: np.ndarray) -> BoxEdges:
    left, top, right, bottom = (round(float(value), 2) for value in values)
    return left, top, right, bottom


def _named_apart(tracks: list[BoxTrack]) -> list[BoxTrack]:
    """Give each track a name of its own."""
    taken: set[str] = set()
    named = []
    for track in tracks:
        name, number = track.id[:60], 2
        while name in taken:
            name, number = f"{track.id[:60]} ({number})", number + 1
        taken.add(name)
        named.append(BoxTrack(name, track.label[:60].strip(), track.keyframes, is_carried=False))
    return named


def _edges_within(box: Box, facts: RecordingFacts) -> tuple[float, float, float, float] | None:
    """Return the edges as far as they are in the picture; None if too little of the box is."""
    left, right = (min(max(value, -0.5), facts.width_px - 0.5) for value in (box.left_px, box.right_px))
    top, bottom = (min(max(value, -0.5), facts.height_px - 0.5) for value in (box.top_px, box.bottom_px))
    return (left, top, right, bottom) if right - left >= _LEAST_PX and bottom - top >= _LEAST_PX else None
