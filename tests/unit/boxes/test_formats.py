"""Small files in each tool's documented layout: which frame, which pixels, and what is refused."""

import json
import math
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from calib_core.boxes import boxes_text, labels_text, read_boxes, read_labels
from calib_core.boxes.formats.own import own_boxes
from calib_core.errors import InputError
from calib_core.measurements import Box, Boxes, Cuboid, FrameBoxes, LabelledScan, ReturnLabels, TimeNs

START_NS = 1_700_000_000_000_000_000
TIMES = START_NS + 100_000_000 * np.arange(10)
SIZE = (640, 480)
PERSON = Box(99.5, 49.5, 139.5, 149.5, "person")
"""Left 100, top 50, width 40, height 100 from the corner of the top-left pixel."""


def read(path: Path) -> Boxes:
    return read_boxes(path, image_times=TIMES, image_size_px=SIZE)


def only_boxes(boxes: Boxes) -> dict[int, tuple[Box, ...]]:
    """Return the boxes by the number of the recorded frame."""
    return {int(np.searchsorted(TIMES, frame.image_time)): frame.boxes for frame in boxes}


def write(folder: Path, name: str, content: Any) -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    return path


def coco(names: list[str], bbox: Any = (100, 50, 40, 100), **image: Any) -> dict[str, Any]:
    return {
        "images": [
            {"id": 7 + at, "file_name": name, "width": 640, "height": 480, **image} for at, name in enumerate(names)
        ],
        "annotations": [{"id": 1, "image_id": 7, "category_id": 3, "bbox": list(bbox), "iscrowd": 0}],
        "categories": [{"id": 3, "name": "person"}],
    }


@pytest.mark.parametrize(
    ("names", "frames"),
    [
        ([f"cam/{TIMES[2]}.png", f"cam/{TIMES[4]}.png"], [2, 4]),
        (["1700000000.200000.jpg", "1700000000.400000.jpg"], [2, 4]),
        (["1700000000_200000000.jpg", "1700000000_400000000.jpg"], [2, 4]),
        (["frame_000000.png", "frame_000003.png"], [0, 3]),
        (["0002_cam0.png", "0010_cam0.png"], [1, 9]),
    ],
)
def test_coco_images_are_found_by_stamp_or_number(tmp_path, names, frames):
    found = only_boxes(read(write(tmp_path, "instances.json", coco(names))))

    assert list(found) == frames
    assert found[frames[0]] == (PERSON,)
    assert found[frames[1]] == ()


NAMED = [f"{number:06}" for number in (549, 600, 877, 1201, 1202, 1203, 1204, 1205, 1206, 1207)]


@pytest.mark.parametrize("kind", ["coco", "yolo"])
def test_boxes_with_the_names_of_the_images_belong_to_them(tmp_path, kind):
    """A subset of a data set: its numbers do not count the recorded frames; labels of other images are left out."""
    names = [NAMED[2], NAMED[0], "004711"]
    if kind == "coco":
        path = write(tmp_path, "boxes.json", coco([f"image_2/{name}.png" for name in names]))
    else:
        path = tmp_path / "labels"
        for name in names:
            write(path, f"{name}.txt", "0 0.1875 0.2083 0.0625 0.2083")
    boxes = read_boxes(path, image_times=TIMES, image_size_px=SIZE, image_names=NAMED)
    assert [frame.image_time for frame in boxes] == [TIMES[0], TIMES[2]]
    assert any("2 annotated frames" in note and "1 others" in note for note in boxes.notes)


def test_coco_detections_are_found_by_number_and_keep_scores(tmp_path):
    detections = [
        {"image_id": 0, "category_id": 1, "bbox": [100, 50, 40, 100], "score": 0.25},
        {"image_id": 9, "category_id": 1, "bbox": [100, 50, 40, 100], "score": 0.5},
    ]
    boxes = read(write(tmp_path, "results.json", detections))

    assert {at: found[0].score for at, found in only_boxes(boxes).items()} == {0: 0.25, 9: 0.5}
    assert boxes.labels == ("1",)
    assert any("counts from 0" in note for note in boxes.notes)


def test_coco_of_a_video_keeps_tracks(tmp_path):
    document = coco(["a.png"], frame_id=0)
    document["annotations"][0]["attributes"] = {"track_id": 12}

    assert only_boxes(read(write(tmp_path, "video.json", document)))[0][0].track == "12"


@pytest.mark.parametrize("kind", ["folder", "zip"])
def test_yolo_folders_are_scaled_by_the_image(tmp_path, kind):
    folder = tmp_path / "data"
    write(folder, "data.yaml", "nc: 2\nnames: [car, person]\n")
    write(folder, "labels/000001.txt", "1 0.1875 0.208333333 0.0625 0.208333333 0.5 17\n")
    write(folder, "labels/000010.txt", "")
    path = folder
    if kind == "zip":
        path = tmp_path / "data.zip"
        with zipfile.ZipFile(path, "w") as archive:
            for file in folder.rglob("*.*"):
                archive.write(file, file.relative_to(folder))
    boxes = read(path)

    found = only_boxes(boxes)
    assert list(found) == [0, 9]
    assert found[9] == ()
    box = found[0][0]
    np.testing.assert_allclose(
        (box.left_px, box.top_px, box.right_px, box.bottom_px), (99.5, 49.5, 139.5, 149.5), atol=1e-5
    )
    assert (box.label, box.score, box.track) == ("person", 0.5, "17")


@pytest.mark.parametrize(
    ("line", "score", "track"),
    [
        ("0 0.5 0.5 0.1 0.1", 1.0, ""),
        ("0 0.5 0.5 0.1 0.1 0.75", 0.75, ""),
        ("0 0.5 0.5 0.1 0.1 4", 1.0, "4"),
        ("0 0.5 0.5 0.1 0.1 0.75 4", 0.75, "4"),
        ("0 0.45 0.45 0.55 0.45 0.55 0.55 0.45 0.55", 1.0, ""),
    ],
)
def test_yolo_lines_with_and_without_score_track_and_polygon(tmp_path, line, score, track):
    write(tmp_path, "labels/0.txt", line)
    box = only_boxes(read(tmp_path))[0][0]

    np.testing.assert_allclose((box.left_px, box.right_px), (287.5, 351.5), atol=1e-9)
    assert (box.score, box.track) == (score, track)


CVAT_VIDEO = """<?xml version="1.0" encoding="utf-8"?>
<annotations><version>1.1</version>
<meta><task><size>10</size><start_frame>0</start_frame><stop_frame>9</stop_frame>
<original_size><width>640</width><height>480</height></original_size></task></meta>
<track id="5" label="person">
<box frame="2" outside="0" keyframe="1" xtl="100" ytl="50" xbr="140" ybr="150"/>
<box frame="4" outside="0" keyframe="1" xtl="120" ytl="50" xbr="160" ybr="150"/>
<box frame="5" outside="1" keyframe="1" xtl="120" ytl="50" xbr="160" ybr="150"/>
<box frame="8" outside="0" keyframe="1" xtl="10" ytl="50" xbr="50" ybr="150"/>
</track></annotations>"""


def test_cvat_tracks_are_interpolated_and_end_where_the_object_leaves(tmp_path):
    boxes = read(write(tmp_path, "annotations.xml", CVAT_VIDEO))
    found = only_boxes(boxes)

    assert list(found) == list(range(10))
    assert {at: [box.left_px for box in inside] for at, inside in found.items() if inside} == {
        2: [99.5],
        3: [109.5],
        4: [119.5],
        8: [9.5],
        9: [9.5],
    }
    assert found[3][0].track == "5"
    assert boxes.image_size_px == SIZE


def test_cvat_images_are_found_by_name_and_turned_boxes_are_enclosed(tmp_path):
    text = (
        '<annotations><image id="0" name="frame_000000.png" width="640" height="480">'
        '<box label="person" xtl="100" ytl="50" xbr="140" ybr="150" occluded="0"/>'
        '<box label="sign" xtl="100" ytl="80" xbr="140" ybr="100" rotation="90"/>'
        '<polygon label="road" points="1,1;2,2;3,1"/></image></annotations>'
    )
    boxes = read(write(tmp_path, "annotations.xml", text))

    upright, turned = only_boxes(boxes)[0]
    assert upright == PERSON
    np.testing.assert_allclose(
        (turned.left_px, turned.top_px, turned.right_px, turned.bottom_px), (109.5, 69.5, 129.5, 109.5)
    )
    assert any(note.startswith("1 shapes") for note in boxes.notes)


KITTI_3D = "1.8 0.5 1.2 1.0 1.6 9.0 0.1"
CUBOID = Cuboid((1.0, pytest.approx(0.7), 9.0), 1.2, 0.5, math.pi / 2 - 0.1)


def test_kitti_tracks_keep_pixels_and_count_frames_between_as_empty(tmp_path):
    lines = [
        f"1 4 Pedestrian 0 0 -0.2 100.0 50.0 140.0 150.0 {KITTI_3D}",
        "1 -1 DontCare -1 -1 -10 0.0 0.0 9.0 9.0 -1 -1 -1 -1000 -1000 -1000 -10",
        f"3 4 Pedestrian 0 0 -0.2 110.0 50.0 150.0 150.0 {KITTI_3D}",
    ]
    found = only_boxes(read(write(tmp_path, "0004.txt", "\n".join(lines))))

    assert list(found) == [1, 2, 3]
    assert found[1] == (Box(100.0, 50.0, 140.0, 150.0, "Pedestrian", track="4", cuboid=CUBOID),)
    assert found[2] == ()


def test_kitti_objects_are_one_file_per_image(tmp_path):
    write(tmp_path, "label_2/000000.txt", f"Car 0.00 0 1.85 100.0 50.0 140.0 150.0 {KITTI_3D} 0.25")
    write(tmp_path, "label_2/000004.txt", "Van 0 0 -10 1.0 2.0 3.0 4.0 -1 -1 -1 -1000 -1000 -1000 -10")

    found = only_boxes(read(tmp_path))
    assert found[0] == (Box(100.0, 50.0, 140.0, 150.0, "Car", 0.25, cuboid=CUBOID),)
    assert found[4] == (Box(1.0, 2.0, 3.0, 4.0, "Van"),)


def openlabel(**frame: Any) -> dict[str, Any]:
    bbox = {"name": "shape", "val": [120, 100, 40, 100], "coordinate_system": "Camera"}
    objects = {"obj-1": {"object_data": {"bbox": [bbox]}}}
    return {
        "openlabel": {
            "metadata": {"schema_version": "1.0.0"},
            "objects": {"obj-1": {"name": "someone", "type": "person"}},
            "frames": {"0": {"objects": objects, **frame}, "1": {"objects": {}}},
        }
    }


def test_openlabel_with_cuboids_alone_is_refused_not_read_as_empty(tmp_path):
    content = openlabel()
    data = content["openlabel"]["frames"]["0"]["objects"]["obj-1"]["object_data"]
    data["cuboid"] = [{"name": "shape", "val": [9, 1, 0, 0, 0, 0, 1, 4, 2, 1.5]}]
    assert only_boxes(read(write(tmp_path, "both.json", json.dumps(content))))[0]
    del data["bbox"]
    with pytest.raises(InputError, match="has a cuboid and no bbox"):
        read(write(tmp_path, "cuboids.json", json.dumps(content)))


@pytest.mark.parametrize("form", ["matrix", "quaternion"])
def test_openlabel_cuboids_are_carried_to_the_camera_and_into_its_image(tmp_path, form):
    """The vehicle's x is ahead and z up; the camera is 1 m ahead of its origin and 2 m up, and looks ahead."""
    content = openlabel()
    root = content["openlabel"]
    lens = {"width_px": 640, "height_px": 480, "camera_matrix_3x4": [500, 0, 320, 0, 0, 500, 240, 0, 0, 0, 1, 0]}
    matrix = [0, 0, 1, 1, -1, 0, 0, 0, 0, -1, 0, 2, 0, 0, 0, 1]
    pose = {"matrix4x4": matrix}
    if form == "quaternion":
        pose = {"quaternion": [-0.5, 0.5, -0.5, 0.5], "translation": [1, 0, 2]}
    root["coordinate_systems"] = {
        "vehicle": {"type": "local_cs", "parent": "", "children": ["Camera"]},
        "Camera": {"type": "sensor_cs", "parent": "vehicle", "children": [], "pose_wrt_parent": pose},
    }
    root["streams"] = {"Camera": {"type": "camera", "stream_properties": {"intrinsics_pinhole": lens}}}
    data = root["frames"]["0"]["objects"]["obj-1"]["object_data"]
    values = [11, 1, 1, 0, 0, math.sin(0.25), math.cos(0.25), 4, 2, 1.5]  # turned by 0.5 rad to the left
    data["cuboid"] = [{"name": "shape", "val": values, "coordinate_system": "vehicle"}]
    cuboid = Cuboid((pytest.approx(-1.0), pytest.approx(1.0), pytest.approx(10.0)), 4.0, 2.0, pytest.approx(0.5))
    drawn = only_boxes(read(write(tmp_path, "both.json", content)))[0]
    assert [(box.left_px, box.cuboid) for box in drawn] == [(99.5, cuboid)]

    del data["bbox"]
    (box,) = only_boxes(read(write(tmp_path, "cuboids.json", content)))[0]
    corners = np.array([[x, y] for x in (-2.0, 2.0) for y in (-1.0, 1.0)])
    ahead = 10.0 + corners @ [math.cos(0.5), -math.sin(0.5)]
    left = 1.0 + corners @ [math.sin(0.5), math.cos(0.5)]
    assert (box.left_px, box.right_px) == pytest.approx(
        (320 - 500 * (left / ahead).max(), 320 - 500 * (left / ahead).min())
    )
    assert (box.top_px, box.bottom_px) == pytest.approx(
        (240 + 500 * 0.25 / ahead.max(), 240 + 500 * 1.75 / ahead.min())
    )
    assert (box.label, box.track, box.cuboid) == ("person", "obj-1", cuboid)


@pytest.mark.parametrize("direction", ["vehicle to odom", "odom to vehicle"])
def test_openlabel_cuboids_follow_the_vehicle_that_moves_from_frame_to_frame(tmp_path, direction):
    """The object stands at (31, 1, 1) of the ground; the vehicle is at (20, 0, 0) in frame 0, at (26, 0, 0) in frame 1."""
    content = openlabel()
    root = content["openlabel"]
    ahead = {"matrix4x4": [0, 0, 1, 1, -1, 0, 0, 0, 0, -1, 0, 2, 0, 0, 0, 1]}
    root["coordinate_systems"] = {
        "odom": {"parent": ""},
        "vehicle": {"parent": "odom", "pose_wrt_parent": {"quaternion": [0, 0, 0, 1], "translation": [0, 0, 0]}},
        "Camera": {"parent": "vehicle", "pose_wrt_parent": ahead},
    }
    cuboid = {"val": [31, 1, 1, 0, 0, 0, 1, 4, 2, 1.5], "coordinate_system": "odom"}
    root["frames"]["0"]["objects"]["obj-1"]["object_data"]["cuboid"] = [cuboid]
    root["frames"]["1"] = json.loads(json.dumps(root["frames"]["0"]))
    source, target = direction.split(" to ")
    sign = 1 if target == "odom" else -1
    for number, way_m in (("0", 20), ("1", 26)):
        pose = {"quaternion": [0, 0, 0, 1], "translation": [sign * way_m, 0, 0]}
        moved = {"src": source, "dst": target, "transform_src_to_dst": pose}
        root["frames"][number]["frame_properties"] = {"transforms": {"moved": moved}}

    found = only_boxes(read(write(tmp_path, "moving.json", content)))
    assert [found[number][0].cuboid.centre_camera_m for number in (0, 1)] == [
        pytest.approx((-1, 1, 10)),
        pytest.approx((-1, 1, 4)),
    ]

    for number in ("0", "1"):
        del root["frames"][number]["objects"]["obj-1"]["object_data"]["bbox"]
    del root["frames"]["1"]["frame_properties"]
    root["streams"] = {"Camera": {"stream_properties": {"intrinsics_pinhole": {"width_px": 640, "height_px": 480}}}}
    lens = root["streams"]["Camera"]["stream_properties"]["intrinsics_pinhole"]
    lens["camera_matrix_3x4"] = [500, 0, 320, 0, 0, 500, 240, 0, 0, 0, 1, 0]
    with pytest.raises(InputError, match=r"frames\.1\..* does not state the poses in this frame"):
        read(write(tmp_path, "one frame.json", content))
    root["frames"]["0"]["frame_properties"]["transforms"]["moved"] |= {"src": "odom", "dst": "Camera"}
    with pytest.raises(InputError, match="a transform leads from odom to Camera"):
        read(write(tmp_path, "past a parent.json", content))


def nuscenes(folder: Path, **changed: Any) -> Path:
    """Write the tables of one keyframe of two cameras, with one car 10 m ahead of the vehicle, which drives north at (5, 50)."""
    poses = {"translation": [1, 0, 2], "rotation": [0.5, -0.5, 0.5, -0.5]}
    lens = [[500, 0, 320], [0, 500, 240], [0, 0, 1]]
    image = {"sample_token": "s", "ego_pose_token": "e", "calibrated_sensor_token": "c", "is_key_frame": True}
    image |= {"timestamp": 1_700_000_000_200_000, "width": 640, "height": 480}
    half = math.sqrt(0.5)
    tables = {
        "sample_data": [
            image | {"token": "front", "filename": "samples/CAM_FRONT/n__CAM_FRONT__1700000000200000.jpg"},
            image | {"token": "back", "filename": "samples/CAM_BACK/n__CAM_BACK__1700000000200000.jpg"},
            image | {"token": "sweep", "filename": "sweeps/CAM_FRONT/x.jpg", "is_key_frame": False},
            {"token": "radar", "filename": "samples/RADAR_FRONT/r.pcd", "is_key_frame": True, "width": 0},
        ],
        "calibrated_sensor": [{"token": "c", "sensor_token": "k", "camera_intrinsic": lens, **poses}],
        "ego_pose": [{"token": "e", "translation": [5, 50, 0], "rotation": [half, 0, 0, half]}],
        "sample_annotation": [
            {
                "token": "a",
                "sample_token": "s",
                "instance_token": "i",
                "translation": [4, 61, 1],
                "rotation": [half, 0, 0, half],
                "size": [2, 4, 1.5],
            }
        ],
        "instance": [{"token": "i", "category_token": "v"}],
        "category": [{"token": "v", "name": "vehicle.car"}],
    }
    for name, rows in (tables | changed).items():
        write(folder, f"v1.0-mini/{name}.json", rows)
    return folder


def test_nuscenes_cuboids_are_carried_from_the_map_into_the_images_of_the_recorded_camera(tmp_path):
    names = [f"n__CAM_FRONT__{time // 1000}" for time in TIMES]
    found = only_boxes(read_boxes(nuscenes(tmp_path), image_times=TIMES, image_size_px=SIZE, image_names=names))
    assert list(found) == [2]
    (box,) = found[2]
    middle = (pytest.approx(-1.0), pytest.approx(1.0), pytest.approx(10.0))
    assert box.cuboid == Cuboid(middle, 4.0, 2.0, pytest.approx(0.0))
    edges = (320 - 500 * 2 / 8, 240 + 500 * 0.25 / 12, 320.0, 240 + 500 * 1.75 / 8)
    assert (box.left_px, box.top_px, box.right_px, box.bottom_px) == pytest.approx(edges)
    assert (box.label, box.track) == ("vehicle.car", "i")


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"category": {}}, "category.json: expected a list of rows"),
        ({"instance": []}, "names a row of instance.json that is not there"),
        ({"ego_pose": [{"token": "e", "translation": [5, 50, 0], "rotation": [0, 0, 0, 0]}]}, "not a rotation"),
        ({"calibrated_sensor": [{"token": "c", "translation": [0] * 3, "rotation": [1, 0, 0, 0]}]}, "camera_intrinsic"),
        ({"ego_pose": [{"token": "e"}, 7]}, "something else after 1 of them"),
        ({"ego_pose": [{"token": 7}]}, "a list of rows with a token each"),
        ({"sample_data": []}, "none of its 0 images of keyframes is a recorded frame"),
    ],
)
def test_nuscenes_tables_that_do_not_fit_are_refused(tmp_path, changed, words):
    names = [f"n__CAM_FRONT__{time // 1000}" for time in TIMES]
    with pytest.raises(InputError, match=words):
        read_boxes(nuscenes(tmp_path, **changed), image_times=TIMES, image_size_px=SIZE, image_names=names)


@pytest.mark.slow
def test_nuscenes_tables_of_the_whole_set_are_read_row_by_row(tmp_path):
    """Rows end anywhere in the pieces that are read, braces and brackets in texts are texts, and a cut table is refused."""
    folder = nuscenes(tmp_path)
    poses = folder / "v1.0-mini" / "ego_pose.json"
    wanted = json.loads(poses.read_text())
    rows = [{"token": f"{place}]}}{{[", "rotation": [1.0, 0.0, 0.0, 0.0]} for place in range(40_000)]
    poses.write_text(json.dumps([*rows, *wanted], indent=0))
    names = [f"n__CAM_FRONT__{time // 1000}" for time in TIMES]
    assert poses.stat().st_size > 2 << 20
    assert len(only_boxes(read_boxes(folder, image_times=TIMES, image_size_px=SIZE, image_names=names))[2]) == 1

    poses.write_text(poses.read_text()[:-40])
    with pytest.raises(InputError, match="something else after 40,000 of them"):
        read_boxes(folder, image_times=TIMES, image_size_px=SIZE, image_names=names)


def test_one_table_of_nuscenes_alone_says_to_give_its_folder(tmp_path):
    with pytest.raises(InputError, match="give the folder with all tables"):
        read(nuscenes(tmp_path) / "v1.0-mini" / "sample_annotation.json")


def test_openlabel_boxes_are_given_by_their_centre(tmp_path):
    found = only_boxes(read(write(tmp_path, "labels.json", openlabel())))

    assert found == {0: (Box(99.5, 49.5, 139.5, 149.5, "person", track="obj-1"),), 1: ()}


def test_openlabel_frames_are_found_by_their_stamps(tmp_path):
    document = openlabel(frame_properties={"timestamp": "2023-11-14T22:13:20.300Z"})
    del document["openlabel"]["frames"]["1"]

    assert list(only_boxes(read(write(tmp_path, "labels.json", document)))) == [3]


OTHER = "is it of another recording?"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (coco([f"{START_NS - 10**12}.png"]), OTHER),
        (coco([f"{TIMES[3] + 40_000_000}.png"]), OTHER),
        (coco(["000400.png", "000000.png"]), "frames numbered 0 to 400, which do not fit the recording's 10 frames"),
        (coco(["0.png"], width=1920, height=1080), "made on images of 1920 x 1080 px"),
        (coco(["0.png"], bbox=(1000, 50, 40, 100)), "1 of 1 boxes lie outside the image of 640 x 480 px"),
        (coco(["0.png"], bbox=(100, 50, -40, 100)), "annotations[0].bbox: the right or lower edge"),
        (coco(["0.png"], bbox=(100, 50, "wide", 100)), "annotations[0].bbox: expected a number, found 'wide'"),
        (
            coco(["left.png", "0.png"]) | {"annotations": [{"image_id": 99}]},
            "annotations[0].image_id: there is no image 99",
        ),
        (coco([]) | {"annotations": []}, "has no annotated frame"),
        (CVAT_VIDEO.replace("<size>10<", "<size>99<"), "a sequence of 99 frames, the recording has 10"),
        (CVAT_VIDEO.replace('xtl="10"', 'xtl="left"'), "track 5, frame 8: xtl: expected a number"),
        ("<!DOCTYPE x><annotations/>", "declares a document type"),
        ("<annotations>", "not XML"),
        ("{", "not JSON"),
        ({"schema": "cocalib/boxes-2"}, "expected 'cocalib/boxes-1'"),
        ({"some": "thing"}, "is no known file of boxes; known: our boxes-1, OpenLABEL"),
        ("some text", "is no known file of boxes"),
        ("", "is no known file of boxes"),
    ],
)
def test_files_that_cannot_be_these_frames_are_refused(tmp_path, content, words):
    with pytest.raises(InputError) as error:
        read(write(tmp_path, "file.json", content))
    assert words in str(error.value)


def test_folders_without_boxes_and_damaged_archives_are_refused(tmp_path):
    for path, words in (
        (tmp_path / "missing.json", "no such file or folder"),
        (tmp_path, "has no file of boxes"),
        (write(tmp_path, "damaged.zip", "PK\x03\x04 and nothing else"), "a damaged zip archive"),
    ):
        with pytest.raises(InputError) as error:
            read(path)
        assert words in str(error.value)


def test_frames_that_the_recording_lacks_are_left_out_and_counted(tmp_path):
    names = [f"{START_NS - 10**12}.png", *(f"{time}.png" for time in TIMES[:3])]
    boxes = read(write(tmp_path, "instances.json", coco(names)))

    assert list(only_boxes(boxes)) == [0, 1, 2]
    assert any(note.startswith("1 of 4 annotated") for note in boxes.notes)


# boxes-1 and labels-1: what is written comes back, and what is wrong is said with its place.


FRAME_TIMES = st.integers(0, 4_000_000_000_000_000_000).map(TimeNs)
EDGES = st.floats(-1e6, 1e6)
NAMES = st.text(st.characters(blacklist_categories=("Cs",)), max_size=20)


@st.composite
def one_box(draw: st.DrawFn) -> Box:
    left_px, right_px = sorted((draw(EDGES), draw(EDGES)))
    top_px, bottom_px = sorted((draw(EDGES), draw(EDGES)))
    return Box(left_px, top_px, right_px, bottom_px, draw(NAMES), draw(st.floats(0, 1)), draw(NAMES))


FRAMES = st.dictionaries(FRAME_TIMES, st.lists(one_box(), max_size=3), max_size=4)
SIZES = st.none() | st.tuples(st.integers(1, 8000), st.integers(1, 8000))


@given(FRAMES, SIZES)
def test_boxes_that_are_written_come_back(frames, size):
    boxes = Boxes(tuple(FrameBoxes(time, tuple(frames[time])) for time in sorted(frames)), "boxes.json", size)

    assert own_boxes(json.loads(boxes_text(boxes)), "boxes.json") == boxes


@given(st.dictionaries(FRAME_TIMES, st.lists(NAMES, max_size=5), max_size=4))
def test_labels_that_are_written_come_back(scans):
    labels = ReturnLabels(tuple(LabelledScan(time, tuple(scans[time])) for time in sorted(scans)), "labels.json")

    assert read_labels(labels_text(labels), "labels.json") == labels


FRAME = {"image_time": {"sec": 5, "nanosec": 0}, "boxes": [{"label": "person", "box_px": [1, 2, 3, 4]}]}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"schema": "cocalib/boxes-2"}, "schema: expected 'cocalib/boxes-1', found 'cocalib/boxes-2'"),
        ({"frames": [FRAME, FRAME]}, "frames[0] and frames[1] have the same stamp"),
        ({"frames": [{**FRAME, "boxes": [{"box_px": [3, 2, 1, 4]}]}]}, "frames[0].boxes[0].box_px: expected left, top"),
        ({"frames": [{**FRAME, "boxes": [{"box_px": [3, 2, 9]}]}]}, "frames[0].boxes[0].box_px"),
        ({"frames": [{**FRAME, "boxes_": []}]}, "unknown key; did you mean boxes?"),
        ({"frames": [{**FRAME, "boxes": [{"box_px": [1, 2, 3, float("nan")]}]}]}, "box_px[3]: nan"),
        ({"image_size_px": [0, 4]}, "image_size_px"),
    ],
)
def test_what_is_wrong_is_said_with_its_place(change, words):
    document = {"schema": "cocalib/boxes-1", "image_size_px": [640, 480], "frames": [FRAME], **change}

    with pytest.raises(InputError) as error:
        own_boxes(document, "boxes.json")
    assert words in str(error.value)
