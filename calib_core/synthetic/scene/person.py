"""A person made of capsules, as seen by the camera and by the radar."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from calib_core.arrays import Flags, Points3, Vector2, Vector3

Surface = Literal["skin", "helmet", "jacket", "vest", "yoke", "trousers", "shoe", "stripe"]

_HIP_M, _THIGH_M, _SHIN_M = 0.985, 0.46, 0.47
_TORSO_M, _UPPER_ARM_M, _FOREARM_M = 0.52, 0.29, 0.30
_STRIDE_M = 1.45
_TORSO = ((1.0, -6.0), (0.0, -5.0), (-1.0, -6.0))


@dataclass(frozen=True, slots=True)
class PersonState:
    """A pose of the person.

    Attributes:
        x_m, y_m: where they stand, in the world.
        heading_rad: where they face; 0 along x, positive to the left.
        walked_m: distance walked so far; it drives the gait.
        pace: 0 standing to 1 walking.
        crouch: 0 upright to 1 reaching the ground.
        carrying: both hands in front.
    """

    x_m: float
    y_m: float
    heading_rad: float
    walked_m: float = 0.0
    pace: float = 0.0
    crouch: float = 0.0
    carrying: bool = False

    @property
    def place_m(self) -> Vector2:
        """(2,) position on the ground."""
        return np.array([self.x_m, self.y_m])


@dataclass(frozen=True, slots=True, eq=False)
class Capsule:
    """A rounded limb from one joint to another, in the world [m]; rcs_dbsm is its radar cross-section."""

    start_m: Vector3
    end_m: Vector3
    start_radius_m: float
    end_radius_m: float
    surface: Surface
    rcs_dbsm: float = -40.0


def _joint(hip: Vector3, target: Vector3, upper_m: float, lower_m: float, towards: Vector3) -> tuple[Vector3, Vector3]:
    """Solve a two-bone limb: return its middle joint and its end (the target, or as close as the bones reach)."""
    reach = target - hip
    length = float(np.linalg.norm(reach))
    full = 0.999 * (upper_m + lower_m)
    along = reach / max(length, 1e-9)
    length = min(length, full)
    near = (length**2 + upper_m**2 - lower_m**2) / (2.0 * max(length, 1e-9))
    sideways = np.sqrt(max(upper_m**2 - near**2, 0.0))
    pole = towards - along * float(towards @ along)
    pole = pole / max(float(np.linalg.norm(pole)), 1e-9)
    return hip + near * along + sideways * pole, hip + length * along


def _axes(state: PersonState) -> tuple[Vector3, Vector3, Vector3]:
    c, s = np.cos(state.heading_rad), np.sin(state.heading_rad)
    return np.array([c, s, 0.0]), np.array([-s, c, 0.0]), np.array([0.0, 0.0, 1.0])


def hand_position(state: PersonState) -> Vector3:
    """Return the position (3,) of a carried object in the world [m]."""
    forward, _, up = _axes(state)
    base = np.array([state.x_m, state.y_m, 0.0])
    return base + (0.40 + 0.12 * state.crouch) * forward + (1.02 - 0.80 * state.crouch) * up


def _legs(state: PersonState, hips: Vector3) -> list[Capsule]:
    forward, left, up = _axes(state)
    limbs: list[Capsule] = []
    base = np.array([state.x_m, state.y_m, 0.0])
    for side, turn in ((1.0, 0.0), (-1.0, np.pi)):
        phase = 2.0 * np.pi * state.walked_m / _STRIDE_M + turn
        swing = 0.33 * state.pace * np.sin(phase) + 0.14 * state.crouch * side
        lift = 0.13 * state.pace * max(0.0, float(np.cos(phase)))
        hip = hips + 0.09 * side * left
        ankle = base + swing * forward + 0.10 * side * left + (0.08 + lift) * up
        knee, ankle = _joint(hip, ankle, _THIGH_M, _SHIN_M, forward + 0.15 * side * left)
        toe = ankle + 0.17 * forward - 0.045 * up
        limbs += [
            Capsule(ankle - 0.04 * forward - 0.04 * up, toe, 0.042, 0.038, "shoe"),
            Capsule(knee, ankle, 0.062, 0.045, "trousers", -13.0),
            Capsule(hip, knee, 0.088, 0.064, "trousers", -11.0),
        ]
    return limbs


def _arms(state: PersonState, shoulders: Vector3) -> list[Capsule]:
    forward, left, up = _axes(state)
    limbs: list[Capsule] = []
    for side, turn in ((1.0, np.pi), (-1.0, 0.0)):
        phase = 2.0 * np.pi * state.walked_m / _STRIDE_M + turn
        shoulder = shoulders + 0.20 * side * left - 0.03 * up
        swing = 0.30 * state.pace * np.sin(phase)
        hanging = shoulder + swing * forward + 0.07 * side * left - (0.55 - 0.05 * abs(swing)) * up
        holding = hand_position(state) + 0.10 * side * left - 0.02 * up
        busy = 1.0 if state.carrying else min(1.0, 1.5 * state.crouch)
        target = busy * holding + (1.0 - busy) * hanging
        elbow, hand = _joint(shoulder, target, _UPPER_ARM_M, _FOREARM_M, -forward - 0.4 * up + 0.5 * side * left)
        limbs += [
            Capsule(shoulder, elbow, 0.058, 0.046, "jacket", -14.0),
            Capsule(elbow, hand, 0.045, 0.034, "jacket", -15.0),
            Capsule(hand, hand + 0.05 * (hand - elbow) / _FOREARM_M, 0.042, 0.036, "skin"),
        ]
    return limbs


def capsules(state: PersonState) -> tuple[Capsule, ...]:
    """Build the limbs of a person."""
    forward, left, up = _axes(state)
    bob = 0.025 * state.pace * float(np.cos(4.0 * np.pi * state.walked_m / _STRIDE_M))
    hips = np.array([state.x_m, state.y_m, 0.0]) + (_HIP_M - 0.42 * state.crouch + bob) * up
    hips = hips - 0.22 * state.crouch * forward
    lean = 0.05 * state.pace + 0.95 * state.crouch
    spine = np.cos(lean) * up + np.sin(lean) * forward
    shoulders = hips + _TORSO_M * spine
    chest = hips + 0.39 * spine
    head = shoulders + 0.23 * (np.cos(0.5 * lean) * up + np.sin(0.5 * lean) * forward) + 0.03 * forward
    torso = [
        Capsule(hips - 0.055 * left, hips + 0.055 * left, 0.120, 0.120, "trousers", -9.0),
        *(
            Capsule(hips + 0.12 * spine + s * 0.05 * left, chest + s * 0.075 * left, 0.112, 0.118, "vest", rcs)
            for s, rcs in _TORSO
        ),
        Capsule(shoulders - 0.14 * left - 0.03 * up, shoulders + 0.14 * left - 0.03 * up, 0.078, 0.078, "yoke"),
        Capsule(shoulders, shoulders + 0.12 * spine, 0.055, 0.052, "skin"),
        Capsule(head - 0.045 * up, head + 0.03 * up, 0.080, 0.092, "skin", -14.0),
        Capsule(head + 0.055 * up - 0.012 * forward, head + 0.075 * up - 0.005 * forward, 0.112, 0.106, "helmet"),
    ]
    return (*_legs(state, hips), *torso, *_arms(state, shoulders))


def body_hides(
    person: PersonState,
    eye_m: Vector3,
    points_m: Points3,
    *,
    half_width_m: float,
    clearance_m: float,
    height_m: float = np.inf,
) -> Flags:
    """Return which points (n, 3) a person hides from an eye: an upright body.

    Args:
        person: where they stand.
        eye_m: (3,) in the world.
        points_m: in the world.
        half_width_m: of the body.
        clearance_m: how far behind the body a point is at least.
        height_m: of the body.
    """
    way = points_m - eye_m
    reach = np.maximum(np.linalg.norm(way[:, :2], axis=1), 1e-9)
    along = way[:, :2] / reach[:, None]
    to_person = person.place_m - eye_m[:2]
    depth = along @ to_person
    aside = np.abs(along[:, 0] * to_person[1] - along[:, 1] * to_person[0])
    height = eye_m[2] + way[:, 2] * depth / reach
    return np.asarray((aside < half_width_m) & (depth > 0.0) & (depth < reach - clearance_m) & (height < height_m))
