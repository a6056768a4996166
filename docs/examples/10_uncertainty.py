"""How well is the pose known, what limits it, and what would help?"""

import numpy as np

import cocalib as cc

with cc.sample_recording() as recording:
    clicks = cc.read_clicks(recording.paths[0].with_name("clicks.json"))
    scans, camera = recording.radar_scans(), recording.camera()
calibration = cc.calibrate(clicks, scans, camera).unwrap()

sigma = np.sqrt(np.diag(calibration.covariance))  # of (dt, dtheta) in camera axes [m, rad]
print((100 * sigma[:3]).round(1), "cm,", np.degrees(sigma[3:]).round(2), "deg")
for range_m in (3.0, 10.0, 30.0):
    u_px, v_px = calibration.pixel_sigma(np.array([[range_m, 0.0, 0.0]]))[0]
    print(f"{range_m:4.0f} m ahead: {u_px:.1f} px across, {v_px:.1f} px down")
for error in calibration.systematic_errors:  # what is wrong with every pair alike
    share = 100 * error.rotation_share
    print(f"{error.name}: {error.value:+.3g} +- {error.sigma:.2g}, {share:.0f} % of the rotation's variance")

if calibration.next_placement is not None:
    print("next placement", calibration.next_placement.position_radar_m.round(1), "m")

# A tape measure helps most: from the radar's antennas to the lens, forward, left and up.
tape = cc.CameraPositionPrior.measured((-0.03, 0.04, 0.10), "antenna")
options = cc.CalibrationOptions(solving=cc.SolvingOptions(camera_position=tape))
measured = cc.solve_again(calibration, options).unwrap()
for name, one in (("free", calibration), ("with a tape", measured)):
    print(f"{name:12} {100 * np.sqrt(np.trace(one.covariance[:3, :3])):.1f} cm")
