"""Calibration boards with known truth: as they really are, moving, in pictures, and as corners without pictures.

A printed board is bent, and its squares are not equal; a moving one is exposed row by row. In a picture every pixel goes through
the lens to the board, smooth at its edges, with a cluttered room behind it. `simulated_views` gives corners in many pictures,
without the pictures, for Monte Carlo, at poses of a board that a person waves before a camera, or holds badly.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from calib_core.arrays import Points2, Points3, Values, Vector2, Vector3, frozen_array
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.intrinsics import Board, BoardCorners


@dataclass(frozen=True, slots=True)
class BoardShape:
    """How a board differs from the ideal one; the same in every picture.

    Attributes:
        bend_m: how far its middle stands behind its sides, and behind its upper and lower edge: a quadratic bend [m].
        scale: size of the squares along x and y over the stated one.
        unequal_m: standard deviation of where each line between squares is printed [m].
        seed: of these lines.
    """

    bend_m: tuple[float, float] = (0.0, 0.0)
    scale: tuple[float, float] = (1.0, 1.0)
    unequal_m: float = 0.0
    seed: int = 0


_MARGIN_SQUARES = 0.6
"""Width of the white margin around the squares."""
_TAG_BORDER_BITS = 2
"""Kalibr's; the width of a tag's black border."""


@dataclass(frozen=True, slots=True, eq=False)
class BoardPattern:
    """What is printed on a board, in the board's frame.

    Attributes:
        x_m: (k,) lines between cells, ascending; the first and the last are the board's edges.
        y_m: (l,) the same along y.
        paper: (l - 1, k - 1) 1 where a cell is white.
    """

    x_m: Values
    y_m: Values
    paper: np.ndarray

    def __post_init__(self) -> None:
        object.__setattr__(self, "x_m", frozen_array(self.x_m, (None,)))
        object.__setattr__(self, "y_m", frozen_array(self.y_m, (None,)))
        shape = (len(self.y_m) - 1, len(self.x_m) - 1)
        object.__setattr__(self, "paper", frozen_array(self.paper, shape, dtype=np.float32))

    @property
    def size_m(self) -> tuple[float, float]:
        """Width and height with the margin [m]."""
        return float(np.ptp(self.x_m)), float(np.ptp(self.y_m))


def pattern_of(board: Board) -> BoardPattern:
    """Return what is printed on a board."""
    match board.kind:
        case "checkerboard":
            return _checkerboard(board)
        case "charuco":
            return _charuco(board)
        case _:
            return _aprilgrid(board)


def _checkerboard(board: Board) -> BoardPattern:
    x_m, y_m = (board.square_m * np.arange(-1, count + 1) for count in (board.columns, board.rows))
    odd = np.add.outer(np.arange(board.rows + 1), np.arange(board.columns + 1)) % 2
    return _with_margin(x_m, y_m, odd, _MARGIN_SQUARES * board.square_m)


def _charuco(board: Board) -> BoardPattern:
    """Lay out a ChArUco board as OpenCV does: the upper left square is black, markers are in the white ones."""
    import cv2

    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    bits = dictionary.markerSize + 2
    inset = 0.5 * (board.square_m - board.marker_m)
    steps = np.concatenate([[0.0], inset + board.marker_m * np.arange(bits + 1) / bits])
    x_m, y_m = (
        np.append((board.square_m * np.arange(-1, count - 1)[:, None] + steps).ravel(), board.square_m * (count - 1))
        for count in (board.columns, board.rows)
    )
    paper = np.zeros((len(y_m) - 1, len(x_m) - 1))
    number = 0
    for row in range(board.rows):
        for column in range(board.columns):
            if (row + column) % 2 == 0:
                continue
            square = paper[row * len(steps) : (row + 1) * len(steps), column * len(steps) : (column + 1) * len(steps)]
            square[:] = 1.0
            square[1:-1, 1:-1] = dictionary.generateImageMarker(number, bits, borderBits=1) > 0
            number += 1
    return _with_margin(x_m, y_m, paper, _MARGIN_SQUARES * board.square_m)


def _aprilgrid(board: Board) -> BoardPattern:
    """Lay out a grid of AprilTags as Kalibr prints it: tag 0 below left, black squares at the corners of all tags."""
    import cv2

    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    bits = dictionary.markerSize + 2 * _TAG_BORDER_BITS
    first_m = board.corners_m[:, :2].min(axis=0)
    steps = board.square_m * np.arange(bits + 1) / bits
    pitch_m = board.square_m + board.marker_m
    x_m, y_m = (
        np.concatenate([[-board.marker_m], (pitch_m * np.arange(count)[:, None] + steps).ravel(), [pitch_m * count]])
        for count in (board.columns, board.rows)
    )
    paper = np.ones((len(y_m) - 1, len(x_m) - 1))
    paper[:: bits + 1, :: bits + 1] = 0.0
    for tag in range(board.columns * board.rows):
        row, column = board.rows - 1 - tag // board.columns, tag % board.columns
        cells = (
            slice(row * (bits + 1) + 1, (row + 1) * (bits + 1)),
            slice(column * (bits + 1) + 1, (column + 1) * (bits + 1)),
        )
        upside_down = dictionary.generateImageMarker(tag, bits, borderBits=_TAG_BORDER_BITS) > 0
        paper[cells] = upside_down[::-1, ::-1]  # OpenCV's tags are AprilTag's, turned by half a turn
    return _with_margin(first_m[0] + x_m, first_m[1] + y_m, paper, 0.3 * board.square_m)


def _with_margin(x_m: Values, y_m: Values, paper: np.ndarray, margin_m: float) -> BoardPattern:
    around = [np.concatenate([[lines[0] - margin_m], lines, [lines[-1] + margin_m]]) for lines in (x_m, y_m)]
    return BoardPattern(around[0], around[1], np.pad(paper, 1, constant_values=1.0))


@dataclass(frozen=True, slots=True, eq=False)
class PrintedBoard:
    """A board as it really is, in its own frame.

    Attributes:
        pattern: what is printed on it, with its lines where they are.
        corners_m: (n, 3) the true corners by id.
        middle_m: (3,) the middle of its ideal corners, about which it turns.
        bends: (2,) z = bends[0] (x - middle x)^2 + bends[1] (y - middle y)^2 - a constant [1/m].
        sag_m: that constant: the middle is behind the edges by it.
    """

    pattern: BoardPattern
    corners_m: Points3
    middle_m: Vector3
    bends: tuple[float, float]
    sag_m: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "corners_m", frozen_array(self.corners_m, (None, 3)))
        object.__setattr__(self, "middle_m", frozen_array(self.middle_m, (3,)))

    def height_m(self, x_m: np.ndarray, y_m: np.ndarray) -> np.ndarray:
        """Return z of the surface at x, y [m]."""
        x, y = x_m - self.middle_m[0], y_m - self.middle_m[1]
        return np.asarray(self.sag_m - self.bends[0] * x * x - self.bends[1] * y * y)


def printed_board(board: Board, shape: BoardShape) -> PrintedBoard:
    """Return a board with its faults."""
    ideal = pattern_of(board)
    corners = board.corners_m
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    half = 0.5 * np.ptp(corners[:, :2], axis=0)
    rng = np.random.default_rng([shape.seed, 77])
    lines = []
    for axis, ideal_m in enumerate((ideal.x_m, ideal.y_m)):
        scaled = middle[axis] + shape.scale[axis] * (ideal_m - middle[axis])
        lines.append(scaled + shape.unequal_m * rng.standard_normal(len(ideal_m)))
    bends = (float(shape.bend_m[0] / half[0] ** 2), float(shape.bend_m[1] / half[1] ** 2))
    made = PrintedBoard(
        BoardPattern(lines[0], lines[1], ideal.paper), np.zeros((0, 3)), middle, bends, float(sum(shape.bend_m))
    )
    x, y = np.interp(corners[:, 0], ideal.x_m, lines[0]), np.interp(corners[:, 1], ideal.y_m, lines[1])
    true = np.stack([x, y, made.height_m(x, y)], axis=1)
    return PrintedBoard(made.pattern, true, middle, bends, made.sag_m)


@dataclass(frozen=True, slots=True)
class BoardFilm:
    """How a board is filmed.

    Attributes:
        shape: of the board.
        blur_px: standard deviation of the lens blur [px].
        noise_grey: standard deviation of the sensor's noise [grey levels], the same in all three channels.
        exposure: brightness over the usual one.
        gradient: by how much brighter than in the middle the light is at the right and at the lower border, as a share.
        vignetting: share of the light that is missing in the corners.
        black_grey, white_grey: levels of the board's ink and paper.
        velocity_mps: (3,) of the board's middle, in the camera frame.
        turning_radps: (3,) the board's rotation vector per second, in the camera frame.
        rolling_shutter_s: from the exposure of the first row to that of the last; the pose is that at the middle row.
        exposure_s: how long each row is exposed.
    """

    shape: BoardShape = field(default_factory=BoardShape)
    blur_px: float = 0.0
    noise_grey: float = 0.0
    exposure: float = 1.0
    gradient: tuple[float, float] = (0.0, 0.0)
    vignetting: float = 0.0
    black_grey: float = 35.0
    white_grey: float = 205.0
    velocity_mps: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turning_radps: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rolling_shutter_s: float = 0.0
    exposure_s: float = 0.0


_ROUNDS = 30
_CLOSE_PX = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class MovingBoard:
    """A board that moves steadily through a picture.

    Attributes:
        printed: the board.
        camera: that films it.
        camera_from_board: its pose when the middle row is exposed.
        film: how it moves, and how the rows are exposed.
    """

    printed: PrintedBoard
    camera: Camera
    camera_from_board: RigidTransform
    film: BoardFilm

    @property
    def rows_differ(self) -> bool:
        """Whether the board is elsewhere in each row."""
        return bool(self.film.rolling_shutter_s and self.moves)

    @property
    def moves(self) -> bool:
        """Whether the board moves at all."""
        return any(self.film.velocity_mps) or any(self.film.turning_radps)

    def row_times_s(self, rows_px: Values) -> Values:
        """Return when rows are exposed, from the time of the pose on [s]."""
        height = self.camera.height_px
        return np.asarray(self.film.rolling_shutter_s * (rows_px - 0.5 * (height - 1)) / height)

    def poses(self, times_s: Values) -> tuple[np.ndarray, np.ndarray]:
        """Return rotations (n, 3, 3) and translations (n, 3) of camera_from_board at times (n,)."""
        times = np.asarray(times_s, dtype=np.float64)[:, None]
        middle = self.camera_from_board @ self.printed.middle_m[None]
        rotations = rotation_exp(times * np.array(self.film.turning_radps)) @ self.camera_from_board.rotation
        middles = middle + times * np.array(self.film.velocity_mps)
        return rotations, middles - rotations @ self.printed.middle_m

    def pixels(self, points_m: Points3) -> Points2:
        """Return where points of the board (n, 3) are in the picture: each in the row that is exposed when it is there."""
        pixels = self.camera.project(self.camera_from_board @ points_m)
        if not self.rows_differ:
            return pixels
        for _ in range(_ROUNDS):
            rotations, translations = self.poses(self.row_times_s(pixels[:, 1]))
            seen: Vector3 = np.einsum("nij,nj->ni", rotations, points_m) + translations
            before, pixels = pixels, self.camera.project(seen)
            if not np.nanmax(np.abs(pixels - before), initial=0.0) > _CLOSE_PX:
                break
        return pixels


def true_corners(
    board: Board, camera: Camera, camera_from_board: RigidTransform, film: BoardFilm | None = None
) -> Points2:
    """Return where the corners of a filmed board really are (n, 2), by id; NaN behind the camera. For tests only.

    Args:
        board: the board as stated.
        camera: the true camera.
        camera_from_board: the board's pose when the middle row is exposed.
        film: how it is filmed; None for an ideal board at rest.
    """
    film = film or BoardFilm()
    printed = printed_board(board, film.shape)
    return MovingBoard(printed, camera, camera_from_board, film).pixels(printed.corners_m)


_FINE = 2
"""Samples per pixel along each axis; each is filtered over its own width, so that edges are exact."""
_STRIDE = 8
_LOOKUP = 4096
_MOST_EXPOSURES = 15
_MARGIN_PX = 4.0


def render_board(
    board: Board,
    camera: Camera,
    camera_from_board: RigidTransform,
    film: BoardFilm | None = None,
    *,
    seed: int = 0,
    background: np.ndarray | None = None,
) -> np.ndarray:
    """Render a board: (h, w, 3) uint8, blue first, all channels alike.

    Args:
        board: which board.
        camera: the lens.
        camera_from_board: the board's pose when the middle row is exposed.
        film: what the picture suffers; None for an ideal one.
        seed: of the background and the noise.
        background: (h, w) grey levels behind the board; None draws a cluttered room.
    """
    import cv2

    film = film or BoardFilm()
    rng = np.random.default_rng([seed, 5])
    levels = room_behind(rng, camera) if background is None else background.astype(np.float32)
    moving = MovingBoard(printed_board(board, film.shape), camera, camera_from_board, film)
    draw_board(levels, moving)
    if film.blur_px:
        levels = cv2.GaussianBlur(levels, (0, 0), film.blur_px, borderType=cv2.BORDER_REPLICATE)
    levels *= _light(camera, film)
    if film.noise_grey:
        levels += film.noise_grey * rng.standard_normal(levels.shape, dtype=np.float32)
    grey = np.clip(levels + 0.5, 0.0, 255.0).astype(np.uint8)
    return np.asarray(cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR))


def draw_board(levels: np.ndarray, moving: MovingBoard, *, blur_px: float = 0.0) -> None:
    """Draw a board into grey levels.

    Args:
        levels: (h, w) or (h, w, 3), changed in place.
        moving: the board.
        blur_px: standard deviation of the blur of the board alone [px].
    """
    import cv2

    window = _window(moving)
    if window is None:
        return
    rows, columns = window
    film = moving.film
    shares = _exposures(moving)
    u, v = (one.start - 0.5 + (np.arange(_FINE * (one.stop - one.start)) + 0.5) / _FINE for one in (columns, rows))
    rays = grid_rays(moving.camera, u, v).astype(np.float32)  # good for 1e-4 px, and twice as fast
    drawn = [_sampled(moving, _on_board(moving, rays, v, share * film.exposure_s)) for share in shares.tolist()]
    paper, cover = np.mean([white for white, _ in drawn], axis=0), np.mean([whole for _, whole in drawn], axis=0)
    if blur_px:
        paper, cover = (cv2.GaussianBlur(layer, (0, 0), blur_px) for layer in (paper, cover))
    board = np.float32(film.black_grey) * (cover - paper) + np.float32(film.white_grey) * paper
    patch = levels[rows, columns]
    if levels.ndim == 3:
        board, cover = board[..., None], cover[..., None]
    patch *= 1.0 - cover
    patch += board


def _exposures(moving: MovingBoard) -> Values:
    """Return the times within the exposure at which the board is drawn, as shares of it about its middle."""
    if not (moving.film.exposure_s and moving.moves):
        return np.zeros(1)
    half = 0.5 * moving.film.exposure_s
    rotations, translations = moving.poses(np.array([-half, half]))
    corners = moving.printed.corners_m
    ends = [
        moving.camera.project(corners @ turn.T + shift) for turn, shift in zip(rotations, translations, strict=True)
    ]
    way_px = float(np.nanmax(np.linalg.norm(ends[1] - ends[0], axis=1), initial=0.0))
    count = int(np.clip(np.ceil(way_px), 1, _MOST_EXPOSURES))
    return (np.arange(count) + 0.5) / count - 0.5


def _window(moving: MovingBoard) -> tuple[slice, slice] | None:
    """Return the rows and columns of the picture in which the board is; None if it is not in it."""
    pattern, camera = moving.printed.pattern, moving.camera
    x, y = np.meshgrid(
        np.linspace(pattern.x_m[0], pattern.x_m[-1], 24), np.linspace(pattern.y_m[0], pattern.y_m[-1], 24)
    )
    points = np.stack([x, y, moving.printed.height_m(x, y)], axis=-1).reshape(-1, 3)
    reach_s = 0.5 * (moving.film.rolling_shutter_s + moving.film.exposure_s)
    poses = moving.poses(np.array([-reach_s, 0.0, reach_s]))
    pixels = np.concatenate([camera.project(points @ turn.T + shift) for turn, shift in zip(*poses, strict=True)])
    pixels = pixels[np.isfinite(pixels).all(axis=1)]
    if not len(pixels):
        return None
    low = np.maximum(np.floor(pixels.min(axis=0) - _MARGIN_PX), 0).astype(int)
    high = np.minimum(np.ceil(pixels.max(axis=0) + _MARGIN_PX + 1), [camera.width_px, camera.height_px]).astype(int)
    if np.any(high <= low):
        return None
    return slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0]))


def _sampled(moving: MovingBoard, places_m: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return for each pixel of a window the share that is white, and the share that the board covers.

    Args:
        moving: the board.
        places_m: x and y of what each sample sees.
    """
    import cv2

    x, y = places_m
    size = x.shape[1] // _FINE, x.shape[0] // _FINE
    x_m, y_m = moving.printed.pattern.x_m, moving.printed.pattern.y_m
    column, right = _between_lines(x, x_m)
    row, lower = _between_lines(y, y_m)
    cells = np.pad(moving.printed.pattern.paper, 1)
    inked = np.pad(np.ones_like(moving.printed.pattern.paper), 1)
    shares = []
    for values in (cells, inked):
        flat, width = values.ravel(), values.shape[1]
        place = row * width + column
        upper_row = flat[place] + right * (flat[place + 1] - flat[place])
        lower_row = flat[place + width] + right * (flat[place + width + 1] - flat[place + width])
        shares.append(cv2.resize(upper_row + lower * (lower_row - upper_row), size, interpolation=cv2.INTER_AREA))
    return shares[0], shares[1]


def _on_board(moving: MovingBoard, rays: np.ndarray, v_px: Values, later_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Return x and y (rows, columns) of where rays meet the board, float32; far away where they do not."""
    times = later_s + (moving.row_times_s(v_px) if moving.rows_differ else np.zeros(1))
    rotations, translations = moving.poses(times)
    origins = -np.einsum("nji,nj->ni", rotations, translations).astype(np.float32)
    rotations = rotations.astype(np.float32)
    if moving.rows_differ:
        along = [sum(rotations[:, i, j, None] * rays[i] for i in range(3)) for j in range(3)]
    else:
        along = list((rotations[0].T @ rays.reshape(3, -1)).reshape(rays.shape))
    start = [origins[:, j, None] for j in range(3)]
    reach = _reach(moving.printed, start, along)
    with np.errstate(invalid="ignore", over="ignore"):
        good = reach > 0.0
        x, y = (np.where(good, start[j] + reach * along[j], np.float32(1e3)) for j in (0, 1))
    return x, y


def _reach(printed: PrintedBoard, start: list[np.ndarray], along: list[np.ndarray]) -> np.ndarray:
    """Return how far along each ray the board's surface is: the root of a quadratic that is next to the plane's."""
    with np.errstate(divide="ignore", invalid="ignore"):
        if not any(printed.bends):
            return np.asarray(-start[2] / along[2])
        across = [start[j] - np.float32(printed.middle_m[j]) for j in (0, 1)]
        square = sum(bend * along[j] ** 2 for j, bend in enumerate(printed.bends))
        linear = along[2] + sum(2.0 * bend * across[j] * along[j] for j, bend in enumerate(printed.bends))
        rest = start[2] - printed.sag_m + sum(bend * across[j] ** 2 for j, bend in enumerate(printed.bends))
        root = np.sqrt(linear**2 - 4.0 * square * rest)
        return np.asarray(-2.0 * rest / (linear + np.where(linear < 0.0, -root, root)))


def _between_lines(places: np.ndarray, lines: Values) -> tuple[np.ndarray, np.ndarray]:
    """Return the cell (in a padded row of cells) before the line nearest to each place, and the share beyond that line."""
    start, step = float(lines[0]), float(lines[-1] - lines[0]) / _LOOKUP
    middles = 0.5 * (lines[1:] + lines[:-1])
    nearest = np.searchsorted(middles, start + step * (np.arange(_LOOKUP) + 0.5)).astype(np.int32)
    row = np.clip((places - np.float32(start)) * np.float32(1.0 / step), 0, _LOOKUP - 1).astype(np.int32)
    line = nearest[row]
    share = (places - lines.astype(np.float32)[line]) / _width(places) + np.float32(0.5)
    return line, np.clip(share, 0.0, 1.0, out=share)


def _width(places: np.ndarray) -> np.ndarray:
    """Return how wide a sample is in the coordinate: the sum of its slopes along both axes, found on a coarser grid."""
    import cv2

    coarse = places[::_STRIDE, ::_STRIDE]
    if min(coarse.shape) < 2:
        coarse, stride = places, 1
    else:
        stride = _STRIDE
    slopes = sum(np.abs(np.gradient(coarse, axis=axis)) for axis in (0, 1))
    wide = np.asarray(slopes / np.float32(stride), dtype=np.float32)
    return np.maximum(cv2.resize(wide, places.shape[::-1], interpolation=cv2.INTER_LINEAR), np.float32(1e-7))


def _light(camera: Camera, film: BoardFilm) -> np.ndarray:
    """Return the brightness (h, w) over the usual one: exposure, gradient, vignetting."""
    u = np.linspace(-1.0, 1.0, camera.width_px, dtype=np.float32)
    v = np.linspace(-1.0, 1.0, camera.height_px, dtype=np.float32)[:, None]
    corner = u[0] ** 2 + v[0] ** 2
    slope = 1.0 + np.float32(film.gradient[0]) * u + np.float32(film.gradient[1]) * v
    dark = 1.0 - np.float32(film.vignetting) * (u * u + v * v) / corner
    return np.asarray(np.float32(film.exposure) * np.maximum(slope, 0.0) * dark, dtype=np.float32)


_OCTAVES_PX = ((160, 28.0), (40, 14.0), (9, 6.0))
_THINGS = 14


def room_behind(rng: np.random.Generator, camera: Camera) -> np.ndarray:
    """Draw grey levels (h, w), float32: clouds of three sizes, and things with straight edges."""
    import cv2

    width, height = camera.width_px, camera.height_px
    levels = np.full((height, width), 110.0, dtype=np.float32)
    for size, strength in _OCTAVES_PX:
        small = rng.standard_normal((height // size + 3, width // size + 3), dtype=np.float32)
        levels += np.float32(strength) * cv2.resize(small, (width, height), interpolation=cv2.INTER_CUBIC)
    for _ in range(_THINGS):
        u, v = rng.uniform([0.0, 0.0], [width, height]).tolist()
        long, wide = (rng.uniform(0.02, 0.22, 2) * width).tolist()
        corners = cv2.boxPoints(((u, v), (long, wide), float(rng.uniform(0.0, 180.0))))
        cv2.fillConvexPoly(levels, np.round(corners).astype(np.int32), (float(rng.uniform(30.0, 210.0)),))
    return np.clip(levels, 5.0, 245.0)


_NODES = 20


def grid_rays(camera: Camera, u_px: Values, v_px: Values) -> np.ndarray:
    """Return the unit rays (3, rows, columns) that the pixels (u, v) see; NaN where the lens has none.

    The lens is inverted at a few pixels only; the interpolation is exact to far below a thousandth of a pixel. Where the lens
    has no rays at some of them, every pixel is inverted.
    """
    spans = [(float(one.min()), float(one.max())) for one in (u_px, v_px)]
    nodes = np.cos(np.pi * (np.arange(_NODES) + 0.5) / _NODES)
    at_u, at_v = (0.5 * (low + high) + 0.5 * (high - low) * nodes for low, high in spans)
    rays = _exact(camera, at_u, at_v)
    if not np.isfinite(rays).all():
        return _exact(camera, u_px, v_px)
    to_u, to_v = (_weights(one, span) for one, span in zip((u_px, v_px), spans, strict=True))
    return np.asarray(to_v @ rays @ to_u.T)


def _exact(camera: Camera, u_px: Values, v_px: Values) -> np.ndarray:
    u, v = np.meshgrid(u_px, v_px)
    rays = camera.rays(np.stack([u.ravel(), v.ravel()], axis=1))
    return np.ascontiguousarray(rays.T).reshape(3, len(v_px), len(u_px))


def _weights(places: Values, span: tuple[float, float]) -> np.ndarray:
    """Return what each node contributes at places (n, nodes)."""
    low, high = span
    scaled = (2.0 * places - low - high) / max(high - low, 1e-9)
    nodes = np.cos(np.pi * (np.arange(_NODES) + 0.5) / _NODES)
    fit = np.polynomial.chebyshev.chebvander(nodes, _NODES - 1)
    fit[:, 1:] *= 2.0
    return np.asarray(np.polynomial.chebyshev.chebvander(scaled, _NODES - 1) @ fit.T / _NODES)


@dataclass(frozen=True, slots=True)
class CornerErrors:
    """How found corners differ from the true ones.

    Attributes:
        sigma_px: standard deviation of independent errors, per axis.
        shared_px: standard deviation of errors that neighbouring corners of a view share, per axis.
        shared_over: distance over which they do, as a share of the board's diagonal in the picture.
        outlier_share: share of the corners with a gross error.
        outlier_px: standard deviation of that, per axis.
        speed_mps, turning_radps: standard deviations of the board's motion per axis, which matters to a rolling shutter.
    """

    sigma_px: float = 0.1
    shared_px: float = 0.0
    shared_over: float = 0.3
    outlier_share: float = 0.0
    outlier_px: float = 10.0
    speed_mps: float = 0.0
    turning_radps: float = 0.0


def simulated_views(
    rng: np.random.Generator,
    board: Board,
    camera: Camera,
    poses: Sequence[RigidTransform],
    errors: CornerErrors | None = None,
    film: BoardFilm | None = None,
) -> tuple[BoardCorners, ...]:
    """Return what a detector would find in pictures of a board; corners outside the picture are missing.

    Args:
        rng: the only source of randomness.
        board: the board as stated.
        camera: the true camera.
        poses: of the board, camera_from_board.
        errors: of the corners; None for independent ones only.
        film: its shape, and how long the picture's rows take.
    """
    errors, film = errors or CornerErrors(), film or BoardFilm()
    printed = printed_board(board, film.shape)
    size_px = camera.width_px, camera.height_px
    views = []
    for index, pose in enumerate(poses):
        moving = _waved(rng, film, errors) if errors.speed_mps or errors.turning_radps else film
        pixels = MovingBoard(printed, camera, pose, moving).pixels(printed.corners_m)
        pixels = pixels + _drawn_errors(rng, pixels, errors)
        ids = np.flatnonzero(camera.in_image(pixels))
        views.append(BoardCorners(index, f"view {index + 1}", None, size_px, ids, pixels[ids]))
    return tuple(views)


def _waved(rng: np.random.Generator, film: BoardFilm, errors: CornerErrors) -> BoardFilm:
    """Return the film with a drawn motion of the board."""
    x_mps, y_mps, z_mps = (errors.speed_mps * rng.standard_normal(3)).tolist()
    x_radps, y_radps, z_radps = (errors.turning_radps * rng.standard_normal(3)).tolist()
    return replace(film, velocity_mps=(x_mps, y_mps, z_mps), turning_radps=(x_radps, y_radps, z_radps))


def _drawn_errors(rng: np.random.Generator, pixels: Points2, errors: CornerErrors) -> Points2:
    drawn = errors.sigma_px * rng.standard_normal(pixels.shape)
    if errors.shared_px:
        apart = np.linalg.norm(pixels[:, None] - pixels[None], axis=2)
        reach = errors.shared_over * float(np.linalg.norm(np.ptp(pixels, axis=0)))
        values, vectors = np.linalg.eigh(np.exp(-0.5 * (apart / reach) ** 2))
        mixed = vectors * np.sqrt(np.maximum(values, 0.0))
        drawn += errors.shared_px * mixed @ rng.standard_normal(pixels.shape)
    gross = rng.uniform(size=len(pixels)) < errors.outlier_share
    drawn[gross] += errors.outlier_px * rng.standard_normal((int(gross.sum()), 2))
    return drawn


_TRIES = 300
_SHIFTS = 12
_RIM_PX = 4.0
_RIM_SQUARES = 1.2
"""Besides the corners, the squares around them are in the picture, and some of the margin."""


@dataclass(frozen=True, slots=True)
class Waving:
    """How a person waves a board.

    Attributes:
        tilt_deg: largest tilt out of the picture's plane.
        roll_deg: largest turn within it.
        size: smallest and largest width of the board, as shares of the picture's width.
        cover: share of the picture, around its middle, in which the board is held.
    """

    tilt_deg: float = 45.0
    roll_deg: float = 25.0
    size: tuple[float, float] = (0.28, 0.65)
    cover: float = 1.0


def waved_poses(
    rng: np.random.Generator, board: Board, camera: Camera, count: int, waving: Waving | None = None
) -> tuple[RigidTransform, ...]:
    """Draw poses at which all squares are in the picture: tilted to all sides, near and far, all over it.

    Args:
        rng: the only source of randomness.
        board: which board.
        camera: that sees it.
        count: number of poses.
        waving: how it is held; None for all over the picture.

    Raises:
        ValueError: the board does not fit in the picture in this way.
    """
    waving = waving or Waving()
    corners = board.corners_m
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    outline = middle + (corners - middle) * (
        1.0 + 2.0 * _RIM_SQUARES * board.square_m / np.append(np.ptp(corners[:, :2], axis=0), 1.0)
    )
    found: list[RigidTransform] = []
    for place in _spread(rng, count):
        drawn = (_drawn(rng, outline, middle, camera, waving, place) for _ in range(_TRIES))
        pose = next((pose for pose in drawn if pose is not None), None)
        if pose is None:
            raise ValueError(f"only {len(found)} of {count} poses of the board fit in the picture")
        found.append(pose)
    return tuple(found)


def _spread(rng: np.random.Generator, count: int) -> Points2:
    """Draw places in the unit square, one per cell of a grid, in random order."""
    side = int(np.ceil(np.sqrt(count)))
    row, column = np.divmod(rng.permutation(side * side)[:count], side)
    return (np.stack([column, row], axis=1) + rng.uniform(size=(count, 2))) / side


def _drawn(
    rng: np.random.Generator, outline: Points3, middle: np.ndarray, camera: Camera, waving: Waving, place: Vector2
) -> RigidTransform | None:
    """Draw a tilt and a size, and shift the board into the region; None if it does not fit there."""
    bearing, tilt = rng.uniform(0.0, 2.0 * np.pi), np.deg2rad(waving.tilt_deg) * np.sqrt(rng.uniform())
    roll = np.deg2rad(waving.roll_deg) * rng.uniform(-1.0, 1.0)
    turned = rotation_exp(tilt * np.array([np.cos(bearing), np.sin(bearing), 0.0])) @ rotation_exp(
        np.array([0.0, 0.0, roll])
    )
    size_px = np.array([camera.width_px, camera.height_px])
    inset = 0.5 * (1.0 - np.sqrt(waving.cover)) * size_px
    low, high = inset + _RIM_PX, size_px - 1 - inset - _RIM_PX
    centre = low + place * (high - low)
    distance = float(np.ptp(outline[:, 0]) * camera.matrix_px[0, 0] / (rng.uniform(*waving.size) * camera.width_px))
    for _ in range(_SHIFTS):
        ray = camera.rays(centre[None])[0]
        if not np.isfinite(ray).all():
            return None
        # the board faces the camera, whatever the ray: tilts are against the line of sight
        rotation = _facing(ray) @ turned
        pose = RigidTransform(rotation, distance * ray - rotation @ middle)
        seen = pose @ outline
        pixels = camera.project(seen)
        if not np.isfinite(pixels).all():
            return None
        beyond = np.maximum(low - pixels.min(axis=0), 0.0) - np.maximum(pixels.max(axis=0) - high, 0.0)
        if not beyond.any():
            return pose if bool(camera.sees(seen).all()) else None
        centre = np.clip(centre + beyond, low, high)
    return None


def _facing(ray: np.ndarray) -> np.ndarray:
    """Return the smallest rotation that turns the optical axis into a ray."""
    axis = np.array([-ray[1], ray[0], 0.0])
    sine = float(np.linalg.norm(axis))
    return np.eye(3) if sine < 1e-9 else rotation_exp(axis / sine * np.arctan2(sine, ray[2]))
