"""Hypotheses about a pose, ranked: what its numbers can mean, how usual that and the mounting are, pairs, another calibration."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Literal, TypeAlias, TypeVar

import numpy as np

from calib_core.geometry import RigidTransform, rotation_angle_rad
from calib_core.interchange.check.pair_residuals import CheckPairs
from calib_core.interchange.check.pixel_differences import shown
from calib_core.interchange.format import Direction
from calib_core.interchange.hypotheses.found_poses import FoundPose, PoseReading
from calib_core.interchange.rotations import LINK_FROM_OPTICAL, off_forward_rad

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
_WORDS_OF_UNIT: dict[LengthUnit, str] = {"m": "meters", "mm": "millimeters", "cm": "centimeters"}


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


_SAME_RAD, _SAME_M = 1e-4, 1e-4
_CLEAR = 0.95
_LEAST_SHARE = 0.01
_FEWEST, _MOST = 3, 9
_LEAST_SIGMA_PX = 1.0
_NEAR_PX = 0.03
_ANGLE_RAD, _APART_M = math.radians(2.0), 0.05
_NEAR_RAD, _NEAR_M = math.radians(10.0), 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """One pose that the numbers in a file can mean.

    Attributes:
        meanings: every meaning that gives this pose; the most usual first.
        camera_from_radar: the pose.
        share: probability among all hypotheses, from how usual they are and from what they were tested with.
        miss_px: median distance between the projected pairs and their pixels; NaN without pairs, infinite behind the camera.
        apart: angle [rad] and distance [m] from the other calibration; NaN without one.
        fits: whether it passes the tests, or without any, whether sensors are often mounted like this.
    """

    meanings: tuple[Meaning, ...]
    camera_from_radar: RigidTransform
    share: float
    miss_px: float = math.nan
    apart: tuple[float, float] = (math.nan, math.nan)
    fits: bool = False

    @property
    def key(self) -> str:
        """What chooses it."""
        return self.meanings[0].key

    @property
    def score(self) -> str:
        """Its figures: the share, and how it passed the tests."""
        percent = 100 * self.share
        parts = [f"{percent:.0f} %" if percent >= 1 else "below 1 %"]
        if not math.isnan(self.miss_px):
            parts.append(
                f"pairs {shown(self.miss_px)} px off" if math.isfinite(self.miss_px) else "pairs behind the camera"
            )
        if not math.isnan(self.apart[0]):
            parts.append(
                f"{shown(math.degrees(self.apart[0]))} deg and {shown(self.apart[1])} m from the other calibration"
            )
        return ", ".join(parts)

    @property
    def words(self) -> str:
        """What it means, and where it puts the camera."""
        return f"{self.meanings[0].words}: {self.mounting}"

    @property
    def mounting(self) -> str:
        """Where it puts the camera, and where that looks."""
        return mounting_words(self.camera_from_radar)


def hypotheses_of(
    pose: FoundPose, *, pairs: CheckPairs | None = None, against: RigidTransform | None = None
) -> tuple[Hypothesis, ...]:
    """Return every different pose that the numbers can mean, the likeliest first.

    Args:
        pose: the numbers.
        pairs: radar positions and the pixels where they were seen; they decide where they differ.
        against: camera_from_radar of the same sensors from a calibration that is known to be right.
    """
    merged = [_tested(one, pairs, against) for one in _merged(meanings_of(pose))]
    scores = np.array([math.log(max(one.share, 1e-300)) for one in merged])
    if pairs is not None:
        scores += _by_pairs(merged, pairs)
    if against is not None:
        scores += [_by_distance(one) for one in merged]
    shares = np.exp(scores - scores.max())
    shares /= shares.sum()
    shared = [replace(one, share=float(share)) for one, share in zip(merged, shares, strict=True)]
    return tuple(sorted(shared, key=lambda one: (-one.share, one.key)))


def clear_one(pose: FoundPose, hypotheses: Sequence[Hypothesis]) -> Hypothesis | None:
    """Return the only hypothesis that is plausible; None if several are, or none.

    Without a test it is also None if the pose seems to be another sensor's, if its names state the other direction, or if it
    is the identity, as a frame has in itself or nobody has filled in.

    Args:
        pose: the numbers.
        hypotheses: what they can mean, the likeliest first.
    """
    first = hypotheses[0]
    tested = not (math.isnan(first.miss_px) and math.isnan(first.apart[0]))
    blank = all(reading.is_identity for reading in pose.readings)
    as_named = not (blank or pose.hints.other or contradicts_names(pose, first))
    return first if first.fits and first.share >= _CLEAR and (tested or as_named) else None


def contradicts_names(pose: FoundPose, hypothesis: Hypothesis) -> bool:
    """Return whether the names around a pose state the other direction than a hypothesis about it."""
    named = pose.hints.named_direction
    return named is not None and all(meaning.direction != named for meaning in hypothesis.meanings)


def likely_ones(hypotheses: Sequence[Hypothesis]) -> Sequence[Hypothesis]:
    """Return those to show to a person: all that are likely, and a few more to compare with."""
    likely = sum(hypothesis.share >= _LEAST_SHARE for hypothesis in hypotheses)
    return hypotheses[: min(max(likely, _FEWEST), _MOST)]


def _merged(meanings: Iterable[Meaning]) -> list[Hypothesis]:
    """Return the different poses of meanings, each with all of its meanings and their weights added."""
    found: list[tuple[RigidTransform, list[Meaning]]] = []
    ordered = sorted(meanings, key=lambda meaning: -meaning.weight)
    rotations = np.zeros((len(ordered), 9))
    translations_m = np.zeros((len(ordered), 3))
    for meaning in ordered:
        pose, count = meaning.camera_from_radar(), len(found)
        turned = np.abs(rotations[:count] - pose.rotation.ravel()).max(axis=1, initial=0.0)
        moved = np.abs(translations_m[:count] - pose.translation_m).max(axis=1, initial=0.0)
        same = np.flatnonzero((turned <= _SAME_RAD) & (moved <= _SAME_M))
        if len(same):
            found[int(same[0])][1].append(meaning)
            continue
        rotations[count], translations_m[count] = pose.rotation.ravel(), pose.translation_m
        found.append((pose, [meaning]))
    return [
        Hypothesis(tuple(group), pose, sum(one.weight for one in group) * mounting_weight(pose))
        for pose, group in found
    ]


def _tested(hypothesis: Hypothesis, pairs: CheckPairs | None, against: RigidTransform | None) -> Hypothesis:
    """Return a hypothesis with the figures of its tests."""
    pose, fits = hypothesis.camera_from_radar, []
    miss_px, apart = math.nan, (math.nan, math.nan)
    if pairs is not None:
        miss_px = pairs.median_miss_px(pose)
        fits.append(miss_px <= _NEAR_PX * math.hypot(pairs.camera.width_px, pairs.camera.height_px))
    if against is not None:
        distance_m = float(np.linalg.norm(pose.inverse().translation_m - against.inverse().translation_m))
        apart = rotation_angle_rad(pose.rotation @ against.rotation.T), distance_m
        fits.append(apart[0] <= _NEAR_RAD and apart[1] <= _NEAR_M)
    return replace(hypothesis, miss_px=miss_px, apart=apart, fits=all(fits) if fits else is_usual(pose))


def _by_pairs(hypotheses: Sequence[Hypothesis], pairs: CheckPairs) -> np.ndarray:
    """Return the log-likelihood of the pairs under each pose (n,), with heavy tails: some pairs may be wrong."""
    misses_px = np.stack([pairs.misses_px(hypothesis.camera_from_radar) for hypothesis in hypotheses])
    misses_px = np.minimum(misses_px, 1e4)
    sigma_px = max(float(np.median(misses_px, axis=1).min()), _LEAST_SIGMA_PX)
    return np.asarray(-1.5 * np.log1p((misses_px / sigma_px) ** 2 / 2).sum(axis=1))


def _by_distance(hypothesis: Hypothesis) -> float:
    angle, distance_m = hypothesis.apart
    return -3.0 * (math.log1p((angle / _ANGLE_RAD) ** 2) + math.log1p((distance_m / _APART_M) ** 2))


_ALONG_RAD, _UPRIGHT_RAD = math.radians(20.0), math.radians(12.0)
_USUAL_ALONG_RAD, _USUAL_UPRIGHT_RAD = math.radians(50.0), math.radians(35.0)
_USUAL_M = (0.01, 4.0)
_TYPICAL_M, _FACTOR = 0.4, 3.5
_LOOKS_ANYWHERE, _ANY_ATTITUDE = 0.02, 0.001
_SMALLEST_M = 1e-3


def _tilts_rad(camera_from_radar: RigidTransform) -> tuple[float, float]:
    """Return the angles between the viewing direction and the radar's x axis, and of the image's lean to one side."""
    rotation = camera_from_radar.rotation
    lean = abs(math.atan2(rotation[0, 2], -rotation[1, 2]))  # of the radar's up axis in the image
    return off_forward_rad(camera_from_radar), lean


def mounting_weight(camera_from_radar: RigidTransform) -> float:
    """Return how usual a mounting is, as an unnormalised density over attitudes and over the logarithm of the distance.

    Most pairs of sensors look the same way, within about 20 degrees, upright, decimeters apart; a few look elsewhere.
    """
    along, lean = _tilts_rad(camera_from_radar)
    upright = math.exp(-0.5 * (lean / _UPRIGHT_RAD) ** 2)
    facing = math.exp(-0.5 * (along / _ALONG_RAD) ** 2) * upright
    distance_m = max(float(np.linalg.norm(camera_from_radar.translation_m)), _SMALLEST_M)
    apart = math.exp(-0.5 * (math.log(distance_m / _TYPICAL_M) / math.log(_FACTOR)) ** 2)
    return (facing + _LOOKS_ANYWHERE * upright + _ANY_ATTITUDE) * (apart + 1e-6)


def is_usual(camera_from_radar: RigidTransform) -> bool:
    """Return whether two sensors of one vehicle are often mounted like this."""
    along, lean = _tilts_rad(camera_from_radar)
    distance_m = float(np.linalg.norm(camera_from_radar.translation_m))
    near = distance_m <= _USUAL_M[1] and (distance_m >= _USUAL_M[0] or distance_m == 0.0)
    return along <= _USUAL_ALONG_RAD and lean <= _USUAL_UPRIGHT_RAD and near


def mounting_words(camera_from_radar: RigidTransform) -> str:
    """Return where the camera is, seen from the radar, and where it looks."""
    along, lean = _tilts_rad(camera_from_radar)
    forward, left, up = camera_from_radar.rotation[2].tolist()  # the viewing direction in the radar's axes
    if along <= math.radians(10.0):
        looks = "the camera looks where the radar looks"
    elif forward < -0.8:
        looks = "the camera looks backwards"
    else:
        sides = [(abs(left), "left" if left > 0 else "right"), (abs(up), "up" if up > 0 else "down")]
        looks = f"the camera looks {math.degrees(along):.0f} deg to the {max(sides)[1]}".replace(
            "to the up", "up"
        ).replace("to the down", "down")
    if lean > math.radians(135.0):
        looks += ", upside down"
    elif lean > math.radians(45.0):
        looks += ", on its side"
    elif lean > math.radians(10.0):
        looks += f", leaning {math.degrees(lean):.0f} deg"
    return f"{looks}, {_place_words(camera_from_radar.inverse().translation_m)}"


def _place_words(camera_radar_m: np.ndarray) -> str:
    names = (("forward", "back"), ("left", "right"), ("up", "down"))
    parts = [
        f"{abs(value):.2g} m {name if value > 0 else opposite}"
        for value, (name, opposite) in zip(camera_radar_m.tolist(), names, strict=True)
        if abs(value) >= 0.005
    ]
    return f"from the radar {', '.join(parts)}" if parts else "at the radar's place"
