"""Files in and out: clicks, pairs, cameras, calibrations, and every format others read."""

from calib_core.interchange.calibration_file import (
    CalibrationFile,
    FrameNames,
    InputFile,
    Provenance,
    choose_check_point,
)
from calib_core.interchange.calibration_json import calibration_text, read_calibration, write_calibration
from calib_core.interchange.cameras import camera_info_text, read_camera, read_camera_file
from calib_core.interchange.clicks import read_clicks, write_clicks
from calib_core.interchange.formats import FORMATS, ExportBytes, ExportText, Format, export, format_named
from calib_core.interchange.pairs import PairsFile, read_pairs, write_pairs

__all__ = [
    "FORMATS",
    "CalibrationFile",
    "ExportBytes",
    "ExportText",
    "Format",
    "FrameNames",
    "InputFile",
    "PairsFile",
    "Provenance",
    "calibration_text",
    "camera_info_text",
    "choose_check_point",
    "export",
    "format_named",
    "read_calibration",
    "read_camera",
    "read_camera_file",
    "read_clicks",
    "read_pairs",
    "write_calibration",
    "write_clicks",
    "write_pairs",
]
