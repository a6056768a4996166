"""What goes wrong with simulated pairs beyond noise: clicks of one placement, companions, a moved camera, axes, units.

And rigs that are hard: a camera far from the radar, a radar that measures no elevation, tilted.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np

from benchmarks.simulated_pairs import SimulatedPairs
from calib_core.arrays import Flags, Points3
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.measurements import Candidate, Pair
from calib_core.options import RadarOptions
from calib_core.radar import cartesian_from_polar, covariance_from_sigma_polar, direction_cosines, polar_from_cartesian
from calib_core.synthetic.rig import Rig, RigOptions, radar_stand


def clicked_again(
    simulated: SimulatedPairs, clicks: int, *, rng: np.random.Generator, sigma_px: float = 2.0
) -> SimulatedPairs:
    """Click every placement several times; its clicks share one radar position, so also the radar's error.

    Args:
        simulated: one click per placement, ids "p1", "p2", ...; further clicks get "p1-2", "p1-3", ...
        clicks: per placement.
        rng: the only source of randomness.
        sigma_px: standard deviation of a click. Further clicks of an outlier are as far off as the first.
    """
    points_camera_m = simulated.camera_from_radar @ simulated.points_radar_m
    aimed_px = simulated.systematic.aimed_pixels(simulated.rig.camera, points_camera_m)
    pairs: list[Pair] = []
    for pair, centre_px, outlier in zip(simulated.pairs, aimed_px, simulated.outlier, strict=True):
        pairs.append(pair)
        for number in range(2, clicks + 1):
            pixel_px = (pair.pixel_px if outlier else centre_px) + sigma_px * rng.standard_normal(2)
            pairs.append(replace(pair, id=f"{pair.id}-{number}", pixel_px=pixel_px))
    rows = np.repeat(np.arange(len(simulated.pairs)), clicks)
    return replace(
        simulated,
        pairs=tuple(pairs),
        points_radar_m=simulated.points_radar_m[rows],
        pixels_px=simulated.pixels_px[rows],
        outlier=simulated.outlier[rows],
        true_candidate=tuple(simulated.true_candidate[row] for row in rows),
    )


def with_companion(
    simulated: SimulatedPairs,
    *,
    rng: np.random.Generator,
    behind_m: float = 1.0,
    wander_m: float = 0.1,
    share: float = 1.0,
    reflector_seen: bool = True,
) -> SimulatedPairs:
    """Put an object that echoes more behind the reflector: its position becomes the first candidate of some pairs.

    Args:
        simulated: the pairs; outliers stay as they are.
        rng: the only source of randomness.
        behind_m: how far behind, along the radar's line of sight [m].
        wander_m: standard deviation of the companion's place about that, per axis [m].
        share: of the pairs; which ones is random.
        reflector_seen: keep the reflector's own position as a less plausible candidate; otherwise the pair is wrong.
    """
    chosen = _some(rng, len(simulated.pairs), share) & ~simulated.outlier
    pairs, true_candidate = list(simulated.pairs), list(simulated.true_candidate)
    for i in np.flatnonzero(chosen).tolist():
        own = pairs[i].candidates[0]
        away_m = behind_m * own.position_radar_m / np.linalg.norm(own.position_radar_m) + wander_m * (
            rng.standard_normal(3)
        )
        companion = replace(_moved(own, own.position_radar_m + away_m), score=0.6)
        others = tuple(replace(one, score=0.4 * one.score) for one in pairs[i].candidates)
        pairs[i] = replace(pairs[i], candidates=(companion, *(others if reflector_seen else others[1:])))
        true_candidate[i] = true_candidate[i] + 1 if reflector_seen else -1
    wrong = simulated.outlier | (chosen if not reflector_seen else np.zeros_like(chosen))
    return replace(simulated, pairs=tuple(pairs), outlier=wrong, true_candidate=tuple(true_candidate))


def from_moved_camera(
    simulated: SimulatedPairs, *, rng: np.random.Generator, share: float, turn_deg: float, in_order: bool = False
) -> SimulatedPairs:
    """Turn the camera by an angle about a random axis for some pairs, or the last ones: they agree on another pose."""
    count = len(simulated.pairs)
    chosen = np.arange(count) >= (1.0 - share) * count if in_order else _some(rng, count, share)
    chosen = chosen & ~simulated.outlier
    axis = rng.standard_normal(3)
    turn = RigidTransform(rotation_exp(np.deg2rad(turn_deg) * axis / np.linalg.norm(axis)), np.zeros(3))
    points_camera_m = simulated.camera_from_radar @ simulated.points_radar_m
    camera, errors = simulated.rig.camera, simulated.systematic
    moved_px = errors.aimed_pixels(camera, turn @ points_camera_m) - errors.aimed_pixels(camera, points_camera_m)
    pairs = tuple(
        replace(pair, pixel_px=pair.pixel_px + shift) if moved else pair
        for pair, shift, moved in zip(simulated.pairs, moved_px, chosen, strict=True)
    )
    true_candidate = tuple(
        -1 if moved else place for place, moved in zip(simulated.true_candidate, chosen, strict=True)
    )
    return replace(simulated, pairs=pairs, outlier=simulated.outlier | chosen, true_candidate=true_candidate)


def mirrored(simulated: SimulatedPairs, axis: Literal["left", "up"] = "left") -> SimulatedPairs:
    """Give one coordinate of every radar position the wrong sign; no pose is true of such pairs."""
    signs = np.array([1.0, -1.0, 1.0] if axis == "left" else [1.0, 1.0, -1.0])
    return _with_positions(simulated, lambda points: points * signs)


def in_other_units(simulated: SimulatedPairs, units_per_metre: float) -> SimulatedPairs:
    """Give the radar positions in another unit as if they were metres: 1000 for millimetres, 3.28 for feet."""
    return _with_positions(simulated, lambda points: points * units_per_metre)


def with_sheared_array(simulated: SimulatedPairs, shear_deg: float) -> SimulatedPairs:
    """Let the array's rows not be at right angles to its columns: the sine of elevation takes up a share of that of azimuth."""

    def sheared(points: Points3) -> Points3:
        range_m, u, w = direction_cosines(points).T
        w = w + np.tan(np.deg2rad(shear_deg)) * u
        return range_m[:, None] * np.stack([np.sqrt(1.0 - u**2 - w**2), u, w], axis=1)

    return _with_positions(simulated, sheared)


def with_angles(simulated: SimulatedPairs, change: Callable[[Points3], Points3]) -> SimulatedPairs:
    """Report other angles: change maps true range [m], azimuth and elevation [rad] (n, 3) to those reported."""
    return _with_positions(simulated, lambda points: cartesian_from_polar(change(polar_from_cartesian(points))))


def with_clicks_on_drawn_returns(
    simulated: SimulatedPairs, *, rng: np.random.Generator, turn_deg: float, sigma_px: float = 2.0
) -> SimulatedPairs:
    """Click where an earlier pose, turned by an angle about any axis, draws the returns, instead of the reflector."""
    axis = rng.standard_normal(3)
    turn = rotation_exp(np.deg2rad(turn_deg) * axis / np.linalg.norm(axis))
    pose = RigidTransform(turn @ simulated.camera_from_radar.rotation, simulated.camera_from_radar.translation_m)
    drawn_px = simulated.camera.project(
        pose @ np.array([one.candidates[0].position_radar_m for one in simulated.pairs])
    )
    clicks_px = drawn_px + sigma_px * rng.standard_normal(drawn_px.shape)
    pairs = tuple(replace(pair, pixel_px=px) for pair, px in zip(simulated.pairs, clicks_px, strict=True))
    return replace(simulated, pairs=pairs)


def with_squeezed_rows(simulated: SimulatedPairs, share: float) -> SimulatedPairs:
    """Squeeze the image's rows, with intrinsics for the whole image."""
    factor = np.array([1.0, share])
    pairs = tuple(replace(pair, pixel_px=(pair.pixel_px + 0.5) * factor - 0.5) for pair in simulated.pairs)
    return replace(simulated, pairs=pairs)


def lowered(simulated: SimulatedPairs, by_m: float) -> SimulatedPairs:
    """Let the radar see every reflector lower than it is, as one that takes the foot of its stand for it."""
    return _with_positions(simulated, lambda points: points - np.array([0.0, 0.0, by_m]))


def with_ground_bounce(
    simulated: SimulatedPairs, *, rng: np.random.Generator, reflection: float = 0.3
) -> SimulatedPairs:
    """Pull each elevation towards or away from the reflector's image in the ground, with the phase of the bounce at random.

    A radar whose beam holds both measures the direct direction plus reflection * cos(phase) times the angle to the image.
    """
    world_from_radar = simulated.rig.radar_from_world.inverse()

    def pulled(points: Points3) -> Points3:
        polar, heights_m = polar_from_cartesian(points), (world_from_radar @ points)[:, 2]
        phases = rng.uniform(0.0, 2.0 * np.pi, len(points))
        towards_image = 2.0 * np.maximum(heights_m, 0.0) / polar[:, 0]
        return cartesian_from_polar(
            polar - (reflection * np.cos(phases) * towards_image)[:, None] * np.array([0.0, 0.0, 1.0])
        )

    return _with_positions(simulated, pulled)


def with_rounded_elevations(
    simulated: SimulatedPairs, *, rng: np.random.Generator, rounding_rad: float = 1e-6
) -> SimulatedPairs:
    """Add errors of rounding, up to an angle, to all elevations, as of a driver that converts zeros back and forth."""

    def off(points: Points3) -> Points3:
        errors_rad = rng.uniform(-rounding_rad, rounding_rad, len(points))
        return cartesian_from_polar(polar_from_cartesian(points) + errors_rad[:, None] * np.array([0.0, 0.0, 1.0]))

    return _with_positions(simulated, off)


def with_zero_pair(simulated: SimulatedPairs, rng: np.random.Generator, *, distance_m: float = 0.001) -> SimulatedPairs:
    """Put the radar position of the first pair next to the radar, as an empty return is often written."""
    first = simulated.pairs[0]
    wrong = replace(first, candidates=(_moved(first.candidates[0], distance_m * rng.standard_normal(3)),))
    outlier = simulated.outlier.copy()
    outlier[0] = True
    return replace(
        simulated,
        pairs=(wrong, *simulated.pairs[1:]),
        outlier=outlier,
        true_candidate=(-1, *simulated.true_candidate[1:]),
    )


def _with_positions(simulated: SimulatedPairs, change: Callable[[Points3], Points3]) -> SimulatedPairs:
    """Replace the positions of all candidates."""
    pairs = []
    for pair in simulated.pairs:
        positions = change(np.array([one.position_radar_m for one in pair.candidates]))
        candidates = tuple(_moved(one, new) for one, new in zip(pair.candidates, positions, strict=True))
        pairs.append(replace(pair, candidates=candidates))
    return replace(simulated, pairs=tuple(pairs))


def _moved(candidate: Candidate, position_radar_m: np.ndarray) -> Candidate:
    covariance = covariance_from_sigma_polar(position_radar_m, candidate.sigma_polar)
    return replace(candidate, position_radar_m=position_radar_m, covariance_m2=covariance)


def _some(rng: np.random.Generator, count: int, share: float) -> Flags:
    """Choose round(share * count) of the pairs."""
    chosen = np.zeros(count, dtype=np.bool_)
    chosen[rng.permutation(count)[: round(share * count)]] = True
    return chosen


def random_rig_apart(
    rng: np.random.Generator, *, camera: Camera, distance_m: float, options: RigOptions | None = None
) -> Rig:
    """Draw a camera far from the radar, beside or opposite it, that looks at a place ahead of the radar.

    Args:
        rng: the only source of randomness.
        camera: the intrinsics.
        distance_m: between the sensors, along the ground [m]; the camera is up to 1 m above or below the radar's height.
        options: how the radar is mounted, and how accurately the camera is pointed; None takes the defaults.
    """
    options = options or RigOptions()
    radar_from_world = radar_stand(options)
    bearing_rad = np.deg2rad(rng.uniform(-110.0, 110.0))
    height_m = max(0.5, options.radar_height_m + rng.uniform(-1.0, 1.0))
    centre = np.array([distance_m * np.cos(bearing_rad), distance_m * np.sin(bearing_rad), height_m])
    aims = np.array([[3.0, 0.0, 0.0], [9.0, 0.0, 0.0]])
    aim = aims[np.argmax(np.linalg.norm(aims - centre, axis=1))]
    forward = (aim - centre) / np.linalg.norm(aim - centre)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    error_rad = np.deg2rad(options.camera_angle_sigma_deg) * rng.standard_normal(3)
    rotation = rotation_exp(error_rad) @ np.array([right, np.cross(forward, right), forward])
    camera_from_world = RigidTransform(rotation, -rotation @ centre)
    return Rig(camera, camera_from_world @ radar_from_world.inverse(), radar_from_world)


def draw_flat_radar_rig(rng: np.random.Generator, radar: RadarOptions | None = None) -> RigOptions:
    """Draw the tilt and the height above the ground of a radar that measures no elevation.

    Both are normal with the standard deviations of the options; the height is positive, and at least 0.2 m.
    """
    radar = radar or RadarOptions()
    tilt_deg, height_m = np.array([radar.tilt_sigma_deg, radar.height_sigma_m]) * rng.standard_normal(2)
    return RigOptions(radar_height_m=max(0.2, abs(float(height_m))), radar_tilt_deg=float(tilt_deg))
