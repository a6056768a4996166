"""The picture of a board: every pixel through the lens to the board, smooth at its edges, and the cluttered room behind it."""

import numpy as np

from calib_core.arrays import Values
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform
from calib_core.intrinsics import Board
from calib_core.synthetic.boards.moving_board import BoardFilm, MovingBoard
from calib_core.synthetic.boards.printed_board import PrintedBoard, printed_board

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
