"""The meanings that numbers without a statement can have: direction, axes of both frames, order, unit of length."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Literal, TypeAlias, TypeVar

import numpy as np

from calib_core.geometry import RigidTransform
from calib_core.interchange.hypotheses.found_poses import FoundPose, PoseReading
from calib_core.interchange.imported import Direction
from calib_core.interchange.rotations import LINK_FROM_OPTICAL

CameraAxes: TypeAlias = Literal["optical", "body", "opengl"]
RadarAxes: TypeAlias = Literal["flu", "frd", "rfu", "optical-like"]
LengthUnit: TypeAlias = Literal["m", "mm", "cm"]

Name = TypeVar("Name", bound=str)

_DIRECTIONS: tuple[Direction, ...] = ("camera_from_radar", "radar_from_camera")
_OPTICAL_FROM: dict[CameraAxes, np.ndarray] = {
    "optical": np.eye(3),
    "body": LINK_FROM_OPTICAL.rotation.T,
    "opengl": np.diag([1.0, -1.0, -1.0]),
}
_AS_WRITTEN_FROM_RADAR: dict[RadarAxes, np.ndarray] = {
    "flu": np.eye(3),
    "frd": np.diag([1.0, -1.0, -1.0]),
    "rfu": np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    "optical-like": LINK_FROM_OPTICAL.rotation.T,
}
_METRES: dict[LengthUnit, float] = {"m": 1.0, "mm": 1e-3, "cm": 1e-2}

# How usual each is in files that state nothing; a name that mentions one makes it the usual one.
_USUAL_CAMERA: dict[CameraAxes, float] = {"optical": 0.7, "body": 0.25, "opengl": 0.05}
_USUAL_RADAR: dict[RadarAxes, float] = {"flu": 0.86, "frd": 0.06, "rfu": 0.06, "optical-like": 0.02}
_USUAL_UNIT: dict[LengthUnit, float] = {"m": 0.9, "mm": 0.08, "cm": 0.02}
_NAMED = 0.95

_WORDS_OF_CAMERA: dict[CameraAxes, str] = {
    "optical": "optical axes (z forward, y down)",
    "body": "body axes (x forward, z up)",
    "opengl": "OpenGL axes (z backward, y up)",
}
_WORDS_OF_RADAR: dict[RadarAxes, str] = {
    "flu": "radar x forward, y left, z up",
    "frd": "radar x forward, y right, z down",
    "rfu": "radar x right, y forward, z up",
    "optical-like": "radar x right, y down, z forward",
}
_WORDS_OF_UNIT: dict[LengthUnit, str] = {"m": "metres", "mm": "millimetres", "cm": "centimetres"}


@dataclass(frozen=True, slots=True, eq=False)
class Meaning:
    """One meaning of the numbers of a pose.

    Attributes:
        direction: which transform they are.
        camera_axes: the axes of the camera frame they refer to.
        radar_axes: the same for the radar.
        unit: of the translation.
        reading: how the numbers are read.
        weight: how usual this meaning is, before the pose is looked at.
    """

    direction: Direction
    camera_axes: CameraAxes
    radar_axes: RadarAxes
    unit: LengthUnit
    reading: PoseReading
    weight: float

    @property
    def parts(self) -> tuple[str, ...]:
        """Every part of its key; any of them can be given to choose it."""
        order = (self.reading.turned.key,) if self.reading.turned.key else ()
        return (self.direction, self.camera_axes, self.radar_axes, *order, self.unit)

    @property
    def key(self) -> str:
        """What chooses it on the command line: its parts without the radar axes that go without saying."""
        return ",".join(part for part in self.parts if part != "flu")

    @property
    def words(self) -> str:
        """The same for people."""
        carries = (
            "carries radar points into the camera"
            if self.direction == "camera_from_radar"
            else "carries camera points into the radar (the pose of the camera)"
        )
        parts = [carries, _WORDS_OF_CAMERA[self.camera_axes], _WORDS_OF_RADAR[self.radar_axes]]
        if self.reading.turned.words:
            parts.append(self.reading.turned.words)
        return ", ".join([*parts, _WORDS_OF_UNIT[self.unit]])

    def camera_from_radar(self) -> RigidTransform:
        """Return the pose in our convention: p_camera = R p_radar + t, optical camera frame, radar x forward, y left, z up."""
        written = RigidTransform(self.reading.turned.rotation, self.reading.translation * _METRES[self.unit])
        carries_radar = written if self.direction == "camera_from_radar" else written.inverse()
        optical, radar = _OPTICAL_FROM[self.camera_axes], _AS_WRITTEN_FROM_RADAR[self.radar_axes]
        return RigidTransform(optical @ carries_radar.rotation @ radar, optical @ carries_radar.translation_m)


def meanings_of(pose: FoundPose) -> Iterator[Meaning]:
    """Yield every meaning of a pose's numbers."""
    hints = pose.hints
    cameras = _weights(_USUAL_CAMERA, hints.camera_axes)
    radars = _weights(_USUAL_RADAR, hints.radar_axes)
    units = _weights(_USUAL_UNIT, hints.unit)
    towards: dict[Direction, float] = dict(
        zip(_DIRECTIONS, (hints.carries_radar, 1 - hints.carries_radar), strict=True)
    )
    for reading, direction, camera, radar, unit in product(pose.readings, _DIRECTIONS, cameras, radars, units):
        weight = towards[direction] * cameras[camera] * radars[radar] * units[unit] * reading.turned.weight
        yield Meaning(direction, camera, radar, unit, reading, weight)


def _weights(usual: dict[Name, float], named: str) -> dict[Name, float]:
    """Return how usual each is; one that a name mentions is nearly certain."""
    if named not in usual:
        return usual
    others = sum(weight for name, weight in usual.items() if name != named)
    return {name: _NAMED if name == named else (1 - _NAMED) * weight / others for name, weight in usual.items()}
