"""Read a file whose numbers do not state what they mean, and take the meaning that is clear or that a person picks."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import PurePath

import numpy as np

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.cameras.camera_format import FoundCamera
from calib_core.interchange.cameras.fields import find_cameras
from calib_core.interchange.check.pair_residuals import CheckPairs
from calib_core.interchange.format import (
    ImportedCalibration,
    WrittenPose,
    looks_like_camera,
    looks_like_lidar,
    of_lidar,
)
from calib_core.interchange.formats.mat import MATLAB
from calib_core.interchange.formats.named_arrays import NUMPY
from calib_core.interchange.formats.opencv import OPENCV
from calib_core.interchange.formats.registry import reader_of
from calib_core.interchange.formats.text_matrix import MATRIX
from calib_core.interchange.hypotheses.finding import find_poses
from calib_core.interchange.hypotheses.found_poses import FoundPose, Unreadable, hints_of
from calib_core.interchange.hypotheses.plain_values import array_of, plain_values
from calib_core.interchange.hypotheses.ranking import Hypothesis, clear_one, hypotheses_of
from calib_core.interchange.importing import read_any
from calib_core.interchange.statement import stated_frames
from calib_core.interchange.syntax.content import Content, readings

_BARE = (MATRIX.reads, NUMPY, MATLAB.reads, OPENCV.reads)
_SHOWN = 8

BARE_POSE = "bare pose"
"""What such a file is called where others have the name of their format."""


@dataclass(frozen=True, slots=True)
class UnstatedFile:
    """A file with numbers that can be a pose, and no statement of what they mean.

    Attributes:
        source: its name, for error messages.
        poses: what was found, in file order; at least one.
        unreadable: what has the shape of a pose and is none.
        camera: the camera in it, before any check; None if it has none or several.
        beside: the camera in the innermost object around a pose, by the pose's place.
    """

    source: str
    poses: tuple[FoundPose, ...]
    unreadable: tuple[Unreadable, ...] = ()
    camera: FoundCamera | None = None
    beside: Mapping[str, FoundCamera] = field(default_factory=dict)

    def pose_at(self, place: str | None) -> FoundPose:
        """Return the pose at a place, or the only one below a name.

        If none is given, it is the only one, or the only one whose names mention a radar, or beside which a camera is.

        Raises:
            InputError: there is none there, or there are several to choose from.
        """
        places = [pose.place for pose in self.poses]
        named = ", ".join(repr(one) for one in places[:_SHOWN]) + (", ..." if len(places) > _SHOWN else "")
        if place is None:
            radars = [pose.place for pose in self.poses if pose.hints.names_radar]
            for few in (places, radars, [one for one in radars or places if one in self.beside]):
                if len(few) == 1:
                    self._refuse_common_frame(few[0])
                    return self.poses[places.index(few[0])]
            raise InputError(f"{self.source}: contains {len(places)} poses; choose one with --pose NAME: {named}")
        below = [one for one in places if place in (one, *one.split("."))]
        if place not in places and len(below) == 1:
            place = below[0]
        if place not in places:
            raise InputError(f"{self.source}: no pose at {place!r}; there is one at {named}")
        return self.poses[places.index(place)]

    def _refuse_common_frame(self, place: str) -> None:
        """Refuse the pose of a radar if a camera has one, too.

        Raises:
            InputError: it has.
        """
        cameras = [pose.place for pose in self.poses if _is_of_camera_alone(pose)] or [*self.beside]
        between = any(pose.place == place and any(map(looks_like_camera, pose.names)) for pose in self.poses)
        if cameras and place not in cameras and not between:
            raise InputError(
                f"{self.source}: {place} and {cameras[0]} are the poses of a radar and of a camera in a frame that both share: "
                "cocalib import composes them if their numbers can mean one thing only; or take one as it is with --pose NAME"
            )


def _is_of_camera_alone(pose: FoundPose) -> bool:
    others = pose.hints.names_radar or any(map(looks_like_lidar, pose.names))
    return not others and any(map(looks_like_camera, pose.names))


def read_unstated(content: str | bytes, source: str = "calibration") -> UnstatedFile | None:
    """Return the poses in a file that states nothing about them; None if the file is of a known format, which says what it means.

    Raises:
        InputError: it is of no known format, and nothing in it can be a pose; or what could be one is none.
    """
    unreadable: tuple[Unreadable, ...] = ()
    for reading in readings(content, source=source):
        reader = reader_of(reading)
        if (
            reader is not None
            and not (reader in _BARE and _states_nothing(reading))
            and array_of(reading.value) is None
        ):
            return None
        values = plain_values(reading, source=source)
        found = find_poses(values)
        if found.poses:
            stem = PurePath(source).name.partition(".")[0]
            poses = tuple(_hinted_by_name(pose, stem) for pose in found.poses)
            around = {pose.place: _camera_in(_object_around(pose.place, values), source) for pose in poses}
            beside = {place: camera for place, camera in around.items() if camera is not None}
            return UnstatedFile(source, poses, found.unreadable, _camera_in(values, source), beside)
        unreadable = found.unreadable or unreadable
    if unreadable:
        raise InputError(f"{source}: {unreadable[0].place}: {unreadable[0].fault}; correct it there")
    return None


def _states_nothing(content: Content) -> bool:
    """Return whether content that a bare format recognizes names no frames."""
    if content.syntax == "archive":
        return "radar_frame.npy" not in content.members
    if content.syntax == "mat":
        return not isinstance(content.variables.get("frames"), dict)
    return stated_frames(content.text) is None and not content.mapping.get("radar_frame")


def _hinted_by_name(pose: FoundPose, stem: str) -> FoundPose:
    """Let the file's name hint at the sensors and the direction if no name inside does."""
    named, hints = hints_of([stem]), pose.hints
    if not hints.other and not hints.names_radar and looks_like_lidar(named.other):
        hints = replace(hints, other=named.other)
    if hints.carries_radar == hints_of([]).carries_radar:
        hints = replace(hints, carries_radar=named.carries_radar)
    return pose.with_hints(hints)


def _object_around(place: str, values: object) -> object:
    """Return the innermost object around a place such as sensors.front.T."""
    for key in place.replace("[", ".").replace("]", "").split(".")[:-1]:
        if isinstance(values, list) and key.isdecimal() and int(key) < len(values):
            values = values[int(key)]
        else:
            values = values.get(key) if isinstance(values, dict) else None
    return values


def _camera_in(values: object, source: str) -> FoundCamera | None:
    """Return the only camera in a file's values."""
    if not isinstance(values, dict):
        return None
    try:
        cameras = find_cameras(values, source=source)
    except InputError:  # a key like a camera's with something else in it; the pose does not depend on it
        return None
    return cameras[0] if len(cameras) == 1 and not cameras[0].refused else None


def picked(hypotheses: tuple[Hypothesis, ...], wanted: str, source: str) -> Hypothesis:
    """Return the hypothesis that a person picks by its key, or by as many parts of it as are needed.

    Raises:
        InputError: there is none with these parts, or there are several.
    """
    parts = {part.strip() for part in wanted.split(",") if part.strip()}
    fitting = [
        hypothesis for hypothesis in hypotheses if any(parts <= set(meaning.parts) for meaning in hypothesis.meanings)
    ]
    exact = [one for one in fitting if any(parts == set(meaning.key.split(",")) for meaning in one.meanings)]
    if len(exact) == 1:
        return exact[0]
    if len(fitting) == 1 and parts:
        return fitting[0]
    keys = ", ".join(one.key for one in (fitting or hypotheses)[:_SHOWN])
    what = "several meanings have" if fitting else "no meaning has"
    raise InputError(f"{source}: {what} the parts {wanted!r}; pick one with --as: {keys}")


def as_imported(file: UnstatedFile, pose: FoundPose, chosen: Hypothesis, *, by_hand: bool) -> ImportedCalibration:
    """Return a hypothesis as a calibration read from the file, with what was assumed.

    Args:
        file: what was read.
        pose: the one whose meaning was chosen.
        chosen: the meaning.
        by_hand: whether a person picked it; otherwise it is the only plausible one.

    Raises:
        InputError: the camera in the file is invalid.
    """
    how = "picked by hand" if by_hand else "the only plausible meaning of the numbers"
    where = "" if pose.place == "the file" else f" at {pose.place}"
    meaning = chosen.meanings[0]
    lidar = (of_lidar(pose.hints.other),) if looks_like_lidar(pose.hints.other) else ()
    camera, matrix_px = _camera(file, pose)
    return ImportedCalibration(
        BARE_POSE,
        WrittenPose(
            "matrix", chosen.camera_from_radar.rotation, chosen.camera_from_radar.translation_m, "camera_from_radar"
        ),
        camera=camera,
        matrix_px=matrix_px,
        notes=_notes(file, pose),
        assumptions=(
            *lidar,
            f"the file does not state what its pose{where} means; {how}: {meaning.words} ({meaning.key})",
        ),
    )


def _notes(file: UnstatedFile, pose: FoundPose) -> tuple[str, ...]:
    """Return what else is in the file."""
    notes = [f"not read: {one.place}: {one.fault}" for one in file.unreadable[:_SHOWN]]
    if len(file.poses) > 1:
        notes.append(f"{pose.place} was read, one of {len(file.poses)} poses in the file")
    return tuple(notes)


def read_clear(content: str | bytes, source: str = "calibration") -> ImportedCalibration:
    """Read a calibration of any known format, or one that states nothing if only one meaning of its numbers is plausible.

    Raises:
        InputError: it contains no pose, or several, or its numbers may mean several things.
    """
    file = read_unstated(content, source)
    if file is None:
        return read_any(content, source)
    pose = file.pose_at(None)
    hypotheses = hypotheses_of(pose)
    clear = clear_one(pose, hypotheses)
    if clear is None:
        keys = " or ".join(hypothesis.key for hypothesis in hypotheses[:2])
        raise InputError(
            f"{source}: does not state what its numbers mean ({keys}, for example); pick it with cocalib import FILE --as MEANING"
        )
    return as_imported(file, pose, clear, by_hand=False)


def clear_meaning(
    content: str | bytes, source: str, *, pairs: CheckPairs | None = None, against: ImportedCalibration | None = None
) -> ImportedCalibration | None:
    """Return what the one pose in a file that states nothing must mean; None if the file states it, or if it is not clear.

    Args:
        content: of the file.
        source: its name.
        pairs: radar positions and the pixels where they were seen; they decide where meanings differ.
        against: a calibration of the same sensors that is known to be right; likewise.

    Raises:
        InputError: it is of no known format, and nothing in it can be a pose.
    """
    file = read_unstated(content, source)
    if file is None or len(file.poses) > 1:
        return None
    other = None if against is None else against.camera_from_radar
    clear = clear_one(file.poses[0], hypotheses_of(file.poses[0], pairs=pairs, against=other))
    return None if clear is None else as_imported(file, file.poses[0], clear, by_hand=False)


def _camera(file: UnstatedFile, pose: FoundPose) -> tuple[Camera | None, np.ndarray | None]:
    """Return the camera in the file, or its matrix alone if the size of its images is not stated.

    Raises:
        InputError: a parameter is invalid.
    """
    camera = file.beside.get(pose.place, file.camera)
    if camera is None:
        return None, None
    if camera.size_px is not None:
        return camera.camera(image_size_px=None, source=file.source), None
    return None, None if any(camera.distortion) else np.reshape(camera.matrix_px, (3, 3))
