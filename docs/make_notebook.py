"""Write docs/first-steps.ipynb: run its cells and keep what they print. `python docs/make_notebook.py` does it again.

The notebook is plain JSON, and a cell is plain Python: no Jupyter is needed to make it or to test it.
"""

import ast
import contextlib
import io
import json
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
NOTEBOOK = ROOT / "docs" / "first-steps.ipynb"

CELLS: tuple[tuple[str, str], ...] = (
    (
        "markdown",
        "# First steps with `calib_core`\n\n"
        "From two arrays to a calibration with its uncertainty, then from a recording. Everything here runs without a "
        "browser, a ROS install or a network. It was executed by `python docs/make_notebook.py`, and a test runs it again.",
    ),
    (
        "markdown",
        "## Two arrays in\n\nReflector positions as the radar measured them (x forward, y left, z up, in metres), and the "
        "pixels where the camera saw them. Here they are simulated, so the true pose is known.",
    ),
    (
        "code",
        "import numpy as np\n\nimport cocalib as cc\n\nrng = np.random.default_rng(1)\n"
        "matrix_px = np.array([[1250.0, 0.0, 959.5], [0.0, 1250.0, 539.5], [0.0, 0.0, 1.0]])\n"
        'camera = cc.Camera("plumb_bob", 1920, 1080, matrix_px, np.array([-0.1, 0.02, 0.0, 0.0]))\n'
        "optical_from_body = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])\n"
        "truth = cc.RigidTransform(optical_from_body, -optical_from_body @ [0.0, 0.0, 0.045])\n\n\n"
        "def from_polar(range_m, azimuth_rad, elevation_rad):\n"
        '    """Return positions: x forward, y left, z up."""\n'
        "    level_m = range_m * np.cos(elevation_rad)\n"
        "    x_m, y_m = level_m * np.cos(azimuth_rad), level_m * np.sin(azimuth_rad)\n"
        "    return np.stack([x_m, y_m, range_m * np.sin(elevation_rad)], axis=1)\n\n\n"
        "polar = rng.uniform([3.0, -0.5, -0.3], [15.0, 0.5, 0.2], (20, 3))\n"
        "noise = rng.normal(0.0, [0.015, 0.0096, 0.0175], (20, 3))  # m, rad, rad\n"
        "points_radar_m = from_polar(*(polar + noise).T)\n"
        "pixels_px = camera.project(truth @ from_polar(*polar.T)) + rng.normal(0.0, 2.0, (20, 2))\n"
        "print(points_radar_m.shape, pixels_px.shape)",
    ),
    (
        "code",
        "pairs = cc.pairs_from_arrays(points_radar_m, pixels_px)\n"
        "calibration = cc.calibrate_pairs(pairs, camera).unwrap()\nprint(calibration)",
    ),
    (
        "markdown",
        "`unwrap` returns the calibration, or raises with a reason and a hint. Without it the answer is a value: either a "
        "`Calibration` or an `Unsolvable`.",
    ),
    ("code", "print(cc.calibrate_pairs(pairs[:3], camera))"),
    (
        "markdown",
        "## How sure is it?\n\nThe covariance is of the pose error (dt, dtheta), in metres and radians. `pixel_sigma` carries "
        "it to the image: how far off a point may come out. The true pose lies within the stated uncertainty if the "
        "squared distance below is under the quantile.",
    ),
    (
        "code",
        "error = calibration.camera_from_radar.error_from(truth)\n"
        "squared = error @ np.linalg.solve(calibration.covariance, error)\n"
        'print(f"squared distance {squared:.1f}, 95 % quantile {calibration.covariance_quantile:.1f}")\n'
        "for range_m in (3.0, 10.0, 30.0):\n"
        "    u_px, v_px = calibration.pixel_sigma(np.array([[range_m, 0.0, 0.0]]))[0]\n"
        '    print(f"{range_m:4.0f} m ahead: {u_px:.1f} px across, {v_px:.1f} px down")',
    ),
    (
        "markdown",
        "## What it warns of\n\nA warning has a code for programs, a message with figures, and a hint. "
        "[Warnings and what they mean](warnings.md) lists them all.",
    ),
    (
        "code",
        "for warning in calibration.warnings:\n    print(warning)",
    ),
    (
        "markdown",
        "A tape measure helps most: where the camera sits in the radar frame, and how well that is known. This "
        "camera sits 4.5 cm above the radar.",
    ),
    (
        "code",
        'tape = cc.CameraPositionPrior.measured((0.0, 0.0, 0.045), "antenna")\n'
        "options = cc.CalibrationOptions(solving=cc.SolvingOptions(camera_position=tape))\n"
        "measured = cc.calibrate_pairs(pairs, camera, options).unwrap()\n"
        'for name, one in (("free", calibration), ("with tape", measured)):\n'
        "    sigma = np.sqrt(np.diag(one.covariance))\n"
        "    position_cm, rotation_deg = 100 * np.linalg.norm(sigma[:3]), np.rad2deg(np.linalg.norm(sigma[3:]))\n"
        '    print(f"{name:9}  {position_cm:5.1f} cm  {rotation_deg:.2f} deg")',
    ),
    (
        "markdown",
        "## From a recording\n\nThe sample recording comes with clicks. A click is paired with the radar returns around its "
        "frame; all candidates are kept until the pose selects one.",
    ),
    (
        "code",
        "with cc.sample_recording() as recording:\n"
        '    clicks = cc.read_clicks(recording.paths[0].with_name("clicks.json"))\n'
        "    print(recording.radar_topic, len(recording.radar_times), recording.image_topic, len(recording.image_times))\n"
        "    camera = recording.camera()\n"
        "    scans = recording.radar_scans()\n"
        "rooftop = cc.calibrate(clicks, scans, camera).unwrap()\nprint(rooftop)",
    ),
    (
        "markdown",
        "## Files in and out\n\n`calibration.json` keeps the candidates of every pair, so it can be solved again, "
        "with other options too. Exports carry a check point that `check` recomputes.",
    ),
    (
        "code",
        'cc.write_calibration("calibration.json", rooftop)\n'
        'again = cc.solve_again(cc.read_calibration("calibration.json").calibration).unwrap()\n'
        "print(np.array_equal(again.covariance, rooftop.covariance))\n"
        'paper = cc.solve_again(rooftop, cc.CalibrationOptions(method="paper")).unwrap()\n'
        'print(f"AED {rooftop.metrics.aed_px:.1f} px by default")\n'
        'print(f"AED {paper.metrics.aed_px:.1f} px by PnP as in the paper, on the same radar positions")',
    ),
    (
        "code",
        'from pathlib import Path\n\nexported = cc.export(rooftop, "tf2")\nprint(exported.file_name)\n'
        "Path(exported.file_name).write_bytes(exported.data)\n"
        "print(cc.check(exported.file_name, against=rooftop).verdict)",
    ),
)


def outputs(cells: Iterator[str]) -> Iterator[str]:
    """Run cells one after the other in a folder of their own, and yield what each prints."""
    names: dict[str, Any] = {}
    here = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            for source in cells:
                with contextlib.redirect_stdout(io.StringIO()) as printed:
                    exec(compile(ast.parse(source), "<cell>", "exec"), names)
                yield printed.getvalue()
        finally:
            os.chdir(here)


def notebook() -> str:
    """Run every cell and return the notebook's text."""
    printed = outputs(source for kind, source in CELLS if kind == "code")
    cells: list[dict[str, Any]] = []
    for number, (kind, source) in enumerate(CELLS):
        cell: dict[str, Any] = {"cell_type": kind, "id": f"cell-{number}", "metadata": {}, "source": _lines(source)}
        if kind == "code":
            count = sum(one["cell_type"] == "code" for one in cells) + 1
            text = next(printed)
            stream = [{"name": "stdout", "output_type": "stream", "text": _lines(text)}] if text else []
            cell |= {"execution_count": count, "outputs": stream}
        cells.append(cell)
    language = {"name": "python", "pygments_lexer": "ipython3"}
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    content = {"cells": cells, "metadata": {"kernelspec": kernel, "language_info": language}}
    return json.dumps(content | {"nbformat": 4, "nbformat_minor": 5}, indent=1, ensure_ascii=False) + "\n"


def _lines(text: str) -> list[str]:
    return text.splitlines(keepends=True)


if __name__ == "__main__":
    NOTEBOOK.write_text(notebook(), encoding="utf-8")
