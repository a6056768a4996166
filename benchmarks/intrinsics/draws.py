"""What the rows draw: lenses, boards, ways of filming, and images."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.boards import BoardFilm, render_board, true_corners
from calib_core.camera import Camera, CameraModel
from calib_core.geometry import RigidTransform
from calib_core.intrinsics.board import Board
from calib_core.measurements import TimeNs
from calib_core.synthetic.boards import waved_poses
from calib_core.synthetic.rig import typical_camera

__all__ = ["BOARDS", "CHECKERBOARD", "FILMS", "LENSES", "Images", "Series", "drawn_camera", "drawn_series", "moved"]

LENSES: tuple[CameraModel, ...] = ("pinhole", "plumb_bob", "rational_polynomial", "equidistant")
CHECKERBOARD = Board("checkerboard", 9, 6, 0.02214)
BOARDS: Mapping[str, Board] = {
    "checkerboard 9 x 6": CHECKERBOARD,
    "ChArUco 10 x 7": Board("charuco", 10, 7, 0.0225, 0.0168, "DICT_5X5_100"),
    "AprilGrid 6 x 4": Board("aprilgrid", 6, 4, 0.03, 0.009, "DICT_APRILTAG_36h11"),
}
_USUAL = BoardFilm(blur_px=0.7, noise_grey=2.0)
FILMS: Mapping[str, BoardFilm] = {
    "clean": BoardFilm(),
    "blur and noise": _USUAL,
    "bent board": replace(_USUAL, bend_m=(0.0015, 0.0007)),
    "changing light": replace(_USUAL, gradient=(0.35, -0.2), vignetting=0.4),
    "rolling shutter": replace(_USUAL, rolling_shutter_s=0.02),
}
_SPEED_MPS, _TURNING_RADPS = 0.03, 0.08
"""Standard deviations, per axis, of how a board moves that is held as still as one can."""


@dataclass(frozen=True, slots=True, eq=False)
class Images:
    """Images in memory, as a search takes them."""

    pixels: tuple[np.ndarray, ...]
    names: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.pixels)

    def name(self, index: int, /) -> str:
        """Return an image's name."""
        return self.names[index]

    def time_ns(self, index: int, /) -> TimeNs | None:
        """Return None: they have no times."""
        del index

    def image(self, index: int, /) -> np.ndarray:
        """Return its pixels."""
        return self.pixels[index]


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """Images of one board through one lens, with the truth.

    Attributes:
        camera: the true lens.
        board: as stated.
        images: for the search.
        corners_px: the true corners of each image, by id.
    """

    camera: Camera
    board: Board
    images: Images
    corners_px: tuple[np.ndarray, ...]


def drawn_camera(rng: np.random.Generator, model: CameraModel, *, width_px: int = 1280, height_px: int = 720) -> Camera:
    """Draw a lens: focal length, principal point and distortion about the usual ones."""
    usual = typical_camera(model, width_px=width_px, height_px=height_px)
    matrix = usual.matrix_px.copy()
    matrix[[0, 1], [0, 1]] *= rng.uniform(0.9, 1.2)
    matrix[:2, 2] += rng.uniform(-0.02, 0.02, 2) * width_px
    return replace(usual, matrix_px=matrix, distortion=usual.distortion * rng.uniform(0.7, 1.2))


def moved(rng: np.random.Generator, film: BoardFilm) -> BoardFilm:
    """Return the film with a board that does not quite stand still, if its rows are exposed one after the other."""
    if not film.rolling_shutter_s:
        return film
    x, y, z = (_SPEED_MPS * rng.standard_normal(3)).tolist()
    a, b, c = (_TURNING_RADPS * rng.standard_normal(3)).tolist()
    return replace(film, velocity_mps=(x, y, z), turning_radps=(a, b, c))


def changed_light(rng: np.random.Generator, film: BoardFilm) -> BoardFilm:
    """Return the film with another exposure and direction of the light, if the light changes."""
    if not film.vignetting:
        return film
    across, down = (rng.uniform(-1.0, 1.0, 2) * 0.4).tolist()
    return replace(film, exposure=float(rng.uniform(0.5, 1.15)), gradient=(across, down))


def drawn_series(
    seed: Sequence[int],
    model: CameraModel,
    film: BoardFilm,
    *,
    board: Board = CHECKERBOARD,
    views: int = 20,
) -> Series:
    """Draw and render a board before a lens."""
    rng = np.random.default_rng(list(seed))
    camera = drawn_camera(rng, model)
    poses = waved_poses(rng, board, camera, views)
    films = [changed_light(rng, moved(rng, film)) for _ in poses]
    pixels = [
        render_board(board, camera, pose, one, seed=int(rng.integers(1 << 31)))
        for pose, one in zip(poses, films, strict=True)
    ]
    true = tuple(_true(board, camera, pose, one) for pose, one in zip(poses, films, strict=True))
    return Series(camera, board, Images(tuple(pixels), tuple(f"view {i + 1}" for i in range(views))), true)


def _true(board: Board, camera: Camera, pose: RigidTransform, film: BoardFilm) -> np.ndarray:
    return np.asarray(true_corners(board, camera, pose, film))
