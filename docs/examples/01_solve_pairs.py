"""Solve pairs: radar positions and the pixels where the camera saw them."""

import numpy as np

import cocalib as cc

# In your own program these come from a file: np.loadtxt("points.csv", delimiter=",").
rng = np.random.default_rng(1)
camera_matrix = np.array([[800.0, 0.0, 640.0], [0.0, 800.0, 360.0], [0.0, 0.0, 1.0]])
camera = cc.Camera("pinhole", 1280, 720, camera_matrix, np.zeros(0))
optical_from_body = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
truth = cc.RigidTransform(optical_from_body, np.array([0.05, -0.10, -0.02]))
points_radar_m = rng.uniform([3.0, -2.0, -0.8], [15.0, 2.0, 0.8], (20, 3))  # x forward, y left, z up
pixels_px = camera.project(truth @ points_radar_m) + rng.normal(0.0, 1.0, (20, 2))  # (0, 0): center of the first pixel

pairs = cc.pairs_from_arrays(points_radar_m, pixels_px)
calibration = cc.calibrate_pairs(pairs, camera).unwrap()
print(calibration)  # pose, uncertainty and its causes, residuals, warnings
print(np.round(calibration.camera_from_radar.as_matrix(), 3))
print(np.round(calibration.reproject(points_radar_m) - pixels_px, 1)[:3])

few = cc.calibrate_pairs(cc.pairs_from_arrays(points_radar_m[:2], pixels_px[:2]), camera)
print(type(few).__name__, few.code)  # without unwrap an answer that cannot be given is a value

cc.write_pairs("pairs.json", cc.PairsFile(camera, tuple(pairs)))
kept = cc.read_pairs("pairs.json")  # of a table, such as pairs.csv, with the camera: cc.read_pairs(path, camera)
print(len(kept.pairs), "pairs and", kept.camera.model)
