"""Definitions of standard and well-known messages, for recordings without any (as SQLite bags before ROS 2 Iron).

The field lists are those of ROS 2, and only of types whose layout has not changed since Foxy.
"""

from collections.abc import Mapping

_POINT = "float64 x\nfloat64 y\nfloat64 z\n"
_SEPARATOR = "================\n"

KNOWN_DEFINITIONS: Mapping[str, str] = {
    "sensor_msgs/Image": (
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\nuint8[] data\n"
    ),
    "sensor_msgs/CompressedImage": "std_msgs/Header header\nstring format\nuint8[] data\n",
    "sensor_msgs/CameraInfo": (
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\n"
        "float64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\nRegionOfInterest roi\n"
        f"{_SEPARATOR}MSG: sensor_msgs/RegionOfInterest\n"
        "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n"
    ),
    "sensor_msgs/PointCloud2": (
        "std_msgs/Header header\nuint32 height\nuint32 width\nPointField[] fields\nbool is_bigendian\nuint32 point_step\n"
        "uint32 row_step\nuint8[] data\nbool is_dense\n"
        f"{_SEPARATOR}MSG: sensor_msgs/PointField\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n"
    ),
    "sensor_msgs/PointCloud": (
        "std_msgs/Header header\ngeometry_msgs/Point32[] points\nChannelFloat32[] channels\n"
        f"{_SEPARATOR}MSG: geometry_msgs/Point32\nfloat32 x\nfloat32 y\nfloat32 z\n"
        f"{_SEPARATOR}MSG: sensor_msgs/ChannelFloat32\nstring name\nfloat32[] values\n"
    ),
    "foxglove_msgs/CompressedVideo": "builtin_interfaces/Time timestamp\nstring frame_id\nuint8[] data\nstring format\n",
    "ffmpeg_image_transport_msgs/FFMPEGPacket": (
        "std_msgs/Header header\nint32 width\nint32 height\nstring encoding\nuint64 pts\nuint8 flags\nbool is_bigendian\n"
        "uint8[] data\n"
    ),
    "nebula_msgs/NebulaPackets": (
        "std_msgs/Header header\nNebulaPacket[] packets\n"
        f"{_SEPARATOR}MSG: nebula_msgs/NebulaPacket\nbuiltin_interfaces/Time stamp\nuint8[] data\n"
    ),
    "radar_msgs/RadarScan": (
        "std_msgs/Header header\nRadarReturn[] returns\n"
        f"{_SEPARATOR}MSG: radar_msgs/RadarReturn\n"
        "float32 range\nfloat32 azimuth\nfloat32 elevation\nfloat32 doppler_velocity\nfloat32 amplitude\n"
    ),
    "radar_msgs/RadarTracks": (
        "std_msgs/Header header\nRadarTrack[] tracks\n"
        f"{_SEPARATOR}MSG: radar_msgs/RadarTrack\n"
        "unique_identifier_msgs/UUID uuid\ngeometry_msgs/Point position\ngeometry_msgs/Vector3 velocity\n"
        "geometry_msgs/Vector3 acceleration\ngeometry_msgs/Vector3 size\nuint16 classification\n"
        "float32[6] position_covariance\nfloat32[6] velocity_covariance\nfloat32[6] acceleration_covariance\n"
        "float32[6] size_covariance\n"
        f"{_SEPARATOR}MSG: unique_identifier_msgs/UUID\nuint8[16] uuid\n"
        f"{_SEPARATOR}MSG: geometry_msgs/Point\n{_POINT}"
        f"{_SEPARATOR}MSG: geometry_msgs/Vector3\n{_POINT}"
    ),
    "tf2_msgs/TFMessage": (
        "geometry_msgs/TransformStamped[] transforms\n"
        f"{_SEPARATOR}MSG: geometry_msgs/TransformStamped\n"
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"
        f"{_SEPARATOR}MSG: geometry_msgs/Transform\n"
        "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"
        f"{_SEPARATOR}MSG: geometry_msgs/Vector3\n{_POINT}"
        f"{_SEPARATOR}MSG: geometry_msgs/Quaternion\n{_POINT}float64 w\n"
    ),
}
