"""Messages of boxes in the layouts of vision_msgs (old and new), darknet_ros_msgs and foxglove_msgs, built with rosbags."""

from typing import Any

import numpy as np

from calib_core.measurements import Box
from tests.unit.recordings.conftest import START_NS, Ros, Row, plain_rows

HEAD = "Header header\n"
NEW = {
    "vision_msgs/msg/Point2D": "float64 x\nfloat64 y\n",
    "vision_msgs/msg/Pose2D": "vision_msgs/Point2D position\nfloat64 theta\n",
    "vision_msgs/msg/BoundingBox2D": "vision_msgs/Pose2D center\nfloat64 size_x\nfloat64 size_y\n",
    "vision_msgs/msg/ObjectHypothesis": "string class_id\nfloat64 score\n",
    "vision_msgs/msg/ObjectHypothesisWithPose": "ObjectHypothesis hypothesis\ngeometry_msgs/PoseWithCovariance pose\n",
    "vision_msgs/msg/Detection2D": HEAD + "ObjectHypothesisWithPose[] results\nBoundingBox2D bbox\nstring id\n",
    "vision_msgs/msg/Detection2DArray": HEAD + "Detection2D[] detections\n",
}
OLD = {
    "vision_msgs/msg/BoundingBox2D": "geometry_msgs/Pose2D center\nfloat64 size_x\nfloat64 size_y\n",
    "vision_msgs/msg/ObjectHypothesisWithPose": "int64 id\nfloat64 score\ngeometry_msgs/PoseWithCovariance pose\n",
    "vision_msgs/msg/Detection2D": HEAD
    + "ObjectHypothesisWithPose[] results\nBoundingBox2D bbox\nsensor_msgs/Image source_img\n",
    "vision_msgs/msg/Detection2DArray": HEAD + "Detection2D[] detections\n",
}
YOLO = {
    "yolo_msgs/msg/Point2D": "float64 x\nfloat64 y\n",
    "yolo_msgs/msg/Vector2": "float64 x\nfloat64 y\n",
    "yolo_msgs/msg/Pose2D": "Point2D position\nfloat64 theta\n",
    "yolo_msgs/msg/BoundingBox2D": "Pose2D center\nVector2 size\n",
    "yolo_msgs/msg/Detection": "int32 class_id\nstring class_name\nfloat64 score\nstring id\nBoundingBox2D bbox\n",
    "yolo_msgs/msg/DetectionArray": HEAD + "Detection[] detections\n",
}
DARKNET = {
    "darknet_ros_msgs/msg/BoundingBox": "float64 probability\nint64 xmin\nint64 ymin\nint64 xmax\nint64 ymax\n"
    "int16 id\nstring Class\n",
    "darknet_ros_msgs/msg/BoundingBoxes": HEAD + "Header image_header\nBoundingBox[] bounding_boxes\n",
}
ANNOTATIONS = {
    "foxglove_msgs/msg/Point2": "float64 x\nfloat64 y\n",
    "foxglove_msgs/msg/Color": "float64 r\nfloat64 g\nfloat64 b\nfloat64 a\n",
    "foxglove_msgs/msg/PointsAnnotation": "builtin_interfaces/Time timestamp\nuint8 type\nPoint2[] points\n"
    "Color outline_color\nColor[] outline_colors\nColor fill_color\nfloat64 thickness\n",
    "foxglove_msgs/msg/TextAnnotation": "builtin_interfaces/Time timestamp\nPoint2 position\nstring text\n"
    "float64 font_size\nColor text_color\nColor background_color\n",
    "foxglove_msgs/msg/ImageAnnotations": "PointsAnnotation[] points\nTextAnnotation[] texts\n",
}
FIRST_FRAME_NS = START_NS + 50_000_000
SIZES = (20.0, 40.0)
EXPECTED = Box(9.5, -0.5, 29.5, 39.5)
"""Centre (20, 20), 20 wide and 40 high, from the corner of the top-left pixel."""


def define(ros: Ros, texts: dict[str, str]) -> None:
    for name, text in texts.items():
        full = text.replace("\nHeader ", "\nstd_msgs/Header ").replace("Header header", "std_msgs/Header header", 1)
        if ros.generation == 1:
            full = full.replace("builtin_interfaces/Time", "time").replace("std_msgs/Header", "Header")
        ros.define(name, full.replace("std_msgs/std_msgs", "std_msgs"))


def covariance(ros: Ros) -> Any:
    point = ros.new("geometry_msgs/msg/Point", x=0.0, y=0.0, z=0.0)
    turn = ros.new("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0)
    pose = ros.new("geometry_msgs/msg/Pose", position=point, orientation=turn)
    return ros.new("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=np.zeros(36))


def new_detections(ros: Ros, at: int) -> Any:
    def hypothesis(label: str, score: float) -> Any:
        inner = ros.new("vision_msgs/msg/ObjectHypothesis", class_id=label, score=score)
        return ros.new("vision_msgs/msg/ObjectHypothesisWithPose", hypothesis=inner, pose=covariance(ros))

    position = ros.new("vision_msgs/msg/Point2D", x=20.0, y=20.0)
    centre = ros.new("vision_msgs/msg/Pose2D", position=position, theta=0.0)
    bbox = ros.new("vision_msgs/msg/BoundingBox2D", center=centre, size_x=SIZES[0], size_y=SIZES[1])
    one = ros.new(
        "vision_msgs/msg/Detection2D",
        header=ros.header(at),
        results=[hypothesis("car", 0.25), hypothesis("person", 0.5)],
        bbox=bbox,
        id="7",
    )
    return ros.new("vision_msgs/msg/Detection2DArray", header=ros.header(at), detections=[one])


def old_detections(ros: Ros, at: int) -> Any:
    centre = ros.new("geometry_msgs/msg/Pose2D", x=20.0, y=20.0, theta=np.pi / 2)
    bbox = ros.new("vision_msgs/msg/BoundingBox2D", center=centre, size_x=SIZES[1], size_y=SIZES[0])
    result = ros.new("vision_msgs/msg/ObjectHypothesisWithPose", id=3, score=0.5, pose=covariance(ros))
    source = ros.image(at, np.zeros((2, 6), dtype=np.uint8), "bgr8", width=2)
    one = ros.new("vision_msgs/msg/Detection2D", header=ros.header(at), results=[result], bbox=bbox, source_img=source)
    return ros.new("vision_msgs/msg/Detection2DArray", header=ros.header(at), detections=[one])


def yolo(ros: Ros, at: int) -> Any:
    position = ros.new("yolo_msgs/msg/Point2D", x=20.0, y=20.0)
    centre = ros.new("yolo_msgs/msg/Pose2D", position=position, theta=0.0)
    size = ros.new("yolo_msgs/msg/Vector2", x=SIZES[0], y=SIZES[1])
    bbox = ros.new("yolo_msgs/msg/BoundingBox2D", center=centre, size=size)
    one = ros.new("yolo_msgs/msg/Detection", class_id=0, class_name="person", score=0.5, id="3", bbox=bbox)
    return ros.new("yolo_msgs/msg/DetectionArray", header=ros.header(at), detections=[one])


def darknet(ros: Ros, at: int) -> Any:
    one = ros.new(
        "darknet_ros_msgs/msg/BoundingBox", probability=0.5, xmin=10, ymin=0, xmax=30, ymax=40, id=2, Class="person"
    )
    return ros.new(
        "darknet_ros_msgs/msg/BoundingBoxes",
        header=ros.header(at + 70_000_000),  # when the network had finished
        image_header=ros.header(at),
        bounding_boxes=[one],
    )


def annotations(ros: Ros, at: int) -> Any:
    sec, nanosec = divmod(at, 1_000_000_000)
    stamp = ros.new("builtin_interfaces/msg/Time", sec=sec, nanosec=nanosec)
    colour = ros.new("foxglove_msgs/msg/Color", r=1.0, g=0.0, b=0.0, a=1.0)

    def drawn(kind: int, corners: list[tuple[float, float]]) -> Any:
        points = [ros.new("foxglove_msgs/msg/Point2", x=float(u), y=float(v)) for u, v in corners]
        return ros.new(
            "foxglove_msgs/msg/PointsAnnotation",
            timestamp=stamp,
            type=kind,
            points=points,
            outline_color=colour,
            outline_colors=[],
            fill_color=colour,
            thickness=1.0,
        )

    text = ros.new(
        "foxglove_msgs/msg/TextAnnotation",
        timestamp=stamp,
        position=ros.new("foxglove_msgs/msg/Point2", x=10.0, y=-2.0),
        text="person",
        font_size=12.0,
        text_color=colour,
        background_color=colour,
    )
    rectangle = drawn(2, [(10, 0), (30, 0), (30, 40), (10, 40)])
    star = drawn(2, [(20, 0), (30, 20), (20, 40), (10, 20)])
    line = drawn(3, [(0, 0), (30, 20)])
    return ros.new("foxglove_msgs/msg/ImageAnnotations", points=[line, star, rectangle], texts=[text])


KINDS = {
    "new": (NEW, new_detections, ("person", 0.5, "7")),
    "old": (OLD, old_detections, ("3", 0.5, "")),
    "yolo": (YOLO, yolo, ("person", 0.5, "3")),
    "darknet": (DARKNET, darknet, ("person", 0.5, "")),
    "foxglove": (ANNOTATIONS, annotations, ("person", 1.0, "")),
}


def recorded(ros: Ros, jpeg: bytes, kind: str, *, shift_ns: int = 0, **changes: int) -> list[Row]:
    """Return a recording with boxes for frames 0, 2 and 4; those of frame 2 were recorded twice."""
    texts, build, _ = KINDS[kind]
    define(ros, texts)
    rows = plain_rows(ros, jpeg, n=8, **changes)
    for at in (0, 2, 2, 4):
        stamp = FIRST_FRAME_NS + at * 100_000_000 + shift_ns
        rows.append(("/boxes", stamp + 90_000_000, build(ros, stamp)))
    return sorted(rows, key=lambda row: row[1])
