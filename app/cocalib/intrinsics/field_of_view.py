"""How wide a camera sees."""

import numpy as np

from calib_core.camera import Camera


def field_of_view_deg(camera: Camera) -> tuple[float, float]:
    """Return the field of view along the row and the column of the principal point [deg]; NaN if the lens ends before."""
    centre_u, centre_v = camera.matrix_px[0, 2], camera.matrix_px[1, 2]
    right, bottom = camera.width_px - 0.5, camera.height_px - 0.5
    edges = np.array([[-0.5, centre_v], [right, centre_v], [centre_u, -0.5], [centre_u, bottom]])
    with np.errstate(all="ignore"):
        rays = camera.rays(edges)
        from_axis = np.degrees(np.arctan2(np.hypot(rays[:, 0], rays[:, 1]), rays[:, 2]))
    return float(from_axis[:2].sum()), float(from_axis[2:].sum())


def field_of_view_text(camera: Camera) -> str:
    """Say how wide a camera sees."""
    across, down = field_of_view_deg(camera)
    if not np.isfinite([across, down]).all():
        return "not known: the distortion folds back before the edges of the image"
    return f"{across:.1f}° × {down:.1f}°"
