"""Evaluate a calibration by clicks that it was not solved from."""

import numpy as np

import cocalib as cc
from calib_core.evaluation.residuals import residual_figures

# Two recordings of one rig are better; here the clicks of one are divided.
with cc.sample_recording() as recording:
    clicks = cc.read_clicks(recording.paths[0].with_name("clicks.json"))
    scans, camera = recording.radar_scans(), recording.camera()
calibration = cc.calibrate(clicks[::2], scans, camera).unwrap()
other = cc.calibrate(clicks[1::2], scans, camera).unwrap()

# The other clicks, with the returns that their own solve chose, under this calibration.
points_radar_m = np.array([pair.point_radar_m for pair in other.pairs])
pixels_px = np.array([pair.pixel_px for pair in other.pairs])
distances_px = np.linalg.norm(calibration.reproject(points_radar_m) - pixels_px, axis=1)
print(f"{len(distances_px)} clicks: AED {cc.aed(distances_px):.1f} px, CDSD {cc.cdsd(distances_px):.1f} px")

# As the command `evaluate` does it: the returns chosen without this calibration, bins, and each placement left out in turn.
figures = residual_figures([pair.measured for pair in other.pairs], calibration)
print(f"{len(figures.ids)} clicks: median {figures.median_px:.1f} px")

# Acc: the share of returns in boxes, frame by frame; here each frame has one return and one box of 30 px.
left_top, right_bottom = pixels_px - 15.0, pixels_px + 15.0
projected_px = calibration.reproject(points_radar_m)
inside = ((projected_px >= left_top) & (projected_px <= right_bottom)).all(axis=1)
print(f"Acc {cc.acc(list(inside[:, None])):.2f}")
