"""Files of whole vehicles in the shape that other tools write them, for the tests of frame trees."""

import json
from pathlib import Path

CAR_URDF = """<?xml version="1.0"?>
<!-- The test car; measured on 3 May. -->
<robot name="car">
  <material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>
  <link name="base_link"><visual><geometry><box size="4.5 1.8 1.5"/></geometry></visual></link>
  <link name="roof_rack"/><link name="radar_front"/><link name="radar_rear_left"/>
  <link name="camera_front_link"/><link name="camera_front_optical_frame"/>
  <link name="camera_rear_link"/><link name="camera_rear_optical_frame"/><link name="wheel_left"/>

  <joint name="wheel_left_joint" type="continuous">
    <parent link="base_link"/><child link="wheel_left"/><origin xyz="1.2 0.8 0.3" rpy="0 0 0"/><axis xyz="0 1 0"/>
  </joint>
  <joint name="roof_rack_joint" type="fixed">
    <parent link="base_link"/>
    <child link="roof_rack"/>
    <origin xyz="0.4 0 1.62" rpy="0 0 0"/>  <!-- CAD -->
  </joint>
  <joint name="radar_front_joint" type="fixed">
    <origin rpy='0 0.02 0.01'
            xyz='3.61 0.05 0.52'/>
    <parent link="base_link"/>
    <child link="radar_front"/>
  </joint>
  <joint name="radar_rear_left_joint" type="fixed">
    <parent link="base_link"/>
    <child link="radar_rear_left"/>
    <origin xyz="-0.8 0.7 0.6" rpy="0 0 2.4"/>
  </joint>
  <joint name="camera_front_joint" type="fixed">
    <parent link="roof_rack"/>
    <child link="camera_front_link"/>
    <origin xyz="0.25 -0.02 0.11" rpy="0 0.06 -0.015"/> <!-- tape measure, redo! -->
  </joint>
  <joint name="camera_front_optical_joint" type="fixed">
    <parent link="camera_front_link"/>
    <child link="camera_front_optical_frame"/>
    <origin xyz="0 0 0" rpy="-1.5707963267948966 0 -1.5707963267948966"/>
  </joint>
  <joint name="camera_rear_joint" type="fixed">
    <parent link="roof_rack"/>
    <child link="camera_rear_link"/>
    <origin xyz="-0.3 0 0.1" rpy="0 0 3.14159265"/>
  </joint>
  <joint name="camera_rear_optical_joint" type="fixed">
    <parent link="camera_rear_link"/>
    <child link="camera_rear_optical_frame"/>
    <origin xyz="0 0 0" rpy="-1.5707963267948966 0 -1.5707963267948966"/>
  </joint>
</robot>
"""

REALSENSE_URDF = """<robot name="cart">
  <link name="base_link"/><link name="radar"/><link name="camera_link"/>
  <joint name="radar_joint" type="fixed"><parent link="base_link"/><child link="radar"/><origin xyz="0.3 0 0.4"/></joint>
  <joint name="camera_joint" type="fixed"><parent link="base_link"/><child link="camera_link"/></joint>
</robot>
"""

REALSENSE_ECHO = """transforms:
- header:
    stamp:
      sec: 1700000000
      nanosec: 12
    frame_id: camera_link
  child_frame_id: camera_depth_frame
  transform:
    translation: {x: 0.0, y: 0.0, z: 0.0}
    rotation: {x: 0.0, y: 0.0, z: 0.0, w: 1.0}
- header:
    stamp:
      sec: 1700000000
      nanosec: 12
    frame_id: camera_link
  child_frame_id: camera_color_frame
  transform:
    translation:
      x: 0.00015
      y: 0.01475
      z: 0.0002
    rotation:
      x: 0.0021
      y: -0.0017
      z: 0.0009
      w: 0.9999959
- header:
    stamp:
      sec: 1700000000
      nanosec: 12
    frame_id: camera_color_frame
  child_frame_id: camera_color_optical_frame
  transform:
    translation:
      x: 0.0
      y: 0.0
      z: 0.0
    rotation:
      x: -0.5
      y: 0.5
      z: -0.5
      w: 0.5
---
"""

SENSORS_CALIBRATION = """# base to kit
base_link:
  sensor_kit_base_link:
    x: 0.9
    y: 0.0
    z: 2.0
    roll: -0.001
    pitch: 0.015
    yaw: -0.0364
  front_center/radar_link: {x: 3.7, y: 0.0, z: 0.5, roll: 0.0, pitch: 0.0, yaw: 0.0}
"""

SENSOR_KIT_CALIBRATION = """sensor_kit_base_link:
  camera0/camera_link:
    x: 0.10731  # from the drawing
    y: 0.56343
    z: -0.27697
    roll: -0.025
    pitch: 0.315
    yaw: 1.035
  camera1/camera_link:
    x: -0.10731
    y: -0.56343
    z: -0.27697
    roll: -0.025
    pitch: 0.32
    yaw: -2.12
  velodyne_top_base_link:
    x: 0.0
    y: 0.0
    z: 0.0
    roll: 0.0
    pitch: 0.0
    yaw: 1.575
"""

_STAMPED = """header:
  seq: 0
  stamp: {{secs: 0, nsecs: 0}}
  frame_id: {parent}
child_frame_id: {child}
transform:
  translation: {{x: {t[0]}, y: {t[1]}, z: {t[2]}}}
  rotation: {{x: {q[0]}, y: {q[1]}, z: {q[2]}, w: {q[3]}}}
"""


def write_apollo(folder: Path) -> Path:
    """Write the calibration of a vehicle as Apollo keeps it: a folder for each kind of sensor."""
    joints = {
        "velodyne_params/velodyne128_novatel_extrinsics.yaml": ("novatel", "velodyne128", (0, 1.6, 1.7), (0, 0, 0, 1)),
        "camera_params/front_6mm_extrinsics.yaml": (
            "velodyne128",
            "front_6mm",
            (0.67, -0.1, -0.5),
            (-0.5, 0.5, -0.5, 0.5),
        ),
        "radar_params/radar_front_extrinsics.yaml": (
            "novatel",
            "radar_front",
            (3.1, 0.0, -0.4),
            (0, 0, 0.0087265, 0.9999619),
        ),
    }
    for name, (parent, child, t, q) in joints.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(_STAMPED.format(parent=parent, child=child, t=t, q=q), encoding="utf-8")
    (folder / "camera_params/front_6mm_intrinsics.yaml").write_text(
        "header: {frame_id: front_6mm}\nheight: 1080\nwidth: 1920\ndistortion_model: plumb_bob\n"
        "D: [0, 0, 0, 0, 0]\nK: [2000, 0, 960, 0, 2000, 540, 0, 0, 1]\n",
        encoding="utf-8",
    )
    return folder


def write_nuscenes(folder: Path, *, two_vehicles: bool = False) -> Path:
    """Write the tables sensor and calibrated_sensor; of two vehicles, the cameras of the second are posed otherwise."""
    channels = {"CAM_FRONT": "camera", "CAM_BACK": "camera", "RADAR_FRONT": "radar", "LIDAR_TOP": "lidar"}
    poses = {
        "CAM_FRONT": ([1.70079, 0.015946, 1.51096], [0.499801, -0.503032, 0.499786, -0.497364]),
        "CAM_BACK": ([0.02832, 0.00345, 1.57910], [0.503731, -0.497404, -0.494165, 0.504634]),
        "RADAR_FRONT": ([3.412, 0.0, 0.5], [0.9999984769, 0.0, 0.0, 0.0017453284]),
        "LIDAR_TOP": ([0.943713, 0.0, 1.84023], [0.707795, -0.006492, 0.010646, -0.706307]),
    }
    sensors = [{"token": f"{n:032x}", "channel": c, "modality": m} for n, (c, m) in enumerate(channels.items())]
    records = []
    for vehicle in (0, 1):
        for n, (channel, (translation, rotation)) in enumerate(poses.items()):
            is_camera = channels[channel] == "camera"
            moved = [translation[0] + (0.02 if two_vehicles and vehicle and is_camera else 0.0), *translation[1:]]
            records.append(
                {
                    "token": f"{vehicle * 16 + n + 160:08x}{0:024x}",
                    "sensor_token": f"{n:032x}",
                    "translation": moved,
                    "rotation": rotation,
                    "camera_intrinsic": [[1266.4, 0.0, 816.3], [0.0, 1266.4, 491.5], [0.0, 0.0, 1.0]]
                    if is_camera
                    else [],
                }
            )
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "sensor.json").write_text(json.dumps(sensors, indent=0), encoding="utf-8")
    (folder / "calibrated_sensor.json").write_text(json.dumps(records, indent=0), encoding="utf-8")
    return folder
