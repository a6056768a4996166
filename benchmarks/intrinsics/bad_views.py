"""Bad views among good ones: whether each is named, and whether good ones stay."""

import cv2
import numpy as np

from benchmarks.boards import render_board
from benchmarks.intrinsics.draws import CHECKERBOARD, FILMS, Images, drawn_series
from benchmarks.intrinsics.tables import Table
from calib_core.intrinsics.board import Board
from calib_core.intrinsics.board_search import search_boards
from calib_core.intrinsics.calibrated_lens import CalibratedLens
from calib_core.intrinsics.calibrating import calibrate_lens
from calib_core.intrinsics.coverage import BoardSearch
from calib_core.synthetic.boards import waved_poses

__all__ = ["bad_view_table", "planted", "used_images"]

_OTHER = Board("checkerboard", 7, 5, 0.028)
_BLUR_PX = 5.0


def planted(seed: list[int], views: int = 20) -> tuple[Images, dict[int, str]]:
    """Return good images with bad ones after them, and what is wrong with those, by number."""
    film = FILMS["blur and noise"]
    series = drawn_series(seed, "plumb_bob", film, views=views)
    rng = np.random.default_rng([*seed, 3])
    good = series.images.pixels
    extra: list[tuple[str, np.ndarray]] = [
        ("blurred", cv2.GaussianBlur(good[i], (0, 0), _BLUR_PX)) for i in rng.choice(len(good), 3, replace=False)
    ]
    extra.append(("mirrored", np.ascontiguousarray(good[int(rng.integers(len(good)))][:, ::-1])))
    pose = waved_poses(rng, _OTHER, series.camera, 1)[0]
    extra.append(("another board", render_board(_OTHER, series.camera, pose, film, seed=int(rng.integers(1 << 31)))))
    names = (*series.images.names, *(name for name, _ in extra))
    bad = {len(good) + i: name for i, (name, _) in enumerate(extra)}
    return Images((*good, *(image for _, image in extra)), names), bad


def used_images(images: Images) -> tuple[set[int], set[int]]:
    """Return the numbers of the images that are used, and of those that are left out with a reason."""
    search = search_boards(images, CHECKERBOARD)
    if not isinstance(search, BoardSearch):
        return set(), set()
    lens = calibrate_lens(search)
    if not isinstance(lens, CalibratedLens):
        return set(), {one.index for one in search.left_out}
    return {view.corners.index for view in lens.views}, {one.index for one in lens.left_out}


def bad_view_table(first: int, draws: int) -> Table:
    """Count the bad views that are used, named, or silently gone, and the good ones that are lost."""
    counts: dict[str, list[int]] = {}
    good = [0, 0, 0]
    for i in range(draws):
        images, bad = planted([first + i, 70])
        used, named = used_images(images)
        for number in range(len(images)):
            tally = counts.setdefault(bad[number], [0, 0, 0]) if number in bad else good
            tally[0] += 1
            tally[1] += number in used
            tally[2] += number in named
    rows = [("good", good), *counts.items()]
    cells = tuple((name, str(total), str(used), str(named)) for name, (total, used, named) in rows)
    note = (
        "Each draw has 20 good images (blur 0.7 px, noise of 2 grey levels), three of them again with a blur of "
        f"{_BLUR_PX:g} px, one mirrored, and one of a board of 7 x 5 corners."
    )
    return Table("Planted bad views", ("image", "shown", "used", "left out with a reason"), cells, note)
