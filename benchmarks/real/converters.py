"""From the files of a public set to pairs or a recording: what the product's readers cannot know is here."""

import ast
import csv
import json
import re
import shutil
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from calib_core import read_camera
from calib_core.arrays import Points2, Points3
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform
from calib_core.interchange.importing import read_any_file
from calib_core.measurements import ReflectorClick, TimeNs


@dataclass(frozen=True, slots=True, eq=False)
class Contents:
    """Pairs, or a recording with clicks or boxes.

    Attributes:
        camera: the intrinsics that the authors state; None if the recording holds them.
        published: the extrinsics that they state; None if there are none.
        points_radar_m: (n, 3) positions of pairs.
        pixels_px: (n, 2) where the camera saw them.
        recording: what `open_recording` reads.
        clicks: on reflectors in it.
        boxes: what `read_boxes` reads.
    """

    camera: Camera | None
    published: RigidTransform | None = None
    points_radar_m: Points3 = field(default_factory=lambda: np.zeros((0, 3)))
    pixels_px: Points2 = field(default_factory=lambda: np.zeros((0, 2)))
    recording: Path | None = None
    clicks: tuple[ReflectorClick, ...] = ()
    boxes: Path | None = None


def camera_points(root: Path, _: Path, points: str, extrinsics: str, lens: str) -> Contents:
    """Read radar or lidar positions beside the target's position in the camera's frame, which its lens projects."""
    size = re.findall(r"image(?:Width|Height): (\d+)", (root / lens).read_text(encoding="utf-8"))
    camera = read_camera(root / lens, image_size_px=(int(size[0]), int(size[1])))
    rows = np.loadtxt(root / points, delimiter=",", skiprows=1)
    numbers = re.findall(r"-?\d[\d.]*(?:e-?\d+)?", (root / extrinsics).read_text(encoding="utf-8"))
    pose = np.array(numbers, dtype=np.float64)
    return Contents(camera, _rigid(pose[:9].reshape(3, 3), pose[9:]), rows[:, :3], camera.project(rows[:, 3:]))


def fisheye_pairs(root: Path, _: Path, lens: str, pixels: str, points_cm: str) -> Contents:
    """Read pixels, and radar positions in centimetres; the image's size is that of the authors' program."""
    numbers = np.loadtxt(root / lens)
    camera = Camera("equidistant", 1936, 1552, numbers[:9].reshape(3, 3), numbers[9:])
    return Contents(camera, None, np.loadtxt(root / points_cm) / 100.0, np.loadtxt(root / pixels))


def npy_clicks(root: Path, _: Path, extrinsics: str, pixels: str, points: str, lens: str) -> Contents:
    """Read clicks in image and cloud, one array each."""
    pose = np.load(root / extrinsics)
    published = _rigid(pose["R"], pose["T"].ravel())
    return Contents(read_camera(root / lens), published, np.load(root / points), np.load(root / pixels))


def chessboards(root: Path, _: Path, poses: str, published: str, images: str) -> Contents:
    """Find the board and the lens in the images, and take the lidar's board centres; the pose is the mean of 50 runs."""
    import cv2
    from scipy.spatial.transform import Rotation

    corners_m = np.zeros((35, 3), dtype=np.float32)
    corners_m[:, :2] = 0.105 * (np.mgrid[0:7, 0:5].T.reshape(-1, 2) - np.array([3.0, 2.0]))  # the centre is the origin
    seen = []
    for i in range(40):
        image = np.asarray(cv2.imread(str(root / images.replace("*", f"{i + 1}")), cv2.IMREAD_GRAYSCALE))
        corners = cv2.findChessboardCorners(image, (7, 5))[1]
        seen.append(cv2.cornerSubPix(image, corners, (5, 5), (-1, -1), (cv2.TERM_CRITERIA_EPS, 50, 1e-3)))
    height, width = image.shape
    matrix, lens, _turns, shifts = cv2.calibrateCamera([corners_m] * 40, seen, (width, height), None, None)[1:]
    camera = Camera("plumb_bob", width, height, matrix, lens.ravel())
    pixels = camera.project(np.array(shifts)[:, :, 0])
    rows = list(csv.reader((root / poses).open(encoding="utf-8")))
    centres_mm = np.array([rows[6 + 19 * i] for i in range(40)], dtype=np.float64)
    runs = np.loadtxt(root / published, delimiter=",", skiprows=1)  # roll, pitch, yaw and position of the camera
    turn = Rotation.from_euler("ZYX", runs[:, 2::-1]).mean().as_matrix()
    pose = RigidTransform(turn, runs[:, 3:].mean(axis=0)).inverse()
    return Contents(camera, pose, centres_mm / 1000.0, pixels)


def road(root: Path, scratch: Path, image: str, radar: str, lens: str, extrinsics: str) -> Contents:
    """Part two names of the radar's header that have grown together, and give the image the time of the first scan."""
    table = (root / radar).read_text(encoding="utf-8").replace("existobject", "exist,object", 1)
    (scratch / "radar.csv").write_text(table, encoding="utf-8")
    (scratch / "image").mkdir()
    shutil.copy(root / image, scratch / "image" / f"{table.splitlines()[1].partition(',')[0]}.jpg")
    stated = json.loads((root / lens).read_text())["center_camera-intrinsic"]["param"]
    matrix, distortion = np.array(stated["cam_K"]["data"]), np.array(stated["cam_dist"]["data"]).ravel()
    camera = Camera("plumb_bob", stated["img_dist_w"], stated["img_dist_h"], matrix, np.append(distortion, 0.0))
    return Contents(camera, read_any_file(root / extrinsics).camera_from_radar, recording=scratch)


def view_of_delft(root: Path, _: Path, *_files: str) -> Contents:
    """Name the folders: all of it is read as it is."""
    radar = root / "example_set" / "radar" / "training"
    pose = read_any_file(radar / "calib" / "00549.txt").camera_from_radar
    return Contents(None, pose, recording=radar, boxes=root / "example_set" / "lidar" / "training" / "label_2")


_SCENES: dict[str, tuple[tuple[float, float], ...]] = {
    "10_center_right1": ((330.8, 232.6), (462.5, 235.3)),
    "15_center_10_left2": ((328.8, 219.8), (15.5, 231.9)),
    "15_lef1_right1": ((235.3, 219.2), (441.0, 221.9)),
    "20_center_left1": ((198.3, 208.4), (337.5, 209.0)),
    "25_left1_right1": ((212.4, 202.4), (464.6, 207.7)),
}
"""Both boards of each scene, clicked by us in the frame in its middle."""
BOARD_RANGES_M = (10.0, 10.0, 15.0, 10.0, 15.0, 15.0, 20.0, 20.0, 25.0, 25.0)
"""Of the same boards, as the scenes' names state them."""
_MESSAGE = "std_msgs/Header header\nfloat32[] range\nfloat32[] azimuth1\nfloat32[] azimuth2\nfloat32[] vrelrad\nfloat32[] snr\n"


def two_reflectors(root: Path, scratch: Path, *_files: str) -> Contents:
    """Write a bag: each radar line of arrays becomes a message, with both azimuths that this radar reports."""
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    store.register(get_types_from_msg(_MESSAGE, "radar/msg/Detections"))
    header, stamp = store.types["std_msgs/msg/Header"], store.types["builtin_interfaces/msg/Time"]
    radar, image = store.types["radar/msg/Detections"], store.types["sensor_msgs/msg/CompressedImage"]

    def stamped(at: int, frame: str) -> Any:
        return header(0, stamp(at // 10**9, at % 10**9), frame)

    messages: list[tuple[int, str, Any]] = []
    clicks: list[ReflectorClick] = []
    for scene, boards in _SCENES.items():
        frames = sorted((root / "data" / "camera" / scene).glob("*.jpg"))
        middle = TimeNs(time_ns(frames[len(frames) // 2].stem))
        clicks += [ReflectorClick(middle, f"{scene}-{u:.0f}", u, v) for u, v in boards]
        for path in frames:
            at = time_ns(path.stem)
            content = np.frombuffer(path.read_bytes(), np.uint8)
            messages.append((at, "/camera", image(stamped(at, "camera"), "jpeg", content)))
        for row in csv.DictReader((root / "data" / "RADAR" / f"{scene}-radar_img.csv").open(encoding="utf-8")):
            at = time_ns(row["time"])
            columns = (".range", ".azimuth1", ".azimuth2", ".VrelRad", ".SNR")
            arrays = [np.array(ast.literal_eval(row[name]), np.float32).ravel() for name in columns]
            messages.append((at, "/radar", radar(stamped(at, "radar"), *arrays)))
    with Writer(scratch / "five.bag") as bag:
        topics = {"/camera": image.__msgtype__, "/radar": radar.__msgtype__}
        written = {topic: bag.add_connection(topic, kind, typestore=store) for topic, kind in topics.items()}
        for at, topic, message in sorted(messages, key=lambda message: message[0]):
            bag.write(written[topic], at, store.serialize_ros1(message, topics[topic]))
    matrix = np.array([[706.0, 0.0, 320.0], [0.0, 706.0, 240.0], [0.0, 0.0, 1.0]])
    return Contents(
        Camera("pinhole", 640, 480, matrix, np.zeros(0)), recording=scratch / "five.bag", clicks=tuple(clicks)
    )


def time_ns(text: str) -> int:
    """Return the moment of a name or a cell: year, month, day, hour, minute, second and microseconds in UTC."""
    year, month, day, hour, minute, second, us = map(int, re.findall(r"\d+", text))
    return int(datetime(year, month, day, hour, minute, second, us, UTC).timestamp() * 1e6 + 0.5) * 1000


def _rigid(matrix: np.ndarray, translation_m: np.ndarray) -> RigidTransform:
    """Return the pose with the nearest rotation: published matrices are rounded."""
    u, _, vt = np.linalg.svd(matrix)
    return RigidTransform(u @ vt, translation_m)
