"""A calibration board in the image: as it really is, moving, and at the poses of one that a person waves before a camera.

A printed board may be bent, and a moving one is exposed row by row. Every pixel goes through the lens to the board, smooth at
its edges.
"""

from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Points2, Points3, Values, Vector2, Vector3, freeze
from calib_core.camera import Camera
from calib_core.errors import OptionError
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.intrinsics.board import Board
from calib_core.synthetic.rig import Window

MARGIN_SQUARES = 0.6
"""Width of the white margin around the squares."""


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
        freeze(self, x_m=(None,), y_m=(None,))
        shape = (len(self.y_m) - 1, len(self.x_m) - 1)
        freeze(self, np.float32, paper=shape)


def checkerboard(board: Board) -> BoardPattern:
    """Return the squares of a checkerboard."""
    x_m, y_m = (board.square_m * np.arange(-1, count + 1) for count in (board.columns, board.rows))
    odd = np.add.outer(np.arange(board.rows + 1), np.arange(board.columns + 1)) % 2
    return with_margin(x_m, y_m, odd, MARGIN_SQUARES * board.square_m)


def with_margin(x_m: Values, y_m: Values, paper: np.ndarray, margin_m: float) -> BoardPattern:
    """Return the cells between lines, with white paper around them."""
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
        freeze(self, corners_m=(None, 3), middle_m=(3,))

    def height_m(self, x_m: np.ndarray, y_m: np.ndarray) -> np.ndarray:
        """Return z of the surface at x, y [m]."""
        x, y = x_m - self.middle_m[0], y_m - self.middle_m[1]
        return np.asarray(self.sag_m - self.bends[0] * x * x - self.bends[1] * y * y)


def printed_board(board: Board, pattern: BoardPattern, bend_m: tuple[float, float] = (0.0, 0.0)) -> PrintedBoard:
    """Return a board with its bend.

    Args:
        board: as stated.
        pattern: what is printed on it.
        bend_m: how far its middle stands behind its sides, and behind its upper and lower edge: a quadratic bend [m].
    """
    corners = board.corners_m
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    half = 0.5 * np.ptp(corners[:, :2], axis=0)
    x_m, y_m = (middle[i] + (lines_m - middle[i]) for i, lines_m in enumerate((pattern.x_m, pattern.y_m)))
    bends = (float(bend_m[0] / half[0] ** 2), float(bend_m[1] / half[1] ** 2))
    flat = PrintedBoard(BoardPattern(x_m, y_m, pattern.paper), np.zeros((0, 3)), middle, bends, float(sum(bend_m)))
    x, y = np.interp(corners[:, 0], pattern.x_m, x_m), np.interp(corners[:, 1], pattern.y_m, y_m)
    return replace(flat, corners_m=np.stack([x, y, flat.height_m(x, y)], axis=1))


@dataclass(frozen=True, slots=True)
class BoardMotion:
    """How a board moves while it is filmed.

    Attributes:
        velocity_mps: (3,) of the board's middle, in the camera frame.
        turning_radps: (3,) the board's rotation vector per second, in the camera frame.
        rolling_shutter_s: from the exposure of the first row to that of the last; the pose is that at the middle row.
        exposure_s: how long each row is exposed.
    """

    velocity_mps: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turning_radps: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rolling_shutter_s: float = 0.0
    exposure_s: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class MovingBoard:
    """A board that moves steadily through an image.

    Attributes:
        printed: the board.
        camera: that films it.
        camera_from_board: its pose when the middle row is exposed.
        motion: how it moves, and how the rows are exposed.
    """

    printed: PrintedBoard
    camera: Camera
    camera_from_board: RigidTransform
    motion: BoardMotion

    @property
    def rows_differ(self) -> bool:
        """Whether the board is elsewhere in each row."""
        return bool(self.motion.rolling_shutter_s and self.moves)

    @property
    def moves(self) -> bool:
        """Whether the board moves at all."""
        return any(self.motion.velocity_mps) or any(self.motion.turning_radps)

    def row_times_s(self, rows_px: Values) -> Values:
        """Return when rows are exposed, from the time of the pose on [s]."""
        height = self.camera.height_px
        return np.asarray(self.motion.rolling_shutter_s * (rows_px - 0.5 * (height - 1)) / height)

    def poses(self, times_s: Values) -> tuple[np.ndarray, np.ndarray]:
        """Return rotations (n, 3, 3) and translations (n, 3) of camera_from_board at times (n,)."""
        times = np.asarray(times_s, dtype=np.float64)[:, None]
        middle = self.camera_from_board @ self.printed.middle_m[None]
        rotations = rotation_exp(times * np.array(self.motion.turning_radps)) @ self.camera_from_board.rotation
        middles = middle + times * np.array(self.motion.velocity_mps)
        return rotations, middles - rotations @ self.printed.middle_m


_BLACK_GREY, _WHITE_GREY = 35.0, 205.0
"""Of the board's ink and paper."""
_FINE = 2
"""Samples per pixel along each axis; each is filtered over its own width, so that edges are exact."""
_STRIDE = 8
_LOOKUP = 4096
_MOST_EXPOSURES = 15
_MARGIN_PX = 4.0


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
    rows, columns, exposure_s = window.rows, window.columns, moving.motion.exposure_s
    shares = _exposures(moving)
    u, v = (one.start - 0.5 + (np.arange(_FINE * (one.stop - one.start)) + 0.5) / _FINE for one in (columns, rows))
    rays = grid_rays(moving.camera, u, v).astype(np.float32)  # good for 1e-4 px, and twice as fast
    drawn = [_sampled(moving, _on_board(moving, rays, v, share * exposure_s)) for share in shares.tolist()]
    paper, cover = np.mean([white for white, _ in drawn], axis=0), np.mean([whole for _, whole in drawn], axis=0)
    if blur_px:
        paper, cover = (cv2.GaussianBlur(layer, (0, 0), blur_px) for layer in (paper, cover))
    board = np.float32(_BLACK_GREY) * (cover - paper) + np.float32(_WHITE_GREY) * paper
    patch = levels[rows, columns]
    if levels.ndim == 3:
        board, cover = board[..., None], cover[..., None]
    patch *= 1.0 - cover
    patch += board


def _exposures(moving: MovingBoard) -> Values:
    """Return the times within the exposure at which the board is drawn, as shares of it about its middle."""
    if not (moving.motion.exposure_s and moving.moves):
        return np.zeros(1)
    half = 0.5 * moving.motion.exposure_s
    rotations, translations = moving.poses(np.array([-half, half]))
    corners = moving.printed.corners_m
    ends = [
        moving.camera.project(corners @ turn.T + shift) for turn, shift in zip(rotations, translations, strict=True)
    ]
    way_px = float(np.nanmax(np.linalg.norm(ends[1] - ends[0], axis=1), initial=0.0))
    count = int(np.clip(np.ceil(way_px), 1, _MOST_EXPOSURES))
    return (np.arange(count) + 0.5) / count - 0.5


def _window(moving: MovingBoard) -> Window | None:
    """Return the part of the image in which the board is; None if it is not in it."""
    pattern, camera = moving.printed.pattern, moving.camera
    x, y = np.meshgrid(*(np.linspace(lines_m[0], lines_m[-1], 24) for lines_m in (pattern.x_m, pattern.y_m)))
    points = np.stack([x, y, moving.printed.height_m(x, y)], axis=-1).reshape(-1, 3)
    reach_s = 0.5 * (moving.motion.rolling_shutter_s + moving.motion.exposure_s)
    poses = moving.poses(np.array([-reach_s, 0.0, reach_s]))
    pixels = np.concatenate([camera.project(points @ turn.T + shift) for turn, shift in zip(*poses, strict=True)])
    pixels = pixels[np.isfinite(pixels).all(axis=1)]
    return Window.around(pixels, camera, _MARGIN_PX) if len(pixels) else None


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


_TRIES = 300
_SHIFTS = 12
_RIM_PX = 4.0
_RIM_SQUARES = 1.2
"""Besides the corners, the squares around them are in the image, and some of the margin."""


_TILT_RAD, _ROLL_RAD = np.deg2rad([45.0, 25.0])
"""Largest tilt out of the image's plane, and turn within it."""
_SIZE = (0.28, 0.65)
"""Smallest and largest width of the board, as shares of the image's width."""


def waved_poses(rng: np.random.Generator, board: Board, camera: Camera, count: int) -> tuple[RigidTransform, ...]:
    """Draw poses at which all squares are in the image: tilted to all sides, near and far, all over it.

    Args:
        rng: the only source of randomness.
        board: which board.
        camera: that sees it.
        count: number of poses.

    Raises:
        OptionError: the board does not fit in the image in this way.
    """
    corners = board.corners_m
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    outline = middle + (corners - middle) * (
        1.0 + 2.0 * _RIM_SQUARES * board.square_m / np.append(np.ptp(corners[:, :2], axis=0), 1.0)
    )
    transforms: list[RigidTransform] = []
    for place in _spread(rng, count):
        drawn = (_draw_board_pose(rng, outline, middle, camera, place) for _ in range(_TRIES))
        pose = next((pose for pose in drawn if pose is not None), None)
        if pose is None:
            raise OptionError(
                f"only {len(transforms)} of {count} poses of the waved board fit in the image; ask for a usual size of images"
            )
        transforms.append(pose)
    return tuple(transforms)


def _spread(rng: np.random.Generator, count: int) -> Points2:
    """Draw places in the unit square, one per cell of a grid, in random order."""
    side = int(np.ceil(np.sqrt(count)))
    row, column = np.divmod(rng.permutation(side * side)[:count], side)
    return (np.stack([column, row], axis=1) + rng.uniform(size=(count, 2))) / side


def _draw_board_pose(
    rng: np.random.Generator, outline: Points3, middle: np.ndarray, camera: Camera, vector2: Vector2
) -> RigidTransform | None:
    """Draw a tilt and a size, and shift the board into the region; None if it does not fit there."""
    bearing, tilt = rng.uniform(0.0, 2.0 * np.pi), _TILT_RAD * np.sqrt(rng.uniform())
    roll = _ROLL_RAD * rng.uniform(-1.0, 1.0)
    turned = rotation_exp(tilt * np.array([np.cos(bearing), np.sin(bearing), 0.0])) @ rotation_exp(
        np.array([0.0, 0.0, roll])
    )
    low, high = _RIM_PX, np.array([camera.width_px, camera.height_px]) - 1 - _RIM_PX
    centre = low + vector2 * (high - low)
    distance = float(np.ptp(outline[:, 0]) * camera.matrix_px[0, 0] / (rng.uniform(*_SIZE) * camera.width_px))
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
