"""Calibrate a lens from views of a board."""

import numpy as np

import cocalib as cc
from calib_core.intrinsics.board import Board
from calib_core.intrinsics.board_images import BoardCorners
from calib_core.intrinsics.calibrating import calibrate_lens
from calib_core.intrinsics.coverage import BoardSearch
from calib_core.synthetic.boards import waved_poses
from calib_core.synthetic.rig import typical_camera

# From images, `cocalib intrinsics left*.jpg --board 9x6 --square-mm 25 --out camera.yaml` finds the corners first; in Python
# calib_core.intrinsics.search_boards does. Here the corners are simulated, so the true lens is known.
rng = np.random.default_rng(5)
board, truth = Board("checkerboard", 9, 6, 0.025), typical_camera("plumb_bob", width_px=1280, height_px=720)
size_px, ids, views = (truth.width_px, truth.height_px), np.arange(len(board.corners_m)), []
for index, pose in enumerate(waved_poses(rng, board, truth, 30)):
    pixels_px = truth.project(pose @ board.corners_m) + 0.1 * rng.standard_normal((len(ids), 2))
    views.append(BoardCorners(index, f"view {index + 1}", None, size_px, ids, pixels_px))
search = BoardSearch(board, size_px, tuple(views), (), len(views))

lens = calibrate_lens(search, "plumb_bob")  # "auto" tries the models and takes the simplest that predicts as well
if isinstance(lens, cc.Unsolvable):
    raise SystemExit(lens.reason)
print(lens.camera.model, f"{lens.rms_px:.3f} px over {len(lens.views)} views")
print(lens.camera.matrix_px.round(2))
print((lens.camera.matrix_px - truth.matrix_px).round(2), "px from the truth")

known = lens.camera.covariance  # written with the camera, and used by every calibration that uses this camera
for name, sigma in zip(known.order, np.sqrt(np.diag(known.matrix)), strict=True):
    print(f"{name}: sigma {sigma:.2g}")
for warning in lens.warnings:
    print(warning.code)
