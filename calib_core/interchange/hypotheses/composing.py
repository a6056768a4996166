"""Compose poses that name their frames, of one file or of several, to the pose between a radar and a camera.

Data sets publish a pose for each sensor in a common frame (Astyx, aiMotive), or the poses of a radar and of a camera against a
third sensor (Boreas). Which frames a pose connects is in its names: T_camera_lidar and camera_from_lidar carry lidar points into
the camera, lidar_to_camera and lidar2camera likewise; a pose below a sensor's name carries its points into the frame of all.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import PurePath

from calib_core.geometry import RigidTransform
from calib_core.interchange.format import (
    ImportedCalibration,
    WrittenPose,
    looks_like_camera,
    looks_like_lidar,
    looks_like_radar,
)
from calib_core.interchange.hypotheses.found_poses import FoundPose
from calib_core.interchange.hypotheses.reading import UnstatedFile, read_unstated
from calib_core.interchange.trees.frame_choice import WantedFrames, choose_frames, is_of_camera, is_of_radar
from calib_core.interchange.trees.frame_tree import FrameTree, Joint, Place, Sensor
from calib_core.interchange.trees.posed_in_tree import calibration_in_tree
from calib_core.interchange.trees.reading import TreeFile

_KIND = re.compile(r"^(?:tr|rt|tf|[trhm]|calib|pose|extrinsics?)(?:_|(?=to_))", re.IGNORECASE)
_DIRECTIONS = (
    re.compile(r"(?P<target>\w*?)_?(?:from|wrt)_?(?P<source>\w+)", re.IGNORECASE),
    re.compile(r"(?P<source>\w*?)_?(?:to_?|2)(?P<target>[a-z]\w*)", re.IGNORECASE),
)
_BESIDE_EACH_OTHER = re.compile(r"(?P<target>[a-z]+\d*)_(?P<source>[a-z]+\d*)", re.IGNORECASE)
_ANY_SENSOR = ("", "sensor")
_COMMON = "the common frame"
_SURE = 0.9


@dataclass(frozen=True, slots=True, eq=False)
class _Link:
    """A pose with the frames that it connects: target_from_source."""

    target: str
    source: str
    pose: RigidTransform
    place: Place

    def turned_round(self) -> "_Link":
        return replace(self, target=self.source, source=self.target, pose=self.pose.inverse())


def read_composed(files: Sequence[TreeFile], wanted: WantedFrames) -> ImportedCalibration | None:
    """Return the pose between a radar and a camera that several poses make; None if the files are of known formats, or their
    poses do not connect a radar with a camera by their names.

    Args:
        files: of the calibration.
        wanted: the frames that the user names.

    Raises:
        InputError: a file cannot be read, or there are several radars or cameras to choose from.
    """
    unstated = [read_unstated(file.data, file.source) for file in files]
    found = [file for file in unstated if file is not None]
    if len(found) < len(files) or sum(len(file.poses) for file in found) < 2:
        return None
    sensors: list[Sensor] = []
    links = [link for file in found for pose in file.poses for link in _links(pose, file, sensors)]
    tree = FrameTree(tuple(_joints(links)), tuple(sensors), "composed poses")
    has_both = all(any(is_of(tree, frame) for frame in tree.frames) for is_of in (is_of_radar, is_of_camera))
    if not links or not (wanted.is_given or has_both):
        return None
    source = ", ".join(file.source for file in files)
    chosen = choose_frames(tree, wanted, source=source)
    composed = calibration_in_tree(tree, WantedFrames(chosen.radar, chosen.camera), source=source)
    used = {step.joint.place for step in tree.path(chosen.radar, chosen.camera)}
    said = "; ".join(f"{link.place} carries {link.source} into {link.target}" for link in links if link.place in used)
    note = f"the poses do not state what they mean; taken by their names: {said}"
    return replace(composed, assumptions=(*composed.assumptions, note))


def _links(pose: FoundPose, file: UnstatedFile, sensors: list[Sensor]) -> Iterator[_Link]:
    """Yield the pose with its frames if its names say them; note its camera matrix, if one stands beside it."""
    reading = max(pose.readings, key=lambda one: one.turned.weight)
    ends = _ends(pose, PurePath(file.source).name.partition(".")[0], alone=len(file.poses) == 1)
    if ends is None or reading.turned.weight < _SURE:
        return
    target, source = ends
    lens, camera = file.beside.get(pose.place), next(filter(looks_like_camera, ends), None)
    if lens is not None and camera is not None:
        sensors.append(Sensor(camera, "camera", None, lens))
    place = Place(file.source if len(file.poses) == 1 else f"{file.source}, {pose.place}")
    yield _Link(target, source, RigidTransform(reading.turned.rotation, reading.translation), place)


def _ends(pose: FoundPose, stem: str, *, alone: bool) -> tuple[str, str] | None:
    """Return the target and the source of a pose, the innermost name first; None if its names do not say them."""
    sensor = next((name for name in reversed(pose.names) if _is_sensor(name)), "")
    for name in (*reversed(pose.names), *((stem,) if alone else ())):
        bare = _KIND.sub("", name)
        found = next((match for pattern in _DIRECTIONS if (match := pattern.fullmatch(bare))), None)
        if found is None and bare != name and all(map(_is_sensor, bare.split("_"))):
            found = _BESIDE_EACH_OTHER.fullmatch(bare)
        if found is not None:
            target, source = (sensor if end in _ANY_SENSOR else end for end in (found["target"], found["source"]))
            return (target, source) if target and source else None
    return (_COMMON, sensor) if sensor else None


def _is_sensor(name: str) -> bool:
    return looks_like_radar(name) or looks_like_camera(name) or looks_like_lidar(name)


def _joints(links: Sequence[_Link]) -> Iterator[Joint]:
    """Yield the poses as joints of trees, each reached frame below the one that it was reached from."""
    left = list(links)
    reached: list[str] = []
    while left:
        reached.append(left[0].target)
        for frame in reached:
            for link in [one for one in left if frame in (one.target, one.source)]:
                left.remove(link)
                below = link if link.target == frame else link.turned_round()
                numbers = WrittenPose("matrix", below.pose.rotation, below.pose.translation_m, "radar_from_camera")
                yield Joint.posed(below.target, below.source, numbers, below.place)
                reached.append(below.source)
