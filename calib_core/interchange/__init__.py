"""Read and write files: clicks, pairs, cameras, calibrations, and the formats of other tools."""

from calib_core.interchange.calibration_file import (
    AssumptionNote,
    CalibrationFile,
    FrameNames,
    Provenance,
    VehicleNote,
    choose_check_point,
)
from calib_core.interchange.cameras.files import (
    CAMERA_FORMATS,
    CameraFile,
    camera_content,
    read_camera,
    read_camera_file,
)
from calib_core.interchange.cameras.ros import camera_info_text
from calib_core.interchange.check.agreement import AgreementLimits, Comparison, Criterion, Judgement, compare
from calib_core.interchange.check.pair_residuals import CheckPairs, read_check_pairs, read_check_pairs_file
from calib_core.interchange.check.pixel_differences import PixelDifference
from calib_core.interchange.check.report import (
    CheckedFile,
    CheckReport,
    Verdict,
    check,
    check_json,
    check_junit,
    exit_code,
)
from calib_core.interchange.check.slips import CheckResult
from calib_core.interchange.exporting import (
    Export,
    NotExported,
    attached_export,
    contents_text,
    export,
    export_all,
    parent_pose,
)
from calib_core.interchange.format import Format, ImportedCalibration, Reads, StatedCheckPoint, WrittenPose, imported
from calib_core.interchange.formats.registry import CAMERA_ONLY, FORMATS, format_named, written_formats
from calib_core.interchange.formats.statement import missing_map
from calib_core.interchange.importing import (
    Adoption,
    adopt,
    adopted_calibration,
    adoption,
    calibration_bytes,
    files_beside,
    read_any,
    read_any_file,
    read_any_files,
    read_together,
    tree_files,
)
from calib_core.interchange.own.calibration_json import (
    calibration_sha256,
    calibration_text,
    consistent_file,
    read_calibration,
    write_calibration,
)
from calib_core.interchange.own.clicks_json import read_clicks, write_clicks
from calib_core.interchange.own.documents import CALIBRATION_SCHEMA, names_schema
from calib_core.interchange.own.pairs_files import PairsFile, read_pairs, read_pairs_table, write_pairs
from calib_core.interchange.own.raw_data import for_raw
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.trees.frame_choice import WantedFrames
from calib_core.interchange.trees.frame_tree import FrameTree, Joint, Place
from calib_core.interchange.trees.patching import Patch, patched
from calib_core.interchange.trees.posed_in_tree import calibration_in_tree
from calib_core.interchange.trees.reading import TreeFile, joined_tree

__all__ = [
    "CALIBRATION_SCHEMA",
    "CAMERA_FORMATS",
    "CAMERA_ONLY",
    "FORMATS",
    "Adoption",
    "AgreementLimits",
    "AssumptionNote",
    "CalibrationFile",
    "CameraFile",
    "CheckPairs",
    "CheckReport",
    "CheckResult",
    "CheckedFile",
    "Comparison",
    "Content",
    "Criterion",
    "Export",
    "Format",
    "FrameNames",
    "FrameTree",
    "ImportedCalibration",
    "Joint",
    "Judgement",
    "NotExported",
    "PairsFile",
    "Patch",
    "PixelDifference",
    "Place",
    "Provenance",
    "Reads",
    "StatedCheckPoint",
    "TreeFile",
    "VehicleNote",
    "Verdict",
    "WantedFrames",
    "WrittenPose",
    "adopt",
    "adopted_calibration",
    "adoption",
    "attached_export",
    "calibration_bytes",
    "calibration_in_tree",
    "calibration_sha256",
    "calibration_text",
    "camera_content",
    "camera_info_text",
    "check",
    "check_json",
    "check_junit",
    "choose_check_point",
    "compare",
    "consistent_file",
    "contents_text",
    "exit_code",
    "export",
    "export_all",
    "files_beside",
    "for_raw",
    "format_named",
    "imported",
    "joined_tree",
    "missing_map",
    "names_schema",
    "parent_pose",
    "patched",
    "read_any",
    "read_any_file",
    "read_any_files",
    "read_calibration",
    "read_camera",
    "read_camera_file",
    "read_check_pairs",
    "read_check_pairs_file",
    "read_clicks",
    "read_pairs",
    "read_pairs_table",
    "read_together",
    "tree_files",
    "write_calibration",
    "write_clicks",
    "write_pairs",
    "written_formats",
]
