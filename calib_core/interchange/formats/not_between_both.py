"""Files that hold no pose between a radar and a camera, recognized to say what they hold and what to do instead."""

import re
from collections.abc import Callable, Mapping
from typing import NoReturn

from calib_core.errors import InputError
from calib_core.interchange.format import Reads
from calib_core.interchange.syntax.content import Content

_OFFSET_HEADER = re.compile(r"frame difference\s*,\s*x\s*,\s*y", re.IGNORECASE)


def _is_kalibr_chain(content: Content) -> bool:
    blocks = [value for value in content.mapping.values() if isinstance(value, Mapping)]
    return not any("T_cam_radar" in block for block in blocks) and any(
        {"T_cam_imu", "T_cn_cnm1"} & set(block) for block in blocks
    )


def _refuse_kalibr_chain(content: Content, source: str) -> NoReturn:
    """Refuse a chain of cameras and an IMU.

    Raises:
        InputError: always.
    """
    with_imu = [
        str(key) for key, value in content.mapping.items() if isinstance(value, Mapping) and "T_cam_imu" in value
    ]
    if not with_imu:
        raise InputError(
            f"{source}: a Kalibr camera chain: T_cn_cnm1 is between two cameras, and there is no radar in it; as intrinsics it "
            "is read with --camera FILE#cam0"
        )
    raise InputError(
        f"{source}: {', '.join(with_imu)}: T_cam_imu carries points of the IMU into the camera, and there is no radar in the "
        "file; if the radar's frame is the IMU's, rename the key to T_cam_radar for the intended camera, else write there "
        "T_cam_imu times the radar's pose in the IMU"
    )


def _is_k_radar_camera(content: Content) -> bool:
    return {"x_ldr2cam", "roll_ldr2cam"} <= set(content.mapping)


def _is_k_radar_offset(content: Content) -> bool:
    return content.syntax == "lines" and bool(content.lines) and bool(_OFFSET_HEADER.match(content.lines[0].strip()))


def _is_kitti_cameras(content: Content) -> bool:
    return any(line.startswith("P_rect_02:") for line in content.lines)


def _refusing(recognizes: Callable[[Content], bool], why: str) -> Reads:
    """Return a reader that refuses what it recognizes."""

    def refuse(_content: Content, source: str) -> NoReturn:
        raise InputError(f"{source}: {why}")

    return Reads(recognizes, refuse)


KALIBR_CHAIN = Reads(_is_kalibr_chain, _refuse_kalibr_chain)
K_RADAR_CAMERA = _refusing(
    _is_k_radar_camera,
    "a camera of K-Radar: the *_ldr2cam numbers carry points of the lidar into the camera, and the radar is not in the file; "
    "info_calib/calib_radar_lidar.txt has the radar's offset in x and y only. Multiply Rx(roll) Ry(pitch) Rz(yaw) with the "
    "radar's position in the lidar, its height included, and give the 4x4 matrix",
)
K_RADAR_OFFSET = _refusing(
    _is_k_radar_offset,
    "K-Radar's offset between lidar and radar, x and y in meters without height or rotation, and no camera; give the 4x4 "
    "matrix that carries radar points into the camera",
)
KITTI_CAMERAS = _refusing(
    _is_kitti_cameras,
    "KITTI's cameras, without the sensor that measures; give calib_velo_to_cam.txt, this file is read from beside it",
)
