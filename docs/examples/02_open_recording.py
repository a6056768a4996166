"""Open a recording: its topics, one frame, radar scans, and where the reflector stood."""

import cocalib as cc

# Your own files: cc.open_recording(["radar.bag", "camera.bag"]), or one MCAP file, or a folder of images and tables.
with cc.sample_recording() as recording:
    print(recording.radar_topic, len(recording.radar_times), "scans")
    print(recording.image_topic, len(recording.image_times), "frames")
    camera = recording.camera()  # None if the recording does not hold intrinsics
    print(camera.model, camera.width_px, camera.height_px)

    print(recording.image(0).shape)  # uint8, blue first; image_bytes(0) is as recorded
    first, last = recording.radar_times[0], recording.radar_times[-1]
    print(f"{(last - first) / 1e9:.1f} s of radar")  # stamps are nanoseconds

    scans = recording.radar_scans()
    print(len(scans), "scans read")
    for placement in cc.find_placements(scans, cc.GatingOptions()):
        print((placement.end - placement.start) / 1e9, "s at", placement.position_radar_m.round(2), "m")

    for warning in recording.warnings:
        print(warning.code)
