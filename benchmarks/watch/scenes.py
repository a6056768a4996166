"""Turns of a camera between recorded scenes: the still image as a witness against an independent registration.

The independent one is OpenCV's ECC, which fits a shift and a turn of the whole image to its gray levels; corners play no part.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np

from calib_core.camera import Camera
from calib_core.watching.still_image import BACKGROUND_FRAMES, background, camera_turn

__all__ = ["report"]


def report(folders: Sequence[Path], focal_px: float) -> Iterator[str]:
    """Yield the turn from the first scene to each other one by both, and how far they are apart.

    Args:
        folders: of images, one for each scene, in order of time.
        focal_px: of the lens at the size of the images.
    """
    scenes = [_images(folder) for folder in folders]
    height, width = scenes[0][0].shape[:2]
    matrix = np.array([[focal_px, 0.0, (width - 1) / 2.0], [0.0, focal_px, (height - 1) / 2.0], [0.0, 0.0, 1.0]])
    camera = Camera("pinhole", width, height, matrix)
    first, *others = [background(images) for images in scenes]
    assert first is not None
    apart = []
    for folder, other in zip(folders[1:], others, strict=True):
        turn = None if other is None else camera_turn(first, other, camera)
        if turn is None or other is None:
            yield f"{folder.name}: too little registers"
            continue
        own, others_deg = np.rad2deg(turn.rotation_rad), _by_ecc(first, other, focal_px * first.shape[1] / width)
        apart.append(np.abs(own - others_deg))
        both = zip(("pitch", "yaw", "roll"), own, others_deg, strict=True)
        cells = ", ".join(f"{name} {one:+.3f} ({two:+.3f})" for name, one, two in both)
        yield f"{folder.name}: {cells} deg"
    if apart:
        pitch, yaw, roll = np.max(apart, axis=0)
        yield f"largest difference from ECC, in brackets: pitch {pitch:.3f}, yaw {yaw:.3f}, roll {roll:.3f} deg"


def _images(folder: Path) -> list[np.ndarray]:
    files = sorted(folder.glob("*.jpg"))
    chosen = np.unique(np.linspace(0, len(files) - 1, BACKGROUND_FRAMES).round().astype(int))
    return [np.asarray(cv2.imread(str(files[index]))) for index in chosen]


def _by_ecc(before: np.ndarray, after: np.ndarray, focal_px: float) -> np.ndarray:
    """Return pitch, yaw and roll [deg] of what the camera sees, by gray levels alone."""
    warp = np.eye(2, 3, dtype=np.float32)
    blurred = [cv2.GaussianBlur(image, (5, 5), 0) for image in (before, after)]
    mask = np.zeros(before.shape, dtype=np.uint8)
    mask[before.shape[0] // 6 : -(before.shape[0] // 6)] = 255  # without a date at the top, and the rig at the bottom
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 300, 1e-7)
    warp = np.asarray(cv2.findTransformECC(*blurred, warp, cv2.MOTION_EUCLIDEAN, criteria, mask, 5)[1])
    middle = (np.array([before.shape[1], before.shape[0]]) - 1.0) / 2.0
    shift = warp[:, :2] @ middle + warp[:, 2] - middle
    return np.rad2deg([-shift[1] / focal_px, shift[0] / focal_px, np.arctan2(warp[1, 0], warp[0, 0])])
