"""Solve the clicks of a recording, and write the calibration and the clicks."""

import cocalib as cc

with cc.sample_recording() as recording:
    clicks = cc.read_clicks(recording.paths[0].with_name("clicks.json"))
    scans, camera = recording.radar_scans(), recording.camera()

# A click of your own: stamp of the frame, a name, and the pixel. With excluded=True it is kept and not used.
first = clicks[0]
clicks = (cc.ReflectorClick(first.image_time, "by hand", first.u_px, first.v_px, sigma_px=1.5), *clicks[1:])

options = cc.CalibrationOptions(gating=cc.GatingOptions(max_range_m=30.0), noise=cc.NoiseOptions(sigma_px=2.0))
outcome = cc.calibrate(clicks, scans, camera, options)
if isinstance(outcome, cc.Unsolvable):
    raise SystemExit(f"{outcome.code}: {outcome.reason}; {outcome.hint}")

print(cc.verdict_on(outcome).level)
for pair in outcome.pairs:
    print(pair.id, "used" if pair.inlier else "disagrees", f"{pair.distance_px:.1f} px")
for unpaired in outcome.unpaired:
    print(unpaired.id, "has no radar return")

cc.write_calibration("calibration.json", outcome, frames=cc.FrameNames("radar_front", "camera_front_optical"))
cc.write_clicks("clicks.json", clicks)
