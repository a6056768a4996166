"""The radar's known errors as files of a pack: radar_correction.csv, and the angle map as csv and npz."""

import io
from dataclasses import fields

import numpy as np

from calib_core.interchange.syntax.yaml_text import number_text
from calib_core.interchange.syntax.zip_archives import pack
from calib_core.radar import AngleMap
from calib_core.results import Calibration

_MAP_CSV = "radar_angle_map.csv"
_MAP_NPZ = "radar_angle_map.npz"


def correction_files(calibration: Calibration) -> dict[str, bytes]:
    """Return the files that radar_correction.py and radar_correction.hpp read; the map's only if there is a map."""
    grid, errors = calibration.angle_map, calibration.radar_errors
    rows = [f"{one.name},{number_text(getattr(errors, one.name))}" for one in fields(errors)]
    rows.append(f"angle_map,{'none' if grid is None else _MAP_CSV}")
    files = {"radar_correction.csv": "\n".join(["name,value", *rows, ""]).encode()}
    if grid is not None:
        files |= {_MAP_CSV: _map_csv(grid).encode(), _MAP_NPZ: _map_npz(grid)}
    return files


def _tables(grid: AngleMap) -> dict[str, np.ndarray]:
    """Return the tables by their names in calibration-1: rows by elevation, columns by azimuth."""
    add, sigma = grid.correction_rad, grid.sigma_rad
    return {
        "add_azimuth_rad": add[:, :, 0],
        "add_elevation_rad": add[:, :, 1],
        "sigma_azimuth_rad": sigma[:, :, 0],
        "sigma_elevation_rad": sigma[:, :, 1],
    }


def _map_csv(grid: AngleMap) -> str:
    """Write one line for each direction of the grid, row by row."""
    tables = _tables(grid)
    lines = [",".join(["elevation_rad", "azimuth_rad", *tables])]
    for i, elevation_rad in enumerate(grid.elevation_rad):
        for j, azimuth_rad in enumerate(grid.azimuth_rad):
            numbers = (elevation_rad, azimuth_rad, *(table[i, j] for table in tables.values()))
            lines.append(",".join(map(number_text, numbers)))
    return "\n".join([*lines, ""])


def _map_npz(grid: AngleMap) -> bytes:
    arrays = {
        "azimuth_rad": grid.azimuth_rad,
        "elevation_rad": grid.elevation_rad,
        **_tables(grid),
        "aed_px": np.array(grid.raw_aed_px),
        "corrected_aed_px": np.array(grid.corrected_aed_px),
    }
    members = {}
    for name, array in arrays.items():
        buffer = io.BytesIO()
        np.lib.format.write_array(buffer, np.ascontiguousarray(array), allow_pickle=False)
        members[f"{name}.npy"] = buffer.getvalue()
    return pack(members)
