"""Which frames of a tree are the radar's and the camera's: as the user says, as the files say, or by their names."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Literal

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.format import looks_like_camera, looks_like_radar
from calib_core.interchange.trees.frame_tree import FrameTree

_FIXTURE = re.compile(r"mount|bracket|holder|support|housing|plate|base|rig|bar\b|rack|mast", re.IGNORECASE)
_NO_IMAGES = re.compile(r"imu|gyro|accel|lidar|velodyne|laser|gps|gnss", re.IGNORECASE)
_SAME = 1e-6


@dataclass(frozen=True, slots=True)
class WantedFrames:
    """The frames that the user names; None where the choice is left to the names in the tree."""

    radar: str | None = None
    camera: str | None = None

    @property
    def is_given(self) -> bool:
        """Whether the user names any."""
        return self.radar is not None or self.camera is not None


@dataclass(frozen=True, slots=True)
class ChosenFrames:
    """The radar's and the camera's frame in a tree, and how the choice was made, one sentence each."""

    radar: str
    camera: str
    notes: tuple[str, ...] = ()


def choose_frames(tree: FrameTree, wanted: WantedFrames, *, source: str) -> ChosenFrames:
    """Choose the radar's frame and the camera's.

    Args:
        tree: of the files.
        wanted: what the user names.
        source: the name of the files, for messages.

    Raises:
        InputError: a name is not in the tree, or there is not exactly one radar and one camera; the message lists them.
    """
    radars = (_frame_text(tree, wanted.radar, "--radar", source),) if wanted.radar else _radars_in(tree)
    if wanted.camera:
        named = _frame_text(tree, wanted.camera, "--camera-frame", source)
        cameras = _optical_below(tree, named) or (named,)
        if len(cameras) > 1:
            raise InputError(
                f"{source}: {named} carries several cameras: {_frame_list(cameras)}; name one of them with --camera-frame"
            )
    else:
        cameras = _cameras_in(tree)
    cameras = tuple(camera for camera in cameras if camera not in radars) if len(radars) == 1 else cameras
    if len(radars) == 1 and len(cameras) == 1:
        note = f"{wanted.camera} carries {cameras[0]}, whose optical axes are used"
        is_other = wanted.camera is not None and cameras[0] != wanted.camera.strip().lstrip("/")
        return ChosenFrames(radars[0], cameras[0], (note,) if is_other else ())
    raise InputError(f"{source}: {_ambiguity(tree, radars, cameras)}")


def _ambiguity(tree: FrameTree, radars: Sequence[str], cameras: Sequence[str]) -> str:
    found, flags = [], []
    for names, kind in ((radars, "radar"), (cameras, "camera")):
        if len(names) == 1:
            continue
        flags.append("--radar NAME" if kind == "radar" else "--camera-frame NAME")
        found.append(f"{len(names)} {kind} frames: {_frame_list(names)}" if names else f"no frame named like a {kind}")
    rest = "" if radars and cameras else f" (its frames: {tree.listed()})"
    hint = f"; {tree.hint}" if tree.hint and not (radars and cameras) else ""
    return f"{' and '.join(found)}{rest}{hint}; choose with {' and '.join(flags)}"


def _radars_in(tree: FrameTree) -> tuple[str, ...]:
    """Return the frames that are radars', one for each radar as far as names and poses tell."""
    return _without_fixtures(tree, [frame for frame in tree.frames if is_of_radar(tree, frame)])


def _cameras_in(tree: FrameTree) -> tuple[str, ...]:
    """Return the frames that are cameras', the optical frame where there is one."""
    found = [frame for frame in tree.frames if is_of_camera(tree, frame)]
    return _without_fixtures(tree, [frame for frame in found if _is_optical(frame) or not _optical_below(tree, frame)])


def is_of_radar(tree: FrameTree, frame: str) -> bool:
    """Return whether a frame is a radar's, as the files say or by its name."""
    sensor = tree.sensor_at(frame)
    return sensor.kind == "radar" if sensor is not None else looks_like_radar(frame)


def is_of_camera(tree: FrameTree, frame: str) -> bool:
    """Return whether a frame is a camera's, as the files say or by its name."""
    sensor = tree.sensor_at(frame)
    if sensor is not None:
        return sensor.kind == "camera"
    return looks_like_camera(frame) and not _NO_IMAGES.search(frame)


def is_fixture(frame: str) -> bool:
    """Return whether a frame is named as what sensors are mounted on."""
    return bool(_FIXTURE.search(frame))


def _is_optical(frame: str) -> bool:
    return "optical" in frame.lower()


def _optical_below(tree: FrameTree, frame: str) -> tuple[str, ...]:
    if _is_optical(frame):
        return ()
    return tuple(name for name in tree.below(frame) if _is_optical(name) and is_of_camera(tree, name))


def _without_fixtures(tree: FrameTree, frames: list[str]) -> tuple[str, ...]:
    """Leave out frames that carry another one of these, if they are named as a fixture or are the same pose."""
    return tuple(
        frame
        for frame in frames
        if not any(
            _FIXTURE.search(frame) or _is_same(tree, frame, below) for below in tree.below(frame) if below in frames
        )
    )


def _is_same(tree: FrameTree, above: str, below: str) -> bool:
    steps = tree.path(above, below)
    if any(step.joint.problem for step in steps):
        return False
    return bool(np.abs(tree.between(above, below).as_matrix() - np.eye(4)).max() <= _SAME)


def _frame_text(tree: FrameTree, name: str, flag: Literal["--radar", "--camera-frame"], source: str) -> str:
    wanted = name.strip().lstrip("/")
    if wanted in tree.frames:
        return wanted
    near = get_close_matches(wanted, tree.frames, n=3)
    meant = f"did you mean {' or '.join(near)}?" if near else f"its frames: {tree.listed()}"
    hint = f" ({tree.hint})" if tree.hint else ""
    raise InputError(f"{source}: {flag}: there is no frame {wanted!r} in it; {meant}{hint}")


def _frame_list(names: Iterable[str]) -> str:
    return ", ".join(names)
