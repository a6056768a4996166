"""The sample's radar written again as a vendor's messages that state neither the angle's sign nor the speed's unit."""

from pathlib import Path

import numpy as np
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from calib_core.measurements import NS_PER_S
from calib_core.radar import polar_from_cartesian
from calib_core.recordings import open_recording

_DETECTION = "vendor_msgs/msg/Detection"
_PACKET = "vendor_msgs/msg/DetectionPacket"
_NAMES = ("f_RangeM", "f_Azimuth", "f_Elevation", "f_VelRad", "s_Snr")

STATED = ("azimuth=f_Azimuth:rad", "doppler=f_VelRad:mps")
"""The values of --map that state what these messages do not."""


def vendor_sample(sample: Path, folder: Path) -> tuple[Path, Path]:
    """Write the radar's recording into a folder; return it and the camera's recording.

    Args:
        sample: the folder of the sample recording.
        folder: where the new file goes.
    """
    store = get_typestore(Stores.ROS1_NOETIC)
    store.register(get_types_from_msg("".join(f"float32 {name}\n" for name in _NAMES), _DETECTION))
    store.register(get_types_from_msg("Header header\nvendor_msgs/Detection[] s_Detections\n", _PACKET))
    detection, packet = store.types[_DETECTION], store.types[_PACKET]
    path = folder / "vendor.bag"
    with open_recording([sample / "radar.bag"], require=("radar",)) as recording, Writer(path) as writer:
        connection = writer.add_connection("/front/detections", _PACKET, typestore=store)
        scans = recording.radar_scans()
        for number, time in enumerate(scans.times_ns.tolist()):
            scan = scans.scan(number)
            polar = polar_from_cartesian(scan.points_radar_m)
            rows = np.column_stack([polar, scan.doppler_mps, scan.snr_db]).tolist()
            sec, nanosec = divmod(time, NS_PER_S)
            stamp = store.types["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)
            header = store.types["std_msgs/msg/Header"](seq=0, stamp=stamp, frame_id="radar")
            message = packet(header=header, s_Detections=[detection(*row) for row in rows])
            writer.write(connection, time, bytes(store.serialize_ros1(message, _PACKET)))
    return path, sample / "camera.bag"
