"""What the calibration of a lens says: a row for each code of its warnings and outcomes, and what its checks show."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from calib_core.measurements import Unsolvable
from calib_core.words.remark import Remark, Row, by_code, by_row, remark
from calib_core.words.text import sentence

if TYPE_CHECKING:
    from calib_core.intrinsics.board import Board
    from calib_core.intrinsics.board_images import LeftOutImage
    from calib_core.intrinsics.image_maps import ResidualField
    from calib_core.intrinsics.split_difference import SplitDifference

_FILM = "film the board from at least 10 directions, turned by 30 to 45 deg to the left, right, up and down"
_BENDS = {
    "bend along the rows": "in the middle of its rows",
    "bend along the columns": "in the middle of its columns",
    "twist": "at its corners (twisted)",
}


def bent_board(*, bends_mm: Mapping[str, tuple[float, float]], modelled: bool) -> Remark:
    bends = [f"{abs(bend):.2f} ± {sigma:.2f} mm {_BENDS[name]}" for name, (bend, sigma) in bends_mm.items()]
    return remark(
        f"the board is bent by {' and '.join(bends)}; {_taken_text(modelled)}",
        "fix the board to glass or a stiff plate",
    )


def unequal_squares(*, stretch: float, sigma: float, modelled: bool) -> Remark:
    return remark(
        f"the squares are {100.0 * abs(stretch):.2f} ± {100.0 * sigma:.2f} % {'wider' if stretch > 0 else 'narrower'} than "
        f"high; {_taken_text(modelled)}",
        "measure ten squares along a row and along a column, and print without scaling to the page",
    )


def _taken_text(modelled: bool) -> str:
    return "this was taken into account" if modelled else "this was not taken into account: no lens model fits with it"


def skewed_views(*, skew_px: float, share: float) -> Remark:
    return remark(
        f"views are skewed by {skew_px:.1f} px (median) from the first row of the image to the last, which explains "
        f"{100.0 * share:.0f} % of the squared residuals: the board moved under a rolling shutter, or the lens model is "
        "wrong",
        "hold board and camera still for each view, or lean the board on something and move the camera between views",
    )


def lens_folds_back(*, share: float) -> Remark:
    return remark(
        f"the distortion folds back in {100.0 * share:.0f} % of the image, where no corners were found",
        "film the board there, or choose a simpler lens model",
    )


def little_covered(*, share: float) -> Remark:
    return remark(
        f"the corners of all views cover {100.0 * share:.0f} % of the image; beyond them the lens is a guess",
        "film the board in the corners and along the edges of the image",
    )


def few_views(*, views: int) -> Remark:
    return remark(
        f"only {views} views: the stated uncertainty of the lens is itself uncertain",
        "film 15 to 30 views, tilted to all sides",
    )


def weak_focal_length(*, sigma: float) -> Remark:
    return remark(
        f"the focal length is known to {100.0 * sigma:.1f} % only",
        "film views in which the board is turned by 30 to 45 deg to the left, right, up and down",
    )


def principal_point_far(*, point_px: Sequence[float], middle_px: Sequence[float]) -> Remark:
    point, middle = (f"({u_px:.0f}, {v_px:.0f})" for u_px, v_px in (point_px, middle_px))
    return remark(
        f"the principal point {point} is far from the middle of the image {middle}",
        "check whether the images are cropped; if not, film more tilted views all over the image",
    )


def unequal_focal_lengths(*, fx_px: float, fy_px: float) -> Remark:
    return remark(
        f"the focal lengths differ by {100.0 * abs(fx_px / fy_px - 1.0):.1f} %: {fx_px:.1f} px along rows, {fy_px:.1f} px along "
        "columns",
        "check whether the images were resized with other proportions, and whether the board's squares are square",
    )


def large_residuals(*, rms_px: float) -> Remark:
    return remark(
        f"the corners fit to {rms_px:.2f} px; 0.1 to 0.5 px is usual",
        "check the number of corners of the board, the focus and the lens model, and hold the board still",
    )


def several_series(*, series: Mapping[str, int]) -> Remark:
    named = " and ".join(f"{name} ({count})" for name, count in series.items())
    return remark(
        f"the names of the images form {len(series)} series: {named}",
        "if they are of different cameras, calibrate each with its own images",
    )


WARNINGS = by_code(
    bent_board,
    few_views,
    large_residuals,
    lens_folds_back,
    little_covered,
    principal_point_far,
    several_series,
    skewed_views,
    unequal_focal_lengths,
    unequal_squares,
    weak_focal_length,
)


def no_pictures() -> Remark:
    return remark("there are no images to look for a board in", "give images of the board")


def no_board(*, board: "Board", searched: int, views: int) -> Remark:
    return remark(
        _shown(board, searched, views),
        "film the board as a whole, near enough that its squares are 10 px wide, with a white margin around it, and state its "
        "inner corners, which are one fewer than its squares"
        if board.kind == "checkerboard"
        else "film the board near enough that its markers are 30 px wide, and state its size and the dictionary of its markers",
    )


def other_board(
    *, board: "Board", searched: int, views: int, corners: tuple[int, int], shown: int, asked: int
) -> Remark:
    columns, rows = corners
    return remark(
        f"{_shown(board, searched, views)}; {shown} of the {asked} that were looked at for others show {columns} x {rows} inner "
        "corners",
        f"state {columns}x{rows} if that is the board: its inner corners are one fewer than its squares",
    )


def _shown(board: "Board", searched: int, views: int) -> str:
    return f"{views or 'none'} of {searched} images {'show' if views > 1 else 'shows'} a {board.text}"


def mixed_sizes(*, counts: Sequence[tuple[tuple[int, int], int]]) -> Remark:
    sizes = ", ".join(f"{count} of {width_px} x {height_px}" for (width_px, height_px), count in counts)
    return remark(
        f"the images have different sizes: {sizes} px",
        "give the images of one camera in one size: every size has a calibration of its own",
    )


def no_lens(*, views: int, why: str, model: str) -> Remark:
    return remark(
        f"no lens model fits {views} views: {why}",
        _FILM if model == "auto" else "choose another lens model, or let it be chosen (auto)",
    )


def too_few_views(*, views: int, needed: int, left_out: Sequence["LeftOutImage"] = (), halves: bool = False) -> Remark:
    if halves:
        return remark(
            f"{views} views cannot be calibrated in halves, {needed} can", "film the board from more directions"
        )
    why = "".join(f"; {image.name}: {image.reason}" for image in left_out[:3])
    return remark(f"{views} usable views of the board, at least {needed} are needed{why}", _FILM)


def parallel_views(*, turned_deg: float, focal_px: float, sigma: float) -> Remark:
    return remark(
        f"the board is turned by {turned_deg:.0f} deg at most from view to view; {_known_text(focal_px, sigma)}", _FILM
    )


def unknown_focal_length(*, focal_px: float, sigma: float, rms_px: float, model: str) -> Remark:
    return remark(
        f"{_known_text(focal_px, sigma)}; the corners fit to {rms_px:.2f} px",
        f"check the board and the lens model ({model}), and {_FILM}",
    )


def _known_text(focal_px: float, sigma: float) -> str:
    return f"the focal length, {focal_px:.0f} px, is known to {100.0 * sigma:.0f} %"


OUTCOMES: Mapping[str, Row] = {
    **by_code(mixed_sizes, no_board, no_lens, no_pictures, other_board, parallel_views, unknown_focal_length),
    "few-views": too_few_views,
}


def halves_text(halves: "SplitDifference | Unsolvable") -> str:
    """Say what calibrating halves of the views separately shows, or why there are none."""
    if isinstance(halves, Unsolvable):
        return str(sentence(by_row(halves, OUTCOMES).message))
    how = f"Calibrated separately from {halves.split}, two lenses differ by {halves.ratio:.1f} times what the stated uncertainty"
    if halves.agrees:
        return f"{how} lets expect: no error of the lens model shows."
    return f"{how} lets expect: the lens model, the board's shape or motion adds an error that it does not contain."


def residuals_text(field: "ResidualField") -> str:
    """Say whether the residuals are more than noise."""
    said = []
    if field.systematic:
        said.append(f"the views share a pattern of {field.systematic_px:.3f} px over the image")
    if field.neighbours_alike:
        said.append(f"neighboring corners of a view err alike (correlation {field.neighbour_correlation:.1f})")
    if not said:
        return "The residuals show no pattern that is more than noise."
    return (
        f"The residuals are more than noise: {' and '.join(said)}; the lens model, the board's shape, motion or blur is not "
        "described."
    )
