"""A lens with the poses of all views, and how the pixels of all corners follow from them.

The corners of all views are arrays with one row per view, so that a step of the adjustment is a few products. A board may be bent
along either side, twisted, or printed too long.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from calib_core.arrays import Flags, Points3, Values, freeze, frozen_array
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_exp, rotation_jacobian
from calib_core.intrinsics.board_images import BoardCorners


@dataclass(frozen=True, slots=True, eq=False)
class BoardWarp:
    """Ways in which the corners of a board may be off their places.

    Attributes:
        names: (s,) of the amounts: "bend along the rows" and so on.
        directions: (s, n, 3) how far each corner moves for an amount of one, by id [m].
    """

    names: tuple[str, ...]
    directions: np.ndarray

    def __post_init__(self) -> None:
        freeze(self, directions=(len(self.names), None, 3))

    def __len__(self) -> int:
        return len(self.names)

    def displacements_m(self, corner_ids: np.ndarray) -> np.ndarray:
        """Return how corners (v, m) move for amounts of one: (v, s, 3, m)."""
        return np.asarray(np.moveaxis(self.directions[:, corner_ids], (0, 3), (1, 2)))

    def shape_m(self, board_m: Points3, amounts: np.ndarray) -> Points3:
        """Return the corners (n, 3) of a board that is warped by amounts (s,)."""
        return board_m + np.tensordot(amounts, self.directions, axes=1) if len(self) else board_m


STRETCH = "stretch of the rows"
FLAT = BoardWarp((), np.zeros((0, 1, 3)))
"""The board is as stated."""


def possible_warps(board_m: Points3) -> BoardWarp:
    """Return the warps that are looked for.

    The first three amounts are heights [m]: of the middle over the ends along the rows and along the columns, positive
    where the middle lies deeper in the board, and of the twist at a corner of the board. The last is by how much the
    rows are longer than stated, with the columns as stated.

    Args:
        board_m: (n, 3) corners of the board as stated, by id.
    """
    low, high = board_m[:, :2].min(axis=0), board_m[:, :2].max(axis=0)
    across, down = ((2.0 * board_m[:, :2] - low - high) / (high - low)).T
    directions = np.zeros((4, len(board_m), 3))
    directions[0, :, 2], directions[1, :, 2], directions[2, :, 2] = 1.0 - across**2, 1.0 - down**2, across * down
    directions[3, :, 0] = board_m[:, 0] - (low[0] + high[0]) / 2.0
    return BoardWarp(("bend along the rows", "bend along the columns", "twist", STRETCH), directions)


@dataclass(frozen=True, slots=True, eq=False)
class ViewStack:
    """Corners of v views; a view with fewer than m corners ends with places that have no weight.

    Attributes:
        board_m: (v, 3, m) the corners on the board as stated.
        pixels_px: (v, 2, m) where they were found.
        corner_ids: (v, m) which corners of the board.
        weights: (v, m) of each corner; 0 for none.
        size_px: width and height of the images.
    """

    board_m: np.ndarray
    pixels_px: np.ndarray
    corner_ids: np.ndarray
    weights: np.ndarray
    size_px: tuple[int, int]

    def __post_init__(self) -> None:
        freeze(self, board_m=(None, 3, None), pixels_px=(None, 2, None), weights=(None, None))
        freeze(self, np.int64, corner_ids=(None, None))

    def __len__(self) -> int:
        return len(self.weights)

    @property
    def corner_counts(self) -> np.ndarray:
        """Corners with a weight in each view: (v,)."""
        return np.asarray((self.weights > 0).sum(axis=1))

    def of(self, views: np.ndarray) -> "ViewStack":
        """Return some of the views, given by numbers or flags (v,)."""
        return ViewStack(
            self.board_m[views], self.pixels_px[views], self.corner_ids[views], self.weights[views], self.size_px
        )

    def weighted(self, weights: np.ndarray) -> "ViewStack":
        """Return the views with other weights (v, m)."""
        return replace(self, weights=weights)

    def mean_square(self, residuals_px: np.ndarray) -> np.ndarray:
        """Return the mean squared distance (v,) [px^2] of the corners that have a weight; residuals are (v, 2, m)."""
        counted = self.weights > 0
        squares = np.where(counted, np.square(residuals_px).sum(axis=1), 0.0).sum(axis=1)
        return np.asarray(squares / np.maximum(counted.sum(axis=1), 1))

    def mirrored(self) -> "ViewStack":
        """Return the views as they would be in images whose left and right are exchanged."""
        pixels = self.pixels_px.copy()
        pixels[:, 0] = self.size_px[0] - 1 - pixels[:, 0]
        return replace(self, pixels_px=pixels)


def stack_views(
    views: Sequence[BoardCorners], board_m: Points3, size_px: tuple[int, int], used: Sequence[Flags] | None = None
) -> ViewStack:
    """Stack views.

    Args:
        views: of the board.
        board_m: (n, 3) its corners, by id.
        size_px: width and height of the images.
        used: for each view (n,) which corners have a weight; all if None.
    """
    most = max(len(view.corner_ids) for view in views)
    ids = np.zeros((len(views), most), dtype=np.int64)
    pixels, weights = np.zeros((len(views), 2, most)), np.zeros((len(views), most))
    for row, view in enumerate(views):
        count = len(view.corner_ids)
        ids[row, :count] = view.corner_ids
        ids[row, count:] = view.corner_ids[0]  # a place without weight repeats a corner, so that it projects too
        pixels[row, :, :count], pixels[row, :, count:] = view.pixels_px.T, view.pixels_px[0][:, None]
        weights[row, :count] = 1.0 if used is None else used[row]
    return ViewStack(np.moveaxis(board_m[ids], 2, 1), pixels, ids, weights, size_px)


_PULLED = {"rational_polynomial": ("k4", "k5", "k6")}
_PULL_PX2 = 0.01  # one unit costs as much as one corner that is 0.1 px off


@dataclass(frozen=True, slots=True, eq=False)
class LensState:
    """What an adjustment estimates.

    Attributes:
        camera: the lens.
        rotations: (v, 3, 3) of camera_from_board for each view.
        translations_m: (v, 3) of the same.
        amounts: (s,) of the board's warp.
    """

    camera: Camera
    rotations: np.ndarray
    translations_m: np.ndarray
    amounts: Values = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        freeze(self, rotations=(None, 3, 3), translations_m=(len(self.rotations), 3), amounts=(None,))

    def of(self, views: np.ndarray) -> "LensState":
        """Return the state of some of the views, given by numbers or flags (v,)."""
        return LensState(self.camera, self.rotations[views], self.translations_m[views], self.amounts)

    def pose(self, view: int) -> RigidTransform:
        """Return camera_from_board of a view."""
        return RigidTransform(self.rotations[view], self.translations_m[view])

    def moved(self, camera: Camera, poses: np.ndarray, amounts: Values) -> "LensState":
        """Return the state with another lens and shape, and poses changed by (dt, dtheta) (v, 6)."""
        rotations = rotation_exp(poses[:, 3:]) @ self.rotations
        # a rotation up to rounding: one Newton step toward the nearest rotation squares the error
        rotations = 1.5 * rotations - 0.5 * rotations @ (np.swapaxes(rotations, 1, 2) @ rotations)
        return LensState(camera, rotations, self.translations_m + poses[:, :3], amounts)


@dataclass(frozen=True, slots=True, eq=False)
class Freedom:
    """What may change in an adjustment besides the poses.

    Attributes:
        lens: (p, q) how q free numbers move the parameters of the camera; (p, 0) keeps the lens.
        warp: how the board may be warped.
        pull: (p,) weights [px^2] of the squares of the camera's parameters in the cost. Coefficients that views leave
            nearly free, because others make up for them, stay about as small as those of real lenses; what views
            determine, they do not move.
    """

    lens: np.ndarray
    warp: BoardWarp = FLAT
    pull: Values = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        freeze(self, lens=(None, None))
        pull = self.pull if len(self.pull) else np.zeros(len(self.lens))
        object.__setattr__(self, "pull", frozen_array(pull, (len(self.lens),)))

    @classmethod
    def of(cls, camera: Camera, *, warp: BoardWarp = FLAT) -> "Freedom":
        """Free all parameters of a camera."""
        pulled = [_PULL_PX2 if name in _PULLED.get(camera.model, ()) else 0.0 for name in camera.parameter_names]
        return cls(np.eye(len(camera.parameters)), warp, np.array(pulled))

    @classmethod
    def none(cls, camera: Camera) -> "Freedom":
        """Keep the camera and the board."""
        return cls(np.zeros((len(camera.parameters), 0)))

    def pull_cost(self, camera: Camera) -> float:
        """Return half the weighted squares of the parameters [px^2]."""
        return 0.5 * float(np.square(camera.parameters) @ self.pull)

    @property
    def count(self) -> int:
        """Free numbers besides the poses: of the lens, then of the warp."""
        return self.lens.shape[1] + len(self.warp)


@dataclass(frozen=True, slots=True, eq=False)
class Linearized:
    """Residuals and their slopes at a state, each row of a view multiplied by the root of its corner's weight.

    Attributes:
        residuals: (v, 2 m) projected minus found [px]; all columns first.
        shared: (v, q, 2 m) their slope with respect to the free numbers of lens and warp.
        poses: (v, 6, 2 m) with respect to (dt, dtheta) of the view.
        prior: (q, q) the second derivative of what pulls the free numbers.
        prior_gradient: (q,) its first.
    """

    residuals: np.ndarray
    shared: np.ndarray
    poses: np.ndarray
    prior: np.ndarray
    prior_gradient: Values


def warped(stack: ViewStack, warp: BoardWarp, amounts: Values) -> ViewStack:
    """Return the views of the board as it is warped, in which it counts as stated."""
    return replace(stack, board_m=_warped(amounts, stack, warp)) if len(warp) else stack


def _warped(amounts: Values, stack: ViewStack, warp: BoardWarp) -> np.ndarray:
    """Return the corners (v, 3, m) on the board as warped, in the board's frame [m]."""
    if not len(warp):
        return stack.board_m
    return np.asarray(stack.board_m + np.tensordot(amounts, warp.displacements_m(stack.corner_ids), axes=([0], [1])))


def residuals_of(state: LensState, stack: ViewStack, warp: BoardWarp = FLAT) -> np.ndarray:
    """Return projected minus found corners: (v, 2, m) [px]; NaN where the lens does not image a corner."""
    camera_m = state.rotations @ _warped(state.amounts, stack, warp) + state.translations_m[:, :, None]
    with np.errstate(all="ignore"):
        return np.asarray(state.camera.project_planes(camera_m)[0] - stack.pixels_px)


def linearize(state: LensState, stack: ViewStack, freedom: Freedom) -> Linearized:
    """Differentiate the residuals of all corners at a state."""
    views, corners = stack.weights.shape
    turned_m = state.rotations @ _warped(state.amounts, stack, freedom.warp)
    camera_m = turned_m + state.translations_m[:, :, None]
    pixels, d_point = state.camera.project_planes(camera_m)
    poses = np.empty((views, 6, 2, corners))
    poses[:, :3] = d_point
    rotation_jacobian(turned_m, d_point, out=poses[:, 3:])
    lens_count = freedom.lens.shape[1]
    shared = np.empty((views, freedom.count, 2, corners))
    if lens_count:
        slopes = state.camera.parameter_planes(camera_m).reshape(views, len(freedom.lens), 2 * corners)
        shared[:, :lens_count] = (freedom.lens.T @ slopes).reshape(views, lens_count, 2, corners)
    if len(freedom.warp):
        moved = state.rotations[:, None] @ freedom.warp.displacements_m(stack.corner_ids)
        shared[:, lens_count:] = np.einsum("vacm,vsam->vscm", d_point, moved)
    root = np.sqrt(stack.weights)[:, None]
    prior, gradient = np.zeros((freedom.count, freedom.count)), np.zeros(freedom.count)
    prior[:lens_count, :lens_count] = freedom.lens.T @ (freedom.pull[:, None] * freedom.lens)
    gradient[:lens_count] = freedom.lens.T @ (freedom.pull * state.camera.parameters)
    counted = root > 0.0  # what has no weight may be where the lens does not image it
    return Linearized(
        np.where(counted, (pixels - stack.pixels_px) * root, 0.0).reshape(views, -1),
        np.where(counted[:, None], shared * root[:, None], 0.0).reshape(views, freedom.count, 2 * corners),
        np.where(counted[:, None], poses * root[:, None], 0.0).reshape(views, 6, -1),
        prior,
        gradient,
    )
