"""The method of the paper and its figures, on the same clicks."""

import numpy as np

import cocalib as cc

with cc.sample_recording() as recording:
    clicks = cc.read_clicks(recording.paths[0].with_name("clicks.json"))
    scans, camera = recording.radar_scans(), recording.camera()

default = cc.calibrate(clicks, scans, camera).unwrap()
method = cc.CalibrationOptions(method="paper")
whole = cc.calibrate(clicks, scans, camera, method).unwrap()  # its radar positions are means of all static returns
pose = cc.solve_again(default, method).unwrap()  # its PnP only, on the radar positions of the default method

for name, calibration in (("default", default), ("paper's PnP", pose), ("paper", whole)):
    metrics = calibration.metrics
    print(f"{name:12} AED {metrics.aed_px:.1f} px, CDSD {metrics.cdsd_px:.1f} px over {metrics.n} pairs")
print(f"iterative {pose.iterative_px:.2f} px, SQPnP {pose.sqpnp_px:.2f} px")  # the better one is taken, and refined

# The figures of any distances: cc.aed averages them, cc.cdsd is their corrected standard deviation.
distances_px = np.array([pair.distance_px for pair in pose.pairs])
print(f"AED {cc.aed(distances_px):.1f} px, CDSD {cc.cdsd(distances_px):.1f} px")
