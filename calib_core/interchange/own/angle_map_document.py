"""The radar's angle errors in a calibration-1 file."""

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.own.documents import AngleMapDocument
from calib_core.radar import AngleMap


def angle_map_document(angle_map: AngleMap | None) -> AngleMapDocument | None:
    """Return the document of an angle map."""
    if angle_map is None:
        return None
    add, sigma = angle_map.correction_rad + 0.0, angle_map.sigma_rad
    return AngleMapDocument(
        azimuth_rad=angle_map.azimuth_rad.tolist(),
        elevation_rad=angle_map.elevation_rad.tolist(),
        add_azimuth_rad=add[:, :, 0].tolist(),
        add_elevation_rad=add[:, :, 1].tolist(),
        sigma_azimuth_rad=sigma[:, :, 0].tolist(),
        sigma_elevation_rad=sigma[:, :, 1].tolist(),
        aed_px=angle_map.raw_aed_px,
        corrected_aed_px=angle_map.corrected_aed_px,
    )


def angle_map_of(document: AngleMapDocument | None, *, source: str) -> AngleMap | None:
    """Return the angle map in a document.

    Raises:
        InputError: the tables do not fit the grid lines, or the grid lines do not ascend.
    """
    if document is None:
        return None
    try:
        return AngleMap(
            azimuth_rad=np.array(document.azimuth_rad),
            elevation_rad=np.array(document.elevation_rad),
            correction_rad=np.stack([document.add_azimuth_rad, document.add_elevation_rad], axis=-1),
            sigma_rad=np.stack([document.sigma_azimuth_rad, document.sigma_elevation_rad], axis=-1),
            raw_aed_px=np.nan if document.aed_px is None else document.aed_px,
            corrected_aed_px=np.nan if document.corrected_aed_px is None else document.corrected_aed_px,
        )
    except ValueError as error:
        raise InputError(f"{source}: radar_angle_map: {error}; correct it or remove radar_angle_map") from None
