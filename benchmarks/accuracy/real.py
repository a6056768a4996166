"""Real pairs measured by others, with the poses they published."""

import json
import os
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.accuracy.figures import MET, MISSED
from benchmarks.accuracy.rows import Claim, Figures, Kept, Part, Row, Section
from calib_core.association.clustering import candidate_at
from calib_core.calibration import calibrate_pairs
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform
from calib_core.measurements import Pair
from calib_core.options import CalibrationOptions, NoiseOptions
from calib_core.results import Calibration

__all__ = ["ROWS", "measure_real", "real_pairs_folder", "section"]

_BOARDS, _CLICKS = "acfr_lidar_chessboard_40", "heethesh_lidar_clicks_16"
_SIZES = {_BOARDS: (1920, 1208), _CLICKS: (964, 724)}
_OUTLIER_PX = 53.0


@dataclass(frozen=True, slots=True)
class _AssumedNoise:
    """Noise options with a name for the table."""

    name: str
    noise: NoiseOptions


_NOISES = {
    _BOARDS: (
        _AssumedNoise("defaults", NoiseOptions()),
        _AssumedNoise("of a lidar", NoiseOptions(1.0, 0.015, 0.3, 0.3)),
    ),
    _CLICKS: (
        _AssumedNoise("defaults", NoiseOptions()),
        _AssumedNoise("of hasty clicks, fixed", NoiseOptions(6.0, 0.03, 1.15, 1.15, estimate_scale=False)),
    ),
}


def real_pairs_folder() -> Path | None:
    """Return the folder of real pairs next to the checkout; None if there is none."""
    next_to_checkout = Path(__file__).resolve().parents[3] / "shared" / "data"
    folder = Path(os.environ.get("COCALIB_SHARED_DATA", next_to_checkout)) / "real_pairs"
    return folder if folder.is_dir() else None


def measure_real(name: str, assumed: _AssumedNoise, trial: int) -> Figures:
    """Solve the pairs and compare with the published pose."""
    folder = real_pairs_folder()
    if folder is None:
        return {}
    document = json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))
    camera = Camera("plumb_bob", *_SIZES[name], np.array(document["camera"]["K"]), np.array(document["camera"]["D"]))
    u, _, vt = np.linalg.svd(np.array(document["published_T_camera_from_sensor"]["R"]))
    published = RigidTransform(u @ vt, np.array(document["published_T_camera_from_sensor"]["t"]))
    pairs = [
        Pair(row["id"], np.array(row["uv"]), (candidate_at(np.array(row["xyz"]), assumed.noise),))
        for row in document["pairs"]
    ]
    outcome = calibrate_pairs(pairs, camera, CalibrationOptions(noise=assumed.noise))
    if not isinstance(outcome, Calibration):
        return {"rotation_rad": None}
    error = published.error_from(outcome.camera_from_radar)
    outliers = [pair.distance_px for pair in outcome.pairs if not pair.inlier]
    return {
        "rotation_rad": float(np.linalg.norm(error[3:])),
        "position_m": float(np.linalg.norm(outcome.camera_from_radar.translation_m - published.translation_m)),
        "squared": float(error @ np.linalg.solve(outcome.covariance, error)),
        "quantile": outcome.covariance_quantile,
        "sigma_rad": float(np.sqrt(np.trace(outcome.covariance[3:, 3:]))),
        "sigma_m": float(np.sqrt(np.trace(outcome.covariance[:3, :3]))),
        "outliers": float(len(outliers)),
        "outlier_px": max(outliers, default=None),
        "pairs": float(len(pairs)),
    }


def _key(name: str, assumed: _AssumedNoise) -> str:
    return f"real-{name}-{assumed.name.replace(', ', '-').replace(' ', '-')}"


ROWS = tuple(
    Row(_key(name, assumed), 1, partial(measure_real, name, assumed))
    for name, several in _NOISES.items()
    for assumed in several
)


def section(kept: Kept) -> Section:
    """Write the table."""
    cells, claims = [], []
    for name, several in _NOISES.items():
        for assumed in several:
            figures = next(iter(kept.get(_key(name, assumed), ())), {})
            if figures.get("rotation_rad") is None:
                continue
            cells.append(_cells(name, assumed, figures))
            if assumed is several[0]:
                claims.append(_board_claim(figures) if name == _BOARDS else _clicks_claim(figures))
    head = (
        "pairs",
        "noise given",
        "from the published pose",
        "stated sigma",
        "distance in the ellipsoid",
        "set aside",
        "",
    )
    return Section("Real pairs", _TEXT, (Part("", head, tuple(cells)),), tuple(claims))


_TEXT = """Lidar instead of radar, with the poses published by the data's authors: 40 board centres (one of them 53 px off),
and 16 hastily clicked points. The distance is that of the published pose in the stated covariance, divided by the 95 %
ellipsoid's radius: up to 1 it lies inside. The claims are for the default noise options. The published pose of the 16
clicks is not ground truth: to within 0.0004 deg it is OpenCV's RANSAC fit to nine of these same clicks
(`tests/real/test_pairs.py`), so the distance measures the difference between two fits."""


def _reach(figures: Figures) -> float:
    return float(np.sqrt(float(figures["squared"] or 0.0) / float(figures["quantile"] or 1.0)))


def _cells(name: str, assumed: _AssumedNoise, figures: Figures) -> tuple[str, ...]:
    value = {key: np.nan if one is None else one for key, one in figures.items()}
    verdict = MET if (_near(value) if name == _BOARDS else _reach(figures) <= 1.0) else MISSED
    outliers = f"{value['outliers']:.0f}" + (f", at most {value['outlier_px']:.0f} px off" if value["outliers"] else "")
    return (
        f"{value['pairs']:.0f} {'board centres' if name == _BOARDS else 'clicks'}",
        assumed.name,
        f"{np.rad2deg(value['rotation_rad']):.2f} deg, {100 * value['position_m']:.1f} cm",
        f"{np.rad2deg(value['sigma_rad']):.2f} deg, {100 * value['sigma_m']:.1f} cm",
        f"{_reach(figures):.2f}",
        outliers,
        verdict,
    )


def _near(value: dict[str, float]) -> bool:
    near = np.rad2deg(value["rotation_rad"]) <= 0.5 and value["position_m"] <= 0.07
    return bool(near and value["outliers"] == 1.0 and abs(value["outlier_px"] - _OUTLIER_PX) < 5.0)


def _board_claim(figures: Figures) -> Claim:
    value = {key: np.nan if one is None else one for key, one in figures.items()}
    measured = f"{np.rad2deg(value['rotation_rad']):.2f} deg, {100 * value['position_m']:.1f} cm, {value['outliers']:.0f} named"
    aim = "40 real board centres: within 0.5 deg and 7 cm of the published pose, the pair that is 53 px off named"
    return Claim(aim, measured, MET if _near(value) else MISSED)


def _clicks_claim(figures: Figures) -> Claim:
    measured = f"at {_reach(figures):.2f} times the ellipsoid's radius"
    aim = "16 hasty real clicks: the stated uncertainty covers the published pose"
    return Claim(aim, measured, MET if _reach(figures) <= 1.0 else MISSED)
