"""A layout for Foxglove that opens with the returns drawn on the picture, and in 3D."""

import json
from collections.abc import Sequence

_POINT_PX = 8
_3D_POINT_PX = 5
_NEAR_M, _FAR_M = 0, 60


def foxglove_layout(*, image_topic: str, info_topic: str, cloud_topics: Sequence[str], camera: str, radar: str) -> str:
    """Return the layout as JSON.

    Args:
        image_topic: the pictures.
        info_topic: their intrinsics.
        cloud_topics: the returns to draw; the others of the recording are hidden.
        camera: the optical frame.
        radar: the radar's frame, which the 3D view follows.
    """
    image = {
        "foxglovePanelTitle": "Radar returns on the picture",
        "imageMode": {
            "imageTopic": image_topic,
            "calibrationTopic": info_topic,
            "rectifyImage": True,
            "annotations": {},
        },
        "scene": {"transforms": {"showLabel": False, "enablePreloading": True}},
        "topics": {topic: _points(_POINT_PX) for topic in cloud_topics},
        "layers": {},
        "synchronize": False,
    }
    grid = {
        "layerId": "foxglove.Grid",
        "instanceId": "grid",
        "frameId": radar,
        "visible": True,
        "size": 40,
        "divisions": 40,
    }
    scene = {
        "foxglovePanelTitle": "Radar and camera",
        "cameraState": {
            "perspective": True,
            "distance": 25,
            "phi": 60,
            "thetaOffset": 90,
            "target": [0, 0, 0],
            "targetOffset": [8, 0, 0],
            "targetOrientation": [0, 0, 0, 1],
            "fovy": 45,
            "near": 0.1,
            "far": 1000,
        },
        "followMode": "follow-pose",
        "followTf": radar,
        "scene": {"transforms": {"enablePreloading": True}},
        "transforms": {f"frame:{frame}": {"visible": True} for frame in (radar, camera)},
        "topics": {
            **{topic: _points(_3D_POINT_PX) for topic in cloud_topics},
            info_topic: {"visible": True, "distance": 3},
            image_topic: {"visible": True, "cameraInfoTopic": info_topic, "distance": 3},
        },
        "layers": {"grid": grid},
    }
    layout = {
        "configById": {"Image!cocalib": image, "3D!cocalib": scene},
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": {"direction": "row", "first": "Image!cocalib", "second": "3D!cocalib", "splitPercentage": 62},
    }
    return json.dumps(layout, indent=2) + "\n"


def _points(size_px: int) -> dict[str, object]:
    """Draw points coloured by the distance forward."""
    return {
        "visible": True,
        "pointSize": size_px,
        "pointShape": "circle",
        "colorMode": "colormap",
        "colorMap": "turbo",
        "colorField": "x",
        "minValue": _NEAR_M,
        "maxValue": _FAR_M,
    }
