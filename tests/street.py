"""A street in front of a radar and a camera: people who walk, boxes around them, and things that stand still."""

from dataclasses import dataclass

import numpy as np

from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.measurements import (
    Box,
    Boxes,
    Cuboid,
    FrameBoxes,
    LabelledScan,
    RadarScan,
    RadarScans,
    ReturnLabels,
    TimeNs,
)
from calib_core.radar import cartesian_from_polar, polar_from_cartesian

START_NS = 1_700_000_000_000_000_000
CAMERA = Camera(
    "plumb_bob",
    1280,
    720,
    np.array([[900.0, 0.0, 639.5], [0.0, 900.0, 359.5], [0.0, 0.0, 1.0]]),
    np.array([-0.12, 0.03, 0.001, -0.0005, 0.0]),
)
OPTICAL_FROM_RADAR = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
TRUE_POSE = RigidTransform(
    rotation_exp(np.deg2rad([2.0, -6.0, 1.0])) @ OPTICAL_FROM_RADAR, np.array([0.25, 0.1, -0.05])
)


def turned(pose: RigidTransform, axis: int, angle_deg: float) -> RigidTransform:
    """Return a pose with the camera turned about one of its own axes."""
    turn = rotation_exp(np.deg2rad(angle_deg) * np.eye(3)[axis])
    return RigidTransform(turn @ pose.rotation, turn @ pose.translation_m)


@dataclass(frozen=True, slots=True)
class Street:
    """What the sensors recorded.

    Attributes:
        scans: of the radar, 10 Hz.
        boxes: around the people, in every frame at 10 Hz.
        labels: whose each return is.
    """

    scans: RadarScans
    boxes: Boxes
    labels: ReturnLabels


def street(
    *,
    people: int = 3,
    seconds: float = 20.0,
    seed: int = 1,
    with_doppler: bool = True,
    with_names: bool = False,
    with_cuboids: bool = False,
    ego_mps: tuple[float, float] = (0.0, 0.0),
    label: str = "person",
) -> Street:
    """Simulate people who walk across and along a street.

    Args:
        people: how many.
        seconds: how long.
        seed: of the noise and the walks.
        with_doppler: whether the radar measures it.
        with_names: whether the boxes say who is in them.
        with_cuboids: whether the boxes have cuboids.
        ego_mps: velocity of both sensors over ground; what stands still passes by, the people keep pace.
        label: class of the boxes.
    """
    rng = np.random.default_rng(seed)
    starts = np.stack([rng.uniform(8, 20, people), rng.uniform(-5, 5, people)], axis=1)
    speeds = np.stack(
        [rng.uniform(-0.8, 0.8, people), rng.uniform(0.6, 1.4, people) * rng.choice([-1, 1], people)], axis=1
    )
    still = np.stack([rng.uniform(5, 40, 40), rng.uniform(-15, 15, 40)], axis=1)
    scans, frames, labels = [], [], []
    for step in range(round(seconds * 10)):
        time = TimeNs(START_NS + step * 100_000_000)
        seconds_now = 0.1 * step
        where, velocity = _walked(starts, speeds, seconds_now)
        passed = still - np.array(ego_mps) * seconds_now
        passed[:, 0] = 3.0 + (passed[:, 0] - 3.0) % 40.0
        scan, who = _scan(time, where, velocity, passed, np.array(ego_mps), rng, with_doppler)
        scans.append(scan)
        labels.append(LabelledScan(time, who))
        frames.append(FrameBoxes(TimeNs(time + 12_000_000), _boxes(where, label, with_names, with_cuboids)))
    return Street(
        RadarScans.from_scans(scans),
        Boxes(tuple(frames), "boxes.json", (1280, 720)),
        ReturnLabels(tuple(labels), "labels.json"),
    )


def _walked(starts: np.ndarray, speeds: np.ndarray, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Return where people are who turn round at 7 m to either side, and their velocities."""
    unfolded = starts[:, 1] + 7.0 + speeds[:, 1] * seconds
    lap = np.floor(unfolded / 14.0).astype(int)
    within = unfolded - 14.0 * lap
    back = lap % 2 == 1
    y = np.where(back, 14.0 - within, within) - 7.0
    along = starts[:, 0] + 2.0 * np.sin(0.3 * seconds * speeds[:, 0] / 0.8)
    slow = 0.6 * speeds[:, 0] / 0.8 * np.cos(0.3 * seconds * speeds[:, 0] / 0.8)
    return np.stack([along, y], axis=1), np.stack([slow, np.where(back, -speeds[:, 1], speeds[:, 1])], axis=1)


def _scan(
    time: TimeNs,
    where: np.ndarray,
    velocity: np.ndarray,
    still: np.ndarray,
    ego_mps: np.ndarray,
    rng: np.random.Generator,
    with_doppler: bool,
) -> tuple[RadarScan, tuple[str, ...]]:
    points, doppler, who = [], [], []
    for number, (place, speed) in enumerate(zip(where, velocity, strict=True)):
        for _ in range(rng.integers(1, 4)):
            point = np.array([*(place + rng.normal(0, 0.12, 2)), rng.normal(0.0, 0.25)])
            points.append(point)
            doppler.append(speed @ place / np.linalg.norm(place) + rng.normal(0, 0.05))
            who.append(f"person-{number}")
    for place in still:
        points.append(np.array([*place, rng.normal(0, 0.2)]))
        doppler.append(-ego_mps @ place / np.linalg.norm(place) + rng.normal(0, 0.02))
        who.append("")
    polar = polar_from_cartesian(np.array(points)) + rng.normal(0, 1, (len(points), 3)) * [
        0.05,
        np.deg2rad(0.5),
        np.deg2rad(1),
    ]
    speeds = np.array(doppler) if with_doppler else np.full(len(points), np.nan)
    nothing = np.full(len(points), np.nan)
    return RadarScan(time, cartesian_from_polar(polar), speeds, nothing, np.full((len(points), 3), np.nan)), tuple(who)


def _cuboid(place: np.ndarray) -> Cuboid:
    right_m, down_m, ahead_m = (TRUE_POSE @ np.array([[*place, 0.0]]))[0].tolist()
    return Cuboid((right_m, down_m, ahead_m), 0.6, 0.6, 0.3)


def _boxes(where: np.ndarray, label: str, with_names: bool, with_cuboids: bool) -> tuple[Box, ...]:
    found = []
    for number, place in enumerate(where):
        corners = np.array([[place[0], place[1] + y, z] for y in (-0.3, 0.3) for z in (-0.9, 0.9)])
        points_camera_m = TRUE_POSE @ corners
        pixels = CAMERA.project(points_camera_m)
        (left, top), (right, bottom) = pixels.min(axis=0), pixels.max(axis=0)
        if right < 0 or left > 1279 or bottom < 0 or top > 719:
            continue
        sides = np.clip([left, right], 0, 1279), np.clip([top, bottom], 0, 719)
        found.append(
            Box(
                sides[0][0],
                sides[1][0],
                sides[0][1],
                sides[1][1],
                label,
                track=f"person-{number}" if with_names else "",
                cuboid=_cuboid(place) if with_cuboids else None,
            )
        )
    return tuple(found)
