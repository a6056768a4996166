"""An evaluation as JSON with documented keys (docs/evaluation.md)."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from calib_core.evaluation.figures import BoxFigures, Evaluation, HeldOut, ResidualFigures, Spread
from calib_core.input_files import encodable
from calib_core.interchange.syntax.strict_json import json_text
from calib_core.measurements import Stamp, TimeNs
from calib_core.words.outcomes import warning_text
from calib_core.words.unpaired import unpaired_remark

EVALUATION_SCHEMA = "cocalib/evaluation-1"


def evaluation_json(evaluation: Evaluation, *, calibration: str, recording: Sequence[str], exit_code: int = 0) -> str:
    """Return an evaluation as one JSON object.

    Args:
        evaluation: the figures.
        calibration: name of the calibration's file.
        recording: names of the recording's files.
        exit_code: of the command.
    """
    head = {
        "schema": EVALUATION_SCHEMA,
        "exit_code": exit_code,
        "calibration": calibration,
        "recording": list(recording),
    }
    return json_text(encodable({**head, **evaluation_document(evaluation)}))


def evaluation_document(evaluation: Evaluation) -> dict[str, Any]:
    """Return an evaluation as dicts, lists and numbers; what is unknown is NaN or None, and becomes null."""
    residuals, boxes = evaluation.residuals, evaluation.boxes
    return {
        "residuals": None if residuals is None else _residuals(residuals),
        "boxes": None if boxes is None else _boxes(boxes),
        "warnings": [dataclasses.asdict(warning_text(warning)) for warning in evaluation.warnings],
    }


def _residuals(figures: ResidualFigures) -> dict[str, Any]:
    return {
        "aed_px": figures.metrics.aed_px,
        "cdsd_px": figures.metrics.cdsd_px,
        "rms_px": figures.metrics.rms_px,
        "median_px": figures.median_px,
        "n": figures.metrics.n,
        "placements": len(np.unique(figures.placements)),
        "inlier_share": figures.inlier_share,
        "held_out": _held_out(figures.held_out),
        "k_fold": _held_out(figures.k_fold),
        "association": figures.association,
        "by_range_m": _bins(figures.by_range),
        "by_azimuth_deg": _bins(figures.by_azimuth),
        "by_column_px": _bins(figures.by_column),
        "by_row_px": _bins(figures.by_row),
        "clicks": [
            {
                "id": name,
                "placement": int(placement),
                "point_radar_m": point.tolist(),
                "pixel_px": pixel.tolist(),
                "projected_px": projected.tolist(),
                "distance_px": float(distance),
                "inlier": bool(inlier),
            }
            for name, placement, point, pixel, projected, distance, inlier in zip(
                figures.ids,
                figures.placements,
                figures.points_radar_m,
                figures.pixels_px,
                figures.projected_px,
                figures.distances_px,
                figures.inliers,
                strict=True,
            )
        ],
        "unpaired": [
            {"id": one.id, "code": one.code, "reason": str(unpaired_remark(one).message)} for one in figures.unpaired
        ],
    }


def _held_out(figures: HeldOut | None) -> dict[str, Any] | None:
    if figures is None:
        return None
    return {"aed_px": figures.aed_px, "folds": figures.folds, "distances_px": figures.distances_px.tolist()}


def _bins(bins: Sequence[Spread]) -> list[dict[str, Any]]:
    return [
        {
            "low": spread.low,
            "high": spread.high,
            "n": spread.n,
            "mean_px": spread.mean_px,
            "median_px": spread.median_px,
        }
        for spread in bins
    ]


def _boxes(figures: BoxFigures) -> dict[str, Any]:
    return {
        "acc": figures.acc,
        "acc_standard_error": figures.acc_standard_error,
        "groups": figures.groups,
        "acc_without_zero_frames": figures.acc_without_zero_frames,
        "chance_turned_10_deg": figures.chance,
        "chance_by_area": figures.area_chance,
        "targets": figures.targets,
        "matched_targets": figures.matched_targets,
        "sensitivity": [
            {
                "axis": one.axis,
                "angles_deg": list(one.angles_deg),
                "acc": list(one.acc),
                "flat": one.is_flat,
                "best_deg": one.best_deg,
                "low_deg": one.low_deg,
                "high_deg": one.high_deg,
            }
            for one in figures.sensitivity
        ],
        "classes": [dataclasses.asdict(one) for one in figures.classes],
        "objects": [dataclasses.asdict(one) for one in figures.objects],
        "by_range_m": [
            {"low": one.low_m, "high": one.high_m, "returns": one.returns, "inside": one.inside}
            for one in figures.ranges
        ],
        "frames": [
            {
                "image_time": _time(frame.image_time),
                "radar_time": _time(frame.radar_time),
                "returns": frame.returns,
                "inside": frame.inside,
                "boxes": frame.boxes,
                "range_m": frame.range_m,
            }
            for frame in figures.frames
        ],
        "rule": figures.rule,
        "source": figures.source,
    }


def _time(time: TimeNs) -> dict[str, int]:
    stamp = Stamp.of(time)
    return {"sec": stamp.sec, "nanosec": stamp.nanosec}
