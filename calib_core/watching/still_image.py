"""The still image as a witness: how far a camera that stands still has turned in the world between two backgrounds.

A background is the median of frames, in grey and at most 480 pixels across, so that what moves leaves no trace. Corners of the
first are followed into the second after local brightness and contrast are taken out of both. Each is a ray of the lens, a
homography of most of them says which ones moved alike, and these give a rotation. Its covariance is that of the means of tiles
of the image: corners of one tile share what light and shadow do to them.
"""

from collections.abc import Sequence

import numpy as np

from calib_core.arrays import Matrix33, Vector3
from calib_core.boxes.moving import background_of, reduced
from calib_core.camera import Camera
from calib_core.geometry import rotation_exp, rotation_log
from calib_core.watching.witnesses import Turn

BACKGROUND_FRAMES = 25
LEAST_SHARE = 0.3
"""Of the tiles with corners: where fewer moved alike, nothing is said."""

_FEWEST_FRAMES = 5
_LOCAL_PX = 31
_LEAST_CONTRAST = 4.0  # grey levels: below it, what is local contrast is noise
_CORNERS, _CORNER_QUALITY, _CORNERS_APART_PX = 600, 0.02, 6.0
_WINDOW_PX, _LEVELS = (21, 21), 4
_BACK_PX = 0.5  # how far a corner that is followed there and back may be from where it began
_ALIKE_PX = 1.0
_TILE_PX = 60.0
_FEWEST_TILES = 6
_ROUNDS = 4
_FLOOR_RAD = np.deg2rad(0.005)
_CONVERGED_RAD = 0.01 * _FLOOR_RAD
_AHEAD = 0.1  # least z of a ray of unit length that a homography can hold


def background(images: Sequence[np.ndarray]) -> np.ndarray | None:
    """Return what most of the frames show: uint8 (h, w) grey; None if there are fewer than five.

    Args:
        images: uint8 (h, w, 3), blue first.
    """
    if len(images) < _FEWEST_FRAMES:
        return None
    median = background_of([reduced(image) for image in images]).median
    return reduced_grey(np.clip(median, 0.0, 255.0).astype(np.uint8))


def reduced_grey(image: np.ndarray) -> np.ndarray:
    """Return an image (h, w, 3) as uint8 grey of at most 480 pixels across."""
    import cv2

    return np.asarray(cv2.cvtColor(reduced(image), cv2.COLOR_BGR2GRAY))


def camera_turn(before: np.ndarray, after: np.ndarray, camera: Camera) -> Turn | None:
    """Return how a camera turned between two backgrounds of one size; None if too little of the image registers.

    Args:
        before: uint8 (h, w).
        after: uint8 (h, w).
        camera: the lens, at the size of the recorded images.
    """
    import cv2

    if before.shape != after.shape:
        return None
    found = _followed(_even(before), _even(after))
    if found is None:
        return None
    scale = np.array([camera.width_px / before.shape[1], camera.height_px / before.shape[0]])
    start, end = (camera.rays((pixels + 0.5) * scale - 0.5) for pixels in found)
    ahead = (start[:, 2] > _AHEAD) & (end[:, 2] > _AHEAD)  # a ray that the lens does not have is NaN
    pixels, start, end = found[0][ahead], start[ahead], end[ahead]
    tiles = np.floor(pixels / _TILE_PX) @ np.array([1.0, 1000.0])
    if len(np.unique(tiles)) < _FEWEST_TILES:
        return None
    alike_rad = _ALIKE_PX / _pixels_per_rad(camera, before.shape[1])
    plane = start[:, :2] / start[:, 2:], end[:, :2] / end[:, 2:]
    cv2.setRNGSeed(1)  # the same images give the same answer
    mask = cv2.findHomography(*plane, cv2.RANSAC, alike_rad)[1]
    if mask is None:
        return None
    alike, rotation = mask.ravel() > 0, np.zeros(3)
    for _ in range(_ROUNDS):  # a homography bends more than a rotation does, so that decides in the end
        if len(np.unique(tiles[alike])) < _FEWEST_TILES:
            return None
        own = np.unique(tiles[alike], return_inverse=True)[1]
        rotation, covariance = _rotation(rotation, start[alike], end[alike], own)
        alike = np.linalg.norm(end - start @ rotation_exp(rotation).T, axis=1) < alike_rad
    share = len(np.unique(tiles[alike])) / len(np.unique(tiles))
    return Turn(rotation, covariance) if share >= LEAST_SHARE else None


def _pixels_per_rad(camera: Camera, width_px: int) -> float:
    middle = np.array([[camera.width_px, camera.height_px]]) / 2.0
    rays = camera.rays(middle + np.array([[0.0, 0.0], [1.0, 0.0]]))
    return width_px / camera.width_px / max(float(np.arccos(np.clip(rays[0] @ rays[1], -1.0, 1.0))), 1e-9)


def _even(grey: np.ndarray) -> np.ndarray:
    """Take local brightness and contrast out of an image: uint8 (h, w)."""
    import cv2

    values = cv2.GaussianBlur(grey, (0, 0), 1.0).astype(np.float32)
    mean = cv2.blur(values, (_LOCAL_PX, _LOCAL_PX))
    spread = np.sqrt(np.maximum(cv2.blur(values**2, (_LOCAL_PX, _LOCAL_PX)) - mean**2, 0.0))
    return np.clip(128.0 + 50.0 * (values - mean) / (spread + _LEAST_CONTRAST), 0.0, 255.0).astype(np.uint8)


def _followed(before: np.ndarray, after: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the pixels (n, 2) of corners in both images."""
    import cv2

    corners = cv2.goodFeaturesToTrack(before, _CORNERS, _CORNER_QUALITY, _CORNERS_APART_PX)
    if corners is None:
        return None
    there, seen, _ = cv2.calcOpticalFlowPyrLK(
        before, after, corners, corners.copy(), winSize=_WINDOW_PX, maxLevel=_LEVELS
    )
    back, again, _ = cv2.calcOpticalFlowPyrLK(after, before, there, there.copy(), winSize=_WINDOW_PX, maxLevel=_LEVELS)
    kept = (seen.ravel() > 0) & (again.ravel() > 0) & (np.linalg.norm(back - corners, axis=2).ravel() < _BACK_PX)
    return corners.reshape(-1, 2)[kept].astype(np.float64), there.reshape(-1, 2)[kept].astype(np.float64)


def _rotation(rotation: Vector3, start: np.ndarray, end: np.ndarray, tiles: np.ndarray) -> tuple[Vector3, Matrix33]:
    """Fit a rotation to unit rays (n, 3), from a first one, with Tukey's weights; its covariance comes from the tiles."""
    for _ in range(10):
        turned = start @ rotation_exp(rotation).T
        residuals = end - turned
        size = np.linalg.norm(residuals, axis=1)
        reach = max(4.685 * 1.4826 * float(np.median(size)), 1e-6)
        weights = np.maximum(1.0 - (size / reach) ** 2, 0.0) ** 2
        per_tile = np.bincount(tiles, weights)[tiles]
        weights = weights / np.sqrt(np.maximum(per_tile, 1e-9))  # a tile full of corners counts less than each of them
        jacobian = -_skews(turned)
        normal = np.einsum("n,nki,nkj->ij", weights, jacobian, jacobian)
        step = np.linalg.solve(normal, np.einsum("n,nki,nk->i", weights, jacobian, residuals))
        rotation = rotation_log(rotation_exp(step) @ rotation_exp(rotation))
        if float(np.abs(step).max()) < _CONVERGED_RAD:
            break
    gradients = np.einsum("n,nki,nk->ni", weights, jacobian, residuals)
    count = int(tiles.max()) + 1
    of_tile = np.stack([np.bincount(tiles, axis, minlength=count) for axis in gradients.T], axis=1)
    inverse = np.linalg.inv(normal)
    covariance = inverse @ (of_tile.T @ of_tile) @ inverse * count / max(count - 3, 1)
    return rotation, covariance + _FLOOR_RAD**2 * np.eye(3)


def _skews(vectors: np.ndarray) -> np.ndarray:
    """Return the matrices (n, 3, 3) of the cross products with vectors."""
    x, y, z = vectors.T
    none = np.zeros(len(vectors))
    return np.stack([np.stack(row, axis=1) for row in ((none, -z, y), (z, none, -x), (-y, x, none))], axis=1)
