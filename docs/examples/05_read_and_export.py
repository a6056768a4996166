"""Read a calibration, use its numbers, and export it for other tools."""

from pathlib import Path

import numpy as np

import cocalib as cc

with cc.sample_recording() as recording:
    clicks = cc.read_clicks(recording.paths[0].with_name("clicks.json"))
    solved = cc.calibrate(clicks, recording.radar_scans(), recording.camera()).unwrap()
cc.write_calibration("calibration.json", solved)

file = cc.read_calibration("calibration.json")
calibration = file.calibration
print(file.frames.radar, "to", file.frames.camera)
print(calibration.camera_from_radar.as_matrix().round(4))
print(calibration.camera_from_radar.inverse().translation_m.round(3), "m: the camera in the radar's frame")
print(calibration.reproject(np.array([[8.0, 1.0, 0.0]])).round(1), "px: a point 8 m ahead, 1 m to the left")

for name in ("tf2", "urdf", "opencv"):
    exported = cc.export(file, name)
    Path(exported.file_name).write_bytes(exported.data)
    print(exported.file_name, cc.check(exported.file_name, of=file, camera=calibration.camera).verdict)

named = cc.FrameNames("radar_front", "camera_front_optical")
print(cc.export(solved, "tf2", frames=named).data.decode())
