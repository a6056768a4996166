"""Frames as a camera without distortion would have taken them, for judging the lens by straight lines."""

import threading

import numpy as np

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.rectification import rectification_maps, rectified_camera


class FrameRectifier:
    """Rectifies pictures; the maps of one camera are kept. Every method may be called from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._camera: Camera | None = None
        self._maps: tuple[np.ndarray, np.ndarray] | None = None

    def rectified(self, pixels: np.ndarray, camera: Camera | None) -> np.ndarray:
        """Return a picture (h, w, 3) rectified with the intrinsics of its camera; the same size.

        Raises:
            InputError: there are no intrinsics, they are for pictures of another size, or the lens cannot be rectified.
        """
        import cv2

        if camera is None:
            raise InputError("there are no intrinsics to rectify it with; calibrate the lens in the tab Lens")
        if pixels.shape[:2] != (camera.height_px, camera.width_px):
            raise InputError(
                f"the intrinsics are for {camera.width_px} x {camera.height_px} px, and the picture has "
                f"{pixels.shape[1]} x {pixels.shape[0]}"
            )
        columns, rows = self._maps_of(camera)
        return np.asarray(cv2.remap(pixels, columns, rows, cv2.INTER_LINEAR))

    def _maps_of(self, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
        import cv2

        with self._lock:
            if self._maps is None or self._camera is not camera:
                maps = rectification_maps(camera, rectified_camera(camera))
                self._maps = cv2.convertMaps(maps.x_px, maps.y_px, cv2.CV_16SC2)
                self._camera = camera
            return self._maps
