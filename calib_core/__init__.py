"""Radar-camera calibration: clicks and radar returns go in, camera_from_radar comes out.

    import calib_core as cc

    pairs = cc.pairs_from_arrays(points_radar_m, pixels_px)
    calibration = cc.calibrate_pairs(pairs, cc.read_camera("camera_info.yaml")).unwrap()
    print(calibration)

Every name in `__all__` is public: see "What is public" in CONTRIBUTING.md. Names are imported on first
use, so `import calib_core` is cheap.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from calib_core.association.array_pairs import pairs_from_arrays
    from calib_core.association.placements import Placement, find_placements
    from calib_core.calibration import calibrate, calibrate_pairs, solve_again
    from calib_core.camera import Camera
    from calib_core.errors import CalibrationError, InputError, OptionError, RecordingError, UnsolvableError
    from calib_core.geometry import RigidTransform
    from calib_core.interchange.calibration_file import CalibrationFile, FrameNames, Provenance, VehicleNote
    from calib_core.interchange.check.agreement import AgreementLimits
    from calib_core.interchange.check.report import CheckReport
    from calib_core.interchange.exporting import Export
    from calib_core.interchange.files import (
        check,
        export,
        read_calibration,
        read_camera,
        read_clicks,
        read_pairs,
        write_calibration,
        write_clicks,
        write_pairs,
    )
    from calib_core.interchange.own.pairs_files import PairsFile
    from calib_core.lens_models.lens_model import LensModel
    from calib_core.measurements import Candidate, Pair, RadarScan, RadarScans, ReflectorClick, Unpaired, Unsolvable
    from calib_core.options import (
        CalibrationOptions,
        CameraPositionPrior,
        GatingOptions,
        LensOptions,
        LocatingOptions,
        NoiseOptions,
        PaperOptions,
        RadarOptions,
        ReflectorOptions,
        SolvingOptions,
    )
    from calib_core.radar import AngleMap, RadarErrors
    from calib_core.recordings import Recording, RecordingOptions, open_recording
    from calib_core.results import Calibration, DataWarning, Metrics, NextPlacement, PairResult
    from calib_core.results.metrics import acc, aed, cdsd
    from calib_core.results.systematic_errors import SystematicErrorResult
    from calib_core.results.verdict import Verdict, verdict_on

__all__ = [
    "AgreementLimits",
    "AngleMap",
    "Calibration",
    "CalibrationError",
    "CalibrationFile",
    "CalibrationOptions",
    "Camera",
    "CameraPositionPrior",
    "Candidate",
    "CheckReport",
    "DataWarning",
    "Export",
    "FrameNames",
    "GatingOptions",
    "InputError",
    "LensModel",
    "LensOptions",
    "LocatingOptions",
    "Metrics",
    "NextPlacement",
    "NoiseOptions",
    "OptionError",
    "Pair",
    "PairResult",
    "PairsFile",
    "PaperOptions",
    "Placement",
    "Provenance",
    "RadarErrors",
    "RadarOptions",
    "RadarScan",
    "RadarScans",
    "Recording",
    "RecordingError",
    "RecordingOptions",
    "ReflectorClick",
    "ReflectorOptions",
    "RigidTransform",
    "SolvingOptions",
    "SystematicErrorResult",
    "Unpaired",
    "Unsolvable",
    "UnsolvableError",
    "VehicleNote",
    "Verdict",
    "acc",
    "aed",
    "calibrate",
    "calibrate_pairs",
    "cdsd",
    "check",
    "export",
    "find_placements",
    "open_recording",
    "pairs_from_arrays",
    "read_calibration",
    "read_camera",
    "read_clicks",
    "read_pairs",
    "solve_again",
    "verdict_on",
    "write_calibration",
    "write_clicks",
    "write_pairs",
]

_MODULES = {
    "association.array_pairs": ("pairs_from_arrays",),
    "association.placements": ("Placement", "find_placements"),
    "calibration": ("calibrate", "calibrate_pairs", "solve_again"),
    "camera": ("Camera",),
    "errors": ("CalibrationError", "InputError", "OptionError", "RecordingError", "UnsolvableError"),
    "geometry": ("RigidTransform",),
    "interchange.calibration_file": ("CalibrationFile", "FrameNames", "Provenance", "VehicleNote"),
    "interchange.check.agreement": ("AgreementLimits",),
    "interchange.check.report": ("CheckReport",),
    "interchange.exporting": ("Export",),
    "interchange.files": (
        *("check", "export", "read_calibration", "read_camera", "read_clicks", "read_pairs"),
        *("write_calibration", "write_clicks", "write_pairs"),
    ),
    "interchange.own.pairs_files": ("PairsFile",),
    "lens_models.lens_model": ("LensModel",),
    "measurements": ("Candidate", "Pair", "RadarScan", "RadarScans", "ReflectorClick", "Unpaired", "Unsolvable"),
    "options": (
        *("CalibrationOptions", "CameraPositionPrior", "GatingOptions", "LensOptions", "LocatingOptions"),
        *("NoiseOptions", "PaperOptions", "RadarOptions", "ReflectorOptions", "SolvingOptions"),
    ),
    "radar": ("AngleMap", "RadarErrors"),
    "recordings": ("Recording", "RecordingOptions", "open_recording"),
    "results": ("Calibration", "DataWarning", "Metrics", "NextPlacement", "PairResult"),
    "results.metrics": ("acc", "aed", "cdsd"),
    "results.systematic_errors": ("SystematicErrorResult",),
    "results.verdict": ("Verdict", "verdict_on"),
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(
            f"module 'calib_core' has no attribute {name!r}; its public names are in calib_core.__all__"
        )
    value = getattr(import_module(f"calib_core.{_MODULE_OF[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
