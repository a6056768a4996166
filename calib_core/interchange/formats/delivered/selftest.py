# SPDX-License-Identifier: Apache-2.0
"""Project ten radar points with the files of this pack and compare with the pixels in selftest.csv.

    python3 selftest.py [FOLDER OF THE PACK]

The pose is read from calibration.json, the lens from camera_info.yaml and the radar's errors from radar_correction.csv, so that
the files a robot uses are what is tested. Prints PASS and returns 0 if every pixel agrees to a thousandth of a pixel; otherwise
prints FAIL and returns 1. Python 3.8 or later, no other package, no network.
"""

from __future__ import annotations

import csv
import importlib.util
import json
import math
import re
import sys
from pathlib import Path
from typing import Any, List, Sequence, Tuple  # noqa: UP035 - Python 3.8 needs them

TOLERANCE_PX = 1e-3


def _camera(path: Path) -> Tuple[str, List[float], List[float]]:  # noqa: UP006
    """Read camera_info.yaml as it is in the pack: the lens model, K row by row [px] and the coefficients.

    The models are plumb_bob (k1 k2 p1 p2 k3), rational_polynomial (the same, k4 k5 k6) and equidistant (k1 k2 k3 k4).

    Raises:
        ValueError: a value is missing, or the lens model is unknown.
    """
    text = path.read_text(encoding="utf-8")
    named = re.search(r"^distortion_model:\s*\"?(\w+)", text, re.MULTILINE)
    model = named.group(1) if named else ""
    if model not in ("plumb_bob", "rational_polynomial", "equidistant"):
        raise ValueError(f"{path.name}: cannot project through the lens model {model!r}")
    return model, _listed(text, "camera_matrix", path), _listed(text, "distortion_coefficients", path)


def _pixel(
    point_m: Sequence[float], model: str, k: Sequence[float], distortion: Sequence[float]
) -> Tuple[float, float]:  # noqa: UP006
    """Return the pixel (u, v) of a point in the camera frame (x right, y down, z forward [m]); NaN where there is none.

    Pixel (0, 0) is the centre of the top-left pixel.
    """
    x, y = (_equidistant if model == "equidistant" else _perspective)(point_m, distortion)
    return k[0] * x + k[1] * y + k[2], k[3] * x + k[4] * y + k[5]


def _perspective(point_m: Sequence[float], distortion: Sequence[float]) -> Tuple[float, float]:  # noqa: UP006
    if not point_m[2] > 0.0:
        return math.nan, math.nan
    x, y = point_m[0] / point_m[2], point_m[1] / point_m[2]
    k1, k2, p1, p2, k3, k4, k5, k6 = (list(distortion) + [0.0] * 8)[:8]
    r2 = x * x + y * y
    radial = (1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1.0 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    return (
        x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
        y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
    )


def _equidistant(point_m: Sequence[float], distortion: Sequence[float]) -> Tuple[float, float]:  # noqa: UP006
    x, y, z = point_m
    across = math.hypot(x, y)
    if across == 0.0:
        return (0.0, 0.0) if z > 0.0 else (math.nan, math.nan)
    k1, k2, k3, k4 = (list(distortion) + [0.0] * 4)[:4]
    angle = math.atan2(across, z)
    squared = angle * angle
    radius = angle * (1.0 + squared * (k1 + squared * (k2 + squared * (k3 + squared * k4))))
    return radius * x / across, radius * y / across


def _listed(text: str, key: str, path: Path) -> List[float]:  # noqa: UP006
    found = re.search(rf"^{key}:[^\[]*\[([^\]]*)\]", text, re.MULTILINE)
    if found is None:
        raise ValueError(f"{path.name}: {key} is missing; copy it from the pack again")
    return [float(word) for word in found.group(1).replace(",", " ").split()]


def _correction(folder: Path) -> Any:
    """Load radar_correction.py from the pack, wherever Python looks for modules, and read the radar's errors."""
    spec = importlib.util.spec_from_file_location("radar_correction", folder / "radar_correction.py")
    if spec is None or spec.loader is None:
        raise ValueError("radar_correction.py is missing; copy it from the pack again")
    module = importlib.util.module_from_spec(spec)
    sys.modules["radar_correction"] = module
    spec.loader.exec_module(module)
    return module.RadarCorrection.read(folder)


def _largest_difference_px(folder: Path) -> float:
    """Print a line for each point, and return the largest difference from selftest.csv; infinite if a pixel is missing."""
    pose = json.loads((folder / "calibration.json").read_text(encoding="utf-8"))["camera_from_radar"]
    camera, correction = _camera(folder / "camera_info.yaml"), _correction(folder)
    with (folder / "selftest.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    if not rows:
        raise ValueError("selftest.csv: no points; copy it from the pack again")
    largest_px = 0.0
    for row in rows:
        reported_m = [float(row[name]) for name in ("x_m", "y_m", "z_m")]
        pixels: List[float] = []  # noqa: UP006
        wanted: List[float] = []  # noqa: UP006
        for point_m, suffix in ((reported_m, "_raw_px"), (correction.corrected(reported_m), "_px")):
            camera_m = [
                sum(pose["rotation"][i][j] * point_m[j] for j in range(3)) + pose["translation_m"][i] for i in range(3)
            ]
            pixels += _pixel(camera_m, *camera)
            wanted += [float(row["u" + suffix]), float(row["v" + suffix])]
        off_px = max(abs(pixels[i] - wanted[i]) if math.isfinite(pixels[i]) else math.inf for i in range(4))
        off_px = off_px if math.isfinite(off_px) else math.inf
        largest_px = max(largest_px, off_px)
        x, y, z = reported_m
        print(
            f"({x:8.3f}, {y:8.3f}, {z:8.3f}) m -> pose only ({pixels[0]:9.3f}, {pixels[1]:9.3f}) px, "
            f"with corrections ({pixels[2]:9.3f}, {pixels[3]:9.3f}) px, off by {off_px:.2g} px"
        )
    return largest_px


def main(arguments: Sequence[str]) -> int:
    """Run the self-test; return the exit code."""
    sys.dont_write_bytecode = True  # the folder stays as SHA256SUMS says
    folder = Path(arguments[0]) if arguments else Path(__file__).resolve().parent
    try:
        largest_px = _largest_difference_px(folder)
    except (OSError, ValueError, KeyError, TypeError, IndexError) as error:
        print(f"FAIL: {type(error).__name__}: {error}")
        return 1
    if largest_px <= TOLERANCE_PX:
        print(f"PASS: every pixel is as calibrated (largest difference {largest_px:.2g} px)")
        return 0
    print(f"FAIL: the largest difference is {largest_px:.3g} px, allowed are {TOLERANCE_PX} px")
    return 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
