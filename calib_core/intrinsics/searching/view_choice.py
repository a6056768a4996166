"""Choose the views to calibrate with: sharp ones, each but once, and as different as possible."""

from collections.abc import Sequence

import numpy as np

from calib_core.arrays import Points2, Values
from calib_core.intrinsics.board import Board
from calib_core.intrinsics.board_pictures import BoardCorners, LeftOutPicture

MOST_VIEWS = 60
_SHARP_SHARE = 0.3
_BLURRED_FACTOR, _BLURRED_PX = 1.6, 0.8
_SAME_SHARE, _SAME_PX = 0.004, 2.0  # of the width of the picture
_SHARPER_FACTOR = 1.05


def chosen_views(views: Sequence[BoardCorners], board: Board) -> tuple[list[BoardCorners], list[LeftOutPicture]]:
    """Return the views to calibrate with, in order of their numbers, and the others with the reason.

    Args:
        views: of one size of picture, in order of their numbers.
        board: that they show.
    """
    left_out: list[LeftOutPicture] = []
    sharp_px = _usual_blur_px(views)
    limit_px = max(_BLURRED_FACTOR * sharp_px, sharp_px + _BLURRED_PX)
    sharp = []
    for view in views:
        if view.blur_px > limit_px:
            reason = f"blurred: edges are {view.blur_px:.1f} px wide, those of the others {sharp_px:.1f} px"
            left_out.append(LeftOutPicture(view.index, view.name, reason))
        else:
            sharp.append(view)
    outlines = np.array([outline_px(view, board) for view in sharp]).reshape(len(sharp), -1)
    kept = _without_duplicates(sharp, outlines, left_out)
    if len(kept) > MOST_VIEWS:
        different = set(_most_different(outlines[kept], np.array([sharp[row].blur_px for row in kept])))
        for place, row in enumerate(kept):
            if place not in different:
                reason = f"not needed: {MOST_VIEWS} views that differ more from one another are used"
                left_out.append(LeftOutPicture(sharp[row].index, sharp[row].name, reason))
        kept = [row for place, row in enumerate(kept) if place in different]
    return [sharp[row] for row in kept], left_out


def outline_px(view: BoardCorners, board: Board) -> Points2:
    """Return where the four outer corners of the board are in the picture, or would be: (4, 2) [px]."""
    import cv2

    plane_m = board.corners_m[:, :2]
    (left, top), (right, bottom) = plane_m.min(axis=0), plane_m.max(axis=0)
    outer = np.array([[left, top], [right, top], [right, bottom], [left, bottom]])
    homography, _ = cv2.findHomography(plane_m[view.corner_ids], view.pixels_px)
    if homography is None:
        middle = view.pixels_px.mean(axis=0)
        return np.repeat(middle[None], 4, axis=0)
    return np.asarray(cv2.perspectiveTransform(outer[:, None], homography)[:, 0])


def _usual_blur_px(views: Sequence[BoardCorners]) -> float:
    """Return the blur of the sharper ones; infinite where none was measured."""
    known = np.array([view.blur_px for view in views])
    known = known[np.isfinite(known)]
    return float(np.quantile(known, _SHARP_SHARE)) if len(known) else float("inf")


def _without_duplicates(
    views: Sequence[BoardCorners], outlines: np.ndarray, left_out: list[LeftOutPicture]
) -> list[int]:
    """Return the rows of the views that are no repetition of a sharper one, ascending; name the others."""
    sharpest_first = sorted(range(len(views)), key=lambda row: (np.nan_to_num(views[row].blur_px, nan=1e9), row))
    kept: list[int] = []
    for row in sharpest_first:
        near_px = max(_SAME_PX, _SAME_SHARE * views[row].size_px[0])
        turned = outlines[row].reshape(4, 2)[[2, 3, 0, 1]].ravel()  # a checkerboard looks the same from both ends
        same = next(
            (one for one in kept if min(_apart(outlines[one], outlines[row]), _apart(outlines[one], turned)) < near_px),
            None,
        )
        if same is None:
            kept.append(row)
        else:
            sharper = views[row].blur_px > _SHARPER_FACTOR * views[same].blur_px
            reason = f"the same view as {views[same].name}{', which is sharper' if sharper else ''}"
            left_out.append(LeftOutPicture(views[row].index, views[row].name, reason))
    return sorted(kept)


def _apart(a: Values, b: Values) -> float:
    """Return the rms distance between two outlines (8,) [px]."""
    return float(np.sqrt(np.square(a - b).sum() / 4.0))


def _most_different(outlines: np.ndarray, blur_px: Values) -> list[int]:
    """Choose views one by one, each as far from the chosen ones as possible; of equally far ones the sharper."""
    size = np.ptp(outlines, axis=0).max()
    apart = np.linalg.norm(outlines[:, None] - outlines[None], axis=2) / max(float(size), 1e-9)
    worth = 1.0 / np.maximum(np.nan_to_num(blur_px, nan=np.nanmax(blur_px, initial=1.0)), 0.3)
    chosen = [int(np.argmax(apart.sum(axis=1)))]
    while len(chosen) < MOST_VIEWS:
        nearest = apart[:, chosen].min(axis=1)
        nearest[chosen] = -1.0
        chosen.append(int(np.argmax(nearest * worth)))
    return chosen
