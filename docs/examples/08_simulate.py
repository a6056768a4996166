"""Simulate a recording with a known pose, write it, open it again, and compare the calibration with the truth."""

import tempfile
from pathlib import Path

import numpy as np

import cocalib as cc
from calib_core.synthetic.files import write_recording
from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.recording import simulate

size = {
    "width_px": 320,
    "height_px": 200,
    "camera_rate_hz": 2.0,
    "radar_rate_hz": 5.0,
}  # small, so that it takes seconds
options = SimulationOptions(seed=3, placements=8, dwell_s=3.5, person=False, **size)
simulated = simulate(options)
with tempfile.TemporaryDirectory() as folder:
    written = write_recording(simulated, Path(folder))
    print([path.name for path in written])
    with cc.open_recording(written) as recording:
        clicks = cc.read_clicks(Path(folder, "clicks.json"))
        calibration = cc.calibrate(clicks, recording.radar_scans(), recording.camera()).unwrap()
    print(cc.check(calibration, against=Path(folder, "truth.json")).verdict)

error = calibration.camera_from_radar.error_from(simulated.camera_from_radar)  # (dt, dtheta) in camera axes
print(f"off by {100 * np.linalg.norm(error[:3]):.1f} cm, {np.degrees(np.linalg.norm(error[3:])):.2f} deg")
squared = error @ np.linalg.solve(calibration.covariance, error)
print(f"squared distance {squared:.1f}; the 95 % region ends at {calibration.covariance_quantile:.1f}")
