"""Read and write files: clicks, pairs, cameras, calibrations, and the formats of other tools."""

from calib_core.interchange.adopting import Adoption, adopt, adopted_calibration, adoption
from calib_core.interchange.calibration_file import (
    AssumptionNote,
    CalibrationFile,
    FrameNames,
    Provenance,
    choose_check_point,
)
from calib_core.interchange.cameras.files import CameraFile, camera_info_text, read_camera, read_camera_file
from calib_core.interchange.check.comparison import Comparison, PixelDifference, compare
from calib_core.interchange.check.explanation import CheckResult
from calib_core.interchange.check.pair_residuals import CheckPairs, read_check_pairs, read_check_pairs_file
from calib_core.interchange.check.report import CheckReport, Verdict, check
from calib_core.interchange.contents import contents_text
from calib_core.interchange.exporting import Export, NotExported, export, export_all
from calib_core.interchange.format import Format, Reads
from calib_core.interchange.formats.registry import CAMERA_ONLY, FORMATS, format_named, written_formats
from calib_core.interchange.imported import ImportedCalibration, StatedCheckPoint, WrittenPose, imported
from calib_core.interchange.importing import calibration_bytes, files_beside, read_any, read_any_file
from calib_core.interchange.origin import missing_map
from calib_core.interchange.own.calibration_json import calibration_text, read_calibration, write_calibration
from calib_core.interchange.own.clicks_json import read_clicks, write_clicks
from calib_core.interchange.own.documents import CALIBRATION_SCHEMA, names_schema
from calib_core.interchange.own.pairs_json import PairsFile, read_pairs, write_pairs
from calib_core.interchange.parent_pose import parent_pose
from calib_core.interchange.syntax.content import Content

__all__ = [
    "CALIBRATION_SCHEMA",
    "CAMERA_ONLY",
    "FORMATS",
    "Adoption",
    "AssumptionNote",
    "CalibrationFile",
    "CameraFile",
    "CheckPairs",
    "CheckReport",
    "CheckResult",
    "Comparison",
    "Content",
    "Export",
    "Format",
    "FrameNames",
    "ImportedCalibration",
    "NotExported",
    "PairsFile",
    "PixelDifference",
    "Provenance",
    "Reads",
    "StatedCheckPoint",
    "Verdict",
    "WrittenPose",
    "adopt",
    "adopted_calibration",
    "adoption",
    "calibration_bytes",
    "calibration_text",
    "camera_info_text",
    "check",
    "choose_check_point",
    "compare",
    "contents_text",
    "export",
    "export_all",
    "files_beside",
    "format_named",
    "imported",
    "missing_map",
    "names_schema",
    "parent_pose",
    "read_any",
    "read_any_file",
    "read_calibration",
    "read_camera",
    "read_camera_file",
    "read_check_pairs",
    "read_check_pairs_file",
    "read_clicks",
    "read_pairs",
    "write_calibration",
    "write_clicks",
    "write_pairs",
    "written_formats",
]
