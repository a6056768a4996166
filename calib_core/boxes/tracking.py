"""Following a box from picture to picture by template correlation.

Two templates are correlated with the surroundings of the box: its content in the first picture, which keeps it from drifting,
and its recent content, which follows a walker's gait. The box may change its size; it is lost when neither fits any more.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from calib_core.arrays import frozen_array

Edges: TypeAlias = tuple[float, float, float, float]
"""Left, top, right and bottom edge of a box [px]; pixel (0, 0) is the centre of the top-left pixel."""

_LONG_SIDE = 40
"""Templates are shrunk or magnified to this many pixels along their longer side [px]."""
_SHORT_SIDE = 12
_MARGIN = 0.7
"""The box is searched this far around where it is expected, in parts of its longer side."""
_SIZE_STEP = 1.03
"""A box becomes so much larger or smaller from one picture to the next."""
_SIZE_GAIN = 0.012
"""Another size must fit better by this much."""
_FIRST_SHARE = 0.4
"""Weight of the first content in the correlation; the recent content has the rest."""
_FITS, _WEAK = 0.55, 0.4
"""From this correlation on a box is found; from the second on too, if it is not the first such picture in a row."""
_LEARNS = 0.25
"""Weight of the newest picture in the recent content."""
_COASTS = 4
"""For so many pictures a box may be hidden and found again where its motion takes it."""
_NEAR = 0.6
"""Weight of the correlation at the rim of what is searched; it is 1 where the box is expected."""
_LEAST_VISIBLE = 0.5
"""A box of which less is in the picture has left it."""


@dataclass(frozen=True, slots=True)
class TrackedBox:
    """The box in the next picture.

    Attributes:
        edges_px: as far as they are in the picture.
        confidence: 0 to 1: the correlation with what the box contained before.
    """

    edges_px: Edges
    confidence: float


@dataclass(frozen=True, slots=True)
class LostBox:
    """The box cannot be followed into the next picture.

    Attributes:
        reason: why, without a full stop.
    """

    reason: str


@dataclass(frozen=True, slots=True, eq=False)
class _State:
    """Where the box is: its centre (x, y), size and motion per picture [px], and its recent content."""

    centre: np.ndarray
    size: np.ndarray
    motion: np.ndarray
    recent: np.ndarray

    def __post_init__(self) -> None:
        for name in ("centre", "size", "motion"):
            object.__setattr__(self, name, frozen_array(getattr(self, name), (2,)))

    @property
    def edges(self) -> np.ndarray:
        return np.concatenate([self.centre - self.size / 2, self.centre + self.size / 2])


def follow_box(pictures: Iterator[np.ndarray], edges_px: Edges) -> Iterator[TrackedBox | LostBox]:
    """Yield the box in each picture after the first, until it is lost or the pictures end.

    Args:
        pictures: grey (h, w) of 8 bits, of one size, in order of time; read one at a time.
        edges_px: the box in the first of them.

    Yields:
        the box in the second picture, the third and so on; a LostBox is the last. Where a box may be hidden, several
        pictures are read before it is known.
    """
    first = next(pictures, None)
    if first is None:
        return
    edges = np.array(edges_px)
    size = edges[2:] - edges[:2]
    shape = _template_shape(size)
    content = _patch(first, (edges[:2] + edges[2:]) / 2, size, shape)
    if content.std() < 2.0:
        yield LostBox("there is nothing in it that could be followed: one colour throughout")
        return
    state = _State((edges[:2] + edges[2:]) / 2, size, np.zeros(2), content)
    hidden: list[TrackedBox] = []
    for picture in pictures:
        found, correlation = _step(picture, state, content)
        if _visible(found, picture) < _LEAST_VISIBLE:
            yield from hidden
            yield LostBox("it leaves the picture")
            return
        if correlation < (_FITS if hidden else _WEAK):
            state = _State(state.centre + state.motion, state.size, state.motion, state.recent)
            hidden.append(TrackedBox(_inside(state.edges, picture), max(0.0, correlation)))
            if len(hidden) > _COASTS:
                yield LostBox("the picture there no longer looks like the box")
                return
            continue
        yield from hidden
        hidden.clear()
        state = found
        yield TrackedBox(_inside(state.edges, picture), min(1.0, correlation))
    if hidden:
        yield LostBox("the picture there no longer looks like the box")


def _template_shape(size: np.ndarray) -> tuple[int, int]:
    """Return rows and columns of the templates."""
    wide, high = np.maximum(_SHORT_SIDE, np.round(size * _LONG_SIDE / size.max())).astype(int)
    return int(high), int(wide)


def _step(picture: np.ndarray, state: _State, first: np.ndarray) -> tuple[_State, float]:
    """Search the box in a picture; return where it fits best, and how well."""
    expected = state.centre + state.motion
    best: tuple[float, float, np.ndarray, float] | None = None
    for factor in (1.0, 1 / _SIZE_STEP, _SIZE_STEP):
        offset, score, correlation = _best_place(picture, expected, state.size * factor, state.recent, first)
        gain = score - (0.0 if factor == 1.0 else _SIZE_GAIN)
        if best is None or gain > best[0]:
            best = (gain, factor, offset, correlation)
    assert best is not None
    _, factor, offset, correlation = best
    centre, size = expected + offset, state.size * factor
    newest = _patch(picture, centre, size, (first.shape[0], first.shape[1]))
    recent = (1 - _LEARNS) * state.recent + _LEARNS * newest if correlation >= _FITS else state.recent
    motion = 0.5 * state.motion + 0.5 * (centre - state.centre)
    return _State(centre, size, motion, recent.astype(np.float32)), correlation


def _best_place(
    picture: np.ndarray, expected: np.ndarray, size: np.ndarray, recent: np.ndarray, first: np.ndarray
) -> tuple[np.ndarray, float, float]:
    """Return the offset (x, y) [px] at which the templates fit best, the weighted correlation there, and the correlation."""
    import cv2

    rows, columns = first.shape
    margin = round(_MARGIN * max(rows, columns))
    scale = size / np.array([columns, rows])
    searched = _patch(picture, expected, size + 2 * margin * scale, (rows + 2 * margin, columns + 2 * margin))
    weights = _weights(rows, columns)
    both = [cv2.matchTemplate(searched, one, cv2.TM_CCOEFF_NORMED, mask=weights) for one in (first, recent)]
    defined = [
        np.where(np.isfinite(one), one, 0.0).clip(-1.0, 1.0) for one in both
    ]  # it is not where all is one colour
    correlation = _FIRST_SHARE * defined[0] + (1 - _FIRST_SHARE) * defined[1]
    places = np.arange(-margin, margin + 1) / margin
    near = np.exp(-2.0 * (places[:, None] ** 2 + places[None, :] ** 2))
    score = correlation * (_NEAR + (1 - _NEAR) * near)
    row, column = np.unravel_index(int(np.argmax(score)), score.shape)
    refined = np.array([column + _peak(score[row], int(column)), row + _peak(score[:, column], int(row))])
    return (refined - margin) * scale, float(score[row, column]), float(correlation[row, column])


def _peak(values: np.ndarray, place: int) -> float:
    """Return the offset of the maximum between samples, by the parabola through three of them."""
    if not 0 < place < len(values) - 1:
        return 0.0
    before, at, after = (float(value) for value in values[place - 1 : place + 2])
    bend = before - 2 * at + after
    return 0.5 * (before - after) / bend if bend < 0 else 0.0


def _weights(rows: int, columns: int) -> np.ndarray:
    """Return weights that fall off towards the corners, where a box shows what is behind the object."""
    down, across = (np.linspace(-1, 1, count) for count in (rows, columns))
    return np.asarray(np.clip(1.15 - np.hypot(down[:, None], across[None, :]) ** 2 * 0.75, 0.1, 1.0), dtype=np.float32)


def _patch(picture: np.ndarray, centre: np.ndarray, size: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Return a part of a picture, shrunk or magnified to (rows, columns); beyond the picture its rim goes on."""
    import cv2

    rows, columns = shape
    shrink = size / np.array([columns, rows])
    if shrink.max() > 2.0:
        factor = 1.0 / shrink.max()
        low = np.floor(centre - size / 2 - 2).astype(int).clip(0, np.array(picture.shape[::-1]) - 2)
        high = np.ceil(centre + size / 2 + 3).astype(int).clip(low + 2, np.array(picture.shape[::-1]))
        part = picture[low[1] : high[1], low[0] : high[0]]
        target = np.maximum(2, np.round((high - low) * factor)).astype(int)
        picture = cv2.resize(part, (int(target[0]), int(target[1])), interpolation=cv2.INTER_AREA)
        real = target / (high - low)
        centre, size = (centre - low + 0.5) * real - 0.5, size * real
    scale = size / np.array([columns, rows])
    start = centre - size / 2 + 0.5 * scale
    matrix = np.array([[scale[0], 0.0, start[0]], [0.0, scale[1], start[1]]])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    patch = cv2.warpAffine(picture, matrix, (columns, rows), flags=flags, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(patch, dtype=np.float32)


def _visible(state: _State, picture: np.ndarray) -> float:
    """Return the share of a box that is in the picture."""
    left, top, right, bottom = _inside(state.edges, picture)
    return max(0.0, right - left) * max(0.0, bottom - top) / float(np.prod(state.size))


def _inside(edges: np.ndarray, picture: np.ndarray) -> Edges:
    """Return the edges of a box, as far as they are in the picture."""
    most = np.array(picture.shape[::-1]) - 0.5
    low, high = edges[:2].clip(-0.5, most), edges[2:].clip(-0.5, most)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])
