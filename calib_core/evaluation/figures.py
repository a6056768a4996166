"""The figures of an evaluation as values, with their bins: what `evaluate --json`, the report, the page and Rerun all show."""

import itertools
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np

from calib_core.arrays import Flags, Indices, Points2, Points3, Values, freeze
from calib_core.measurements import TimeNs, Unpaired
from calib_core.results import DataWarning, Metrics

FLAT_SHARE = 0.01
"""Acc that changes by less than this within 1 deg about an axis does not see that axis."""

Axis: TypeAlias = Literal["roll", "pitch", "yaw"]
"""Of the camera about its own axes: roll about the viewing direction (z), pitch about x, yaw about y."""


@dataclass(frozen=True, slots=True)
class Spread:
    """Residual lengths in one bin of range, azimuth or image position.

    Attributes:
        low: lower edge of the bin, in the unit of what it is a bin of.
        high: upper edge.
        n: number of pairs.
        mean_px: mean length of their residuals (AED of the bin); NaN if there are none.
        median_px: median length.
    """

    low: float
    high: float
    n: int
    mean_px: float
    median_px: float


@dataclass(frozen=True, slots=True, eq=False)
class HeldOut:
    """Distances from clicks to where a calibration from the other placements predicts them.

    Attributes:
        folds: number of groups; each placement is one group when one placement is left out at a time.
        distances_px: one per pair, in the pairs' order; NaN where the rest cannot be solved.
        aed_px: their mean; of one placement at a time that over the placements that agree, as a solve of these clicks states it.
    """

    folds: int
    distances_px: Values
    aed_px: float


@dataclass(frozen=True, slots=True, eq=False)
class ResidualFigures:
    """Residuals at the clicks of the recording.

    Attributes:
        ids: of the pairs (n).
        points_radar_m: (n, 3) their radar positions.
        pixels_px: (n, 2) their clicks.
        projected_px: (n, 2) where the calibration puts the radar positions; NaN behind the camera.
        inliers: (n,) whether the calibration's noise explains the residual.
        metrics: AED and CDSD (paper, equations 4 and 5: N and N - 1), RMS, n; over the projected pairs.
        median_px: median length of the residuals.
        inlier_share: 0 to 1.
        by_range: bins of the range [m].
        by_azimuth: bins of the azimuth [deg], positive to the left.
        by_column: bins of the click's column [px].
        by_row: bins of the click's row [px].
        held_out: one placement left out at a time; None if it was not asked for or cannot be had.
        k_fold: the placements in k groups; None likewise.
        placements: (n,) number of the placement that each pair belongs to, from 0.
        unpaired: clicks without a radar position.
        association: how the return of each click was chosen, in one sentence.
    """

    ids: tuple[str, ...]
    points_radar_m: Points3
    pixels_px: Points2
    projected_px: Points2
    inliers: Flags
    metrics: Metrics
    median_px: float
    inlier_share: float
    by_range: tuple[Spread, ...]
    by_azimuth: tuple[Spread, ...]
    by_column: tuple[Spread, ...]
    by_row: tuple[Spread, ...]
    held_out: HeldOut | None = None
    k_fold: HeldOut | None = None
    placements: Indices = field(default_factory=lambda: np.zeros(0, np.int64))
    unpaired: tuple[Unpaired, ...] = ()
    association: str = ""

    @property
    def distances_px(self) -> Values:
        """The lengths of the residuals (n,): e_i of the paper's AED; NaN behind the camera."""
        return np.asarray(np.linalg.norm(self.projected_px - self.pixels_px, axis=1))


@dataclass(frozen=True, slots=True, eq=False)
class BoxedReturns:
    """The returns that Acc counts, each with the box of its target.

    Attributes:
        frames: (n,) which of BoxFigures.frames each belongs to, ascending.
        points_radar_m: (n, 3) as the radar reports them.
        pixels_px: (n, 2) where the calibration puts them; NaN behind the camera.
        boxes_px: (n, 4) left, top, right, bottom of its target's box; NaN if its target has none in the frame.
        inside: (n,) whether the pixel is in that box.
        targets: (n,) the target's id.
        labels: (n,) the class of its box; "" without one.
    """

    frames: Indices
    points_radar_m: Points3
    pixels_px: Points2
    boxes_px: np.ndarray
    inside: Flags
    targets: tuple[str, ...]
    labels: tuple[str, ...]

    def __post_init__(self) -> None:
        n = len(self.targets)
        freeze(self, np.int64, frames=(n,))
        freeze(self, np.bool_, inside=(n,))
        freeze(self, points_radar_m=(n, 3), pixels_px=(n, 2), boxes_px=(n, 4))


@dataclass(frozen=True, slots=True)
class FrameFigure:
    """Acc of one frame.

    Attributes:
        image_time: the recorded stamp.
        radar_time: stamp of the scan that was matched to it.
        returns: number of returns that belong to targets, matched or not: the denominator.
        inside: how many of them are within their target's box when reprojected.
        boxes: number of boxes in the frame.
        range_m: median range of those returns; NaN without any.
    """

    image_time: TimeNs
    radar_time: TimeNs
    returns: int
    inside: int
    boxes: int
    range_m: float

    @property
    def share(self) -> float:
        """Of the returns that are inside, 0 to 1; NaN without returns: such a frame does not count."""
        return self.inside / self.returns if self.returns else float("nan")


@dataclass(frozen=True, slots=True)
class Share:
    """Returns in one bin of range.

    Attributes:
        low_m: lower edge.
        high_m: upper edge.
        returns: number of returns of targets.
        inside: how many are within their target's box.
    """

    low_m: float
    high_m: float
    returns: int
    inside: int


@dataclass(frozen=True, slots=True)
class ClassFigure:
    """Acc of one class, or of one target.

    Attributes:
        label: the class, "" for the returns of targets that no box was found for; or the target.
        acc: the mean share over the frames with returns of it, 0 to 1; None without any.
        frames: number of those frames.
        returns: number of those returns.
        inside: how many are within their target's box.
    """

    label: str
    acc: float | None
    frames: int
    returns: int
    inside: int


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """Acc of the calibration turned about one axis of the camera: where it is flat, Acc says nothing.

    Attributes:
        axis: turned about.
        angles_deg: ascending, 0 among them.
        acc: Acc at each angle, 0 to 1.
        standard_error: of Acc at 0; smaller changes may be chance. NaN if unknown.
        low_deg: the nearest angle below the best one at which Acc is clearly lower (95 %); -inf if it is at none.
        high_deg: the same above it; inf likewise.
    """

    axis: Axis
    angles_deg: tuple[float, ...]
    acc: tuple[float, ...]
    standard_error: float = float("nan")
    low_deg: float = float("-inf")
    high_deg: float = float("inf")

    @property
    def is_flat(self) -> bool:
        """Whether Acc cannot see this axis: it changes by less than a percentage point, or than its standard error."""
        return max(self.acc) - min(self.acc) < max(FLAT_SHARE, float(np.nan_to_num(self.standard_error)))

    @property
    def best_deg(self) -> float:
        """The angle at which Acc is highest; of several, the one nearest to 0."""
        best = max(self.acc)
        return min((angle for angle, acc in zip(self.angles_deg, self.acc, strict=True) if acc == best), key=abs)


@dataclass(frozen=True, slots=True)
class BoxFigures:
    """Acc (paper, equation 6), and what stands behind it.

    Attributes:
        acc: mean over the frames with returns, frames of 0 % kept, 0 to 1; None if no frame counts.
        acc_standard_error: of that mean, with neighboring frames taken together; NaN below two groups.
        acc_without_zero_frames: the same without the frames of 0 %, as the authors' script computes it; None likewise.
        frames: one per frame that has boxes or returns of targets, in order of time.
        classes: by label.
        ranges: the returns by range.
        sensitivity: Acc under rotations about each axis of the camera.
        chance: mean Acc of the calibration turned by 10 deg to each side; None if acc is.
        rule: which returns count and how they were matched, in one sentence.
        source: of the boxes.
        groups: number of groups of neighboring frames that the standard error comes from.
        area_chance: mean share of the image that a target's box covers: what returns at random pixels would score.
        targets: number of targets that were found.
        matched_targets: number of them that have boxes.
        returns: every return that counts; None in a file.
        objects: by target.
        by_cuboid: whether the targets are whatever has a cuboid, not what the radar followed.
    """

    acc: float | None
    acc_standard_error: float
    acc_without_zero_frames: float | None
    frames: tuple[FrameFigure, ...]
    classes: tuple[ClassFigure, ...]
    ranges: tuple[Share, ...]
    sensitivity: tuple[Sensitivity, ...]
    chance: float | None
    rule: str
    source: str
    groups: int = 0
    area_chance: float | None = None
    targets: int = 0
    matched_targets: int = 0
    returns: BoxedReturns | None = None
    objects: tuple[ClassFigure, ...] = ()
    by_cuboid: bool = False


@dataclass(frozen=True, slots=True)
class Evaluation:
    """A calibration judged on a recording.

    Attributes:
        residuals: at the clicks; None without clicks.
        boxes: returns in boxes; None without boxes.
        warnings: what the reader of the figures must know.
    """

    residuals: ResidualFigures | None
    boxes: BoxFigures | None
    warnings: tuple[DataWarning, ...] = ()


_MOST_BINS = 6


def edges_of(values: Values) -> Values:
    """Return round edges of at most six bins that hold all finite values; two edges at least, none without values."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return np.zeros(0)
    low, high = float(finite.min()), float(finite.max())
    rough = max(high - low, 1e-6 * max(abs(high), 1.0)) / _MOST_BINS
    unit = 10.0 ** np.floor(np.log10(rough))
    for factor in (1.0, 2.0, 5.0, 10.0, 20.0):
        step = factor * unit
        first, last = np.floor(low / step), max(np.ceil(high / step), np.floor(low / step) + 1)
        if last - first <= _MOST_BINS:
            break
    return np.asarray(np.arange(first, last + 1) * step)


def spreads(values: Values, distances_px: Values) -> tuple[Spread, ...]:
    """Summarize the lengths of residuals in bins of another quantity.

    Args:
        values: (n,) the quantity.
        distances_px: (n,) the lengths; NaN for pairs that are not projected, which count in no bin.
    """
    seen = np.isfinite(distances_px) & np.isfinite(values)
    values, distances_px = values[seen], distances_px[seen]
    edges = edges_of(values)
    rows = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, max(len(edges) - 2, 0))
    found = []
    for i, (low, high) in enumerate(itertools.pairwise(edges)):
        own = distances_px[rows == i]
        mean_px, median_px = (float(np.mean(own)), float(np.median(own))) if len(own) else (float("nan"), float("nan"))
        found.append(Spread(float(low), float(high), len(own), mean_px, median_px))
    return tuple(found)
