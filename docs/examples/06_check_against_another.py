"""Check one calibration against another: do they differ by more than their uncertainties?"""

import dataclasses

import numpy as np

import cocalib as cc

with cc.sample_recording() as recording:
    clicks = cc.read_clicks(recording.paths[0].with_name("clicks.json"))
    scans, camera = recording.radar_scans(), recording.camera()
before = cc.calibrate(clicks[::2], scans, camera).unwrap()
after = cc.calibrate(clicks[1::2], scans, camera).unwrap()

report = cc.check(after, against=before)
print(report.verdict)  # right, wrong, doubtful or unproven
print(report)

# A camera that was turned by 5 degrees since then.
turned = before.camera_from_radar.perturbed(np.array([0.0, 0.0, 0.0, 0.0, np.radians(5.0), 0.0]))
moved = cc.check(dataclasses.replace(before, camera_from_radar=turned), against=before)
print(moved.verdict, [result.code for result in moved.results if result.level == "error"])

# By limits of your own instead, and by the pairs of a file.
print(cc.check(after, against=before, limits=cc.AgreementLimits(max_deg=2.0, max_cm=50.0)).verdict)
cc.write_calibration("before.json", before)
print(cc.check(after, pairs="before.json").verdict)
