"""Calibrations to report."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from calib_core.camera import Camera
from calib_core.evaluation.figures import BoxFigures, ClassFigure, Evaluation, FrameFigure, Sensitivity, Share
from calib_core.interchange.format import imported
from calib_core.interchange.own.calibration_json import read_calibration
from calib_core.measurements import TimeNs, Unpaired
from calib_core.results import Calibration, DataWarning, InputFile
from cocalib.report.making import subject_of
from cocalib.report.subject import Image, RecordingEvidence, ReportSubject, Watched

_UPRIGHT_PX = (480, 800)
FILE = InputFile("radar.bag", 12, "5e" * 32)


def golden(project_root: Path) -> Calibration:
    """Return the calibration of the golden file: five pairs, a warning, a click without a pair."""
    path = project_root / "tests" / "golden" / "calibration-1.json"
    return read_calibration(path.read_text(encoding="utf-8"), path.name).calibration


def subject_for(project_root: Path, calibration: Calibration | None = None) -> ReportSubject:
    """Return what is reported of the golden file, with another calibration in it if one is given."""
    path = project_root / "tests" / "golden" / "calibration-1.json"
    file = read_calibration(path.read_text(encoding="utf-8"), path.name)
    file = file if calibration is None else replace(file, calibration=calibration)
    return subject_of(imported(file), file.calibration, path.name)


def watched_recording(**changes: object) -> Watched:
    """Return a recording with a frame to draw over."""
    image = Image(b"\xff\xd8 an image", "the frame at 1.000000000 s")
    return replace(Watched("radar.bag", (FILE,), (("radar", "/radar"),), (), image), **changes)


def box_figures() -> BoxFigures:
    """Return figures of nine frames with four returns each."""
    frames = tuple(FrameFigure(TimeNs(k), TimeNs(k), 4, (4, 0, 3)[k % 3], 1, 5.0) for k in range(9))
    return BoxFigures(
        acc=0.58,
        acc_standard_error=0.1,
        acc_without_zero_frames=0.87,
        frames=frames,
        classes=(ClassFigure("person", 0.6, 9, 36, 21), ClassFigure("", None, 0, 0, 0)),
        ranges=(Share(0.0, 5.0, 30, 10), Share(5.0, 10.0, 40, 38), Share(10.0, 15.0, 1, 0)),
        sensitivity=(
            Sensitivity("roll", (-1.0, 0.0, 1.0), (0.58, 0.58, 0.579)),
            Sensitivity("pitch", (-1.0, 0.0, 1.0), (0.5, 0.58, 0.6)),
            Sensitivity("yaw", (-1.0, 0.0, 1.0), (0.3, 0.58, 0.2)),
        ),
        chance=0.02,
        rule="each return counts once",
        source="boxes.json",
    )


def fullest_subject(project_root: Path) -> ReportSubject:
    """Return as much as a report can be about: many pairs, warnings, files, boxes, an upright image."""
    calibration, rng = golden(project_root), np.random.default_rng(2)
    width_px, height_px = _UPRIGHT_PX
    camera = Camera("pinhole", width_px, height_px, np.array([[500.0, 0, 240], [0, 500, 400], [0, 0, 1]]))
    places = rng.uniform((0, 0), _UPRIGHT_PX, (80, 2))
    pairs = tuple(
        replace(calibration.pairs[0], id=f"c{k}", pixel_px=place, projected_px=place + rng.normal(0, 4, 2))
        for k, place in enumerate(places)
    )
    long = (
        "the residuals of the pairs at the left edge are twice as long as the noise of clicks and radar explains, " * 2
    )
    warnings = tuple(DataWarning.reported(f"code-{k}", long, "place the reflector elsewhere, " * 4) for k in range(20))
    unpaired = tuple(Unpaired.reported(f"u{k}", "no-scan", long, "record longer") for k in range(20))
    full = replace(calibration, camera=camera, pairs=pairs, warnings=warnings, unpaired=unpaired)
    subject = subject_for(project_root, full)
    files = tuple(InputFile(f"part_{k}.bag", 10**9 + k, f"{k:064x}") for k in range(40))
    jpeg = cv2.imencode(".jpg", np.full((height_px, width_px, 3), 200, np.uint8))[1].tobytes()
    image = Image(jpeg, "the frame at 1.000000000 s", ((9.0, 9.0), (99.0, 40.0)))
    seen = watched_recording(inputs=files, warnings=warnings, image=image)
    judged = RecordingEvidence(Evaluation(None, replace(box_figures(), rule=long)))
    return replace(subject, recording=seen, judged=judged, inputs=(FILE,))
