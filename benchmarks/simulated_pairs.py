"""Simulated pairs with known truth, without a recording, to test and benchmark the estimators.

A set has errors that all its pairs share, of the radar, the lens and the clicks, on request.
With the true range, azimuth and elevation (r, a, e) of the reflector, the radar reports, before noise,

    r (1 + range_scale) + range_bias,   a (1 + azimuth_scale) + azimuth_bias,   e (1 + elevation_scale) + elevation_bias;

the click is at the projection through the true lens of the phase centre moved by the reflector offset, plus the click offset,
and the estimator is given intrinsics that are wrong.
"""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from calib_core.arrays import Flags, Points2, Points3, Vector3, freeze
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.measurements import Candidate, Pair
from calib_core.options import LensOptions, NoiseOptions, RadarOptions, ReflectorOptions
from calib_core.radar import cartesian_from_polar, covariance_from_sigma_polar, polar_from_cartesian, sigma_polar_of
from calib_core.synthetic.rig import Rig, RigOptions, random_rig, typical_camera
from calib_core.synthetic.scene.scenes import PairsLayout
from calib_core.synthetic.scene.stage import draw_positions


@dataclass(frozen=True, slots=True)
class SystematicErrors:
    """One error of each kind; all zero by default, as of exact instruments."""

    azimuth_scale: float = 0.0
    """Reported azimuth over the true one, minus 1."""
    elevation_scale: float = 0.0
    """The same of the elevation."""
    elevation_lean: float = 0.0
    """Reported elevation minus the true one, over the azimuth: a rolled or sheared array."""
    azimuth_bias_deg: float = 0.0
    """Reported azimuth minus the true one [deg]; it turns the reported axes, and the true pose is that of these axes."""
    elevation_bias_deg: float = 0.0
    """The same of the elevation [deg]; nearly a rotation."""
    range_bias_m: float = 0.0
    """Reported range minus the true one [m]."""
    range_scale: float = 0.0
    """Reported range over the true one, minus 1."""
    click_offset_px: tuple[float, float] = (0.0, 0.0)
    """Every click minus the pixel that was meant: right, down [px]."""
    reflector_offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Clicked point minus phase centre along the camera's axes: right, down, forward [m]."""
    principal_point_px: tuple[float, float] = (0.0, 0.0)
    """Given principal point minus the true one: right, down [px]."""
    focal_length: float = 0.0
    """Given focal length over the true one, minus 1."""
    distortion: float = 0.0
    """Given first radial distortion coefficient minus the true one."""
    measures_elevation: bool = True
    """If false, the radar reports its range and azimuth in a plane, whatever the elevation."""
    constant_z_m: float = 0.0
    """The z that a radar without elevation reports for every return, such as its mounting height [m]."""

    @property
    def turn_of_axes(self) -> RigidTransform:
        """The rotation from the radar's true axes to those in which it reports: that of the angles' biases."""
        azimuth_rad, elevation_rad = np.deg2rad([self.azimuth_bias_deg, self.elevation_bias_deg])
        turn = rotation_exp(np.array([0.0, 0.0, azimuth_rad])) @ rotation_exp(np.array([0.0, -elevation_rad, 0.0]))
        return RigidTransform(turn, np.zeros(3))

    def reported_polar(self, points_radar_m: Points3) -> Points3:
        """Return the range [m], azimuth and elevation [rad] (n, 3) that the radar reports for true positions (n, 3)."""
        scale = np.array([self.range_scale, self.azimuth_scale, self.elevation_scale])
        bias = np.array([self.range_bias_m, *np.deg2rad([self.azimuth_bias_deg, self.elevation_bias_deg])])
        polar = polar_from_cartesian(points_radar_m)
        bias = bias + self.elevation_lean * np.outer(polar[:, 1], [0.0, 0.0, 1.0])
        return polar * (1.0 + scale) + bias

    def without_elevation(self, points_radar_m: Points3) -> Points3:
        """Return positions (n, 3) as reported: a radar that measures no elevation keeps range and azimuth only."""
        if self.measures_elevation:
            return points_radar_m
        range_m, azimuth_rad, _ = polar_from_cartesian(points_radar_m).T
        z_m = np.full_like(range_m, self.constant_z_m)
        return np.stack([range_m * np.cos(azimuth_rad), range_m * np.sin(azimuth_rad), z_m], axis=1)

    def aimed_pixels(self, camera: Camera, points_camera_m: Points3) -> Points2:
        """Return where the clicks are meant to be (n, 2) [px] for phase centres (n, 3), seen through the true lens."""
        return camera.project(points_camera_m + np.array(self.reflector_offset_m)) + np.array(self.click_offset_px)

    def given_camera(self, camera: Camera) -> Camera:
        """Return the intrinsics that the estimator is given, from the true ones."""
        if not (any(self.principal_point_px) or self.focal_length or self.distortion):
            return camera
        matrix, distortion = camera.matrix_px.copy(), camera.distortion.copy()
        matrix[:2, :2] *= 1.0 + self.focal_length
        matrix[:2, 2] += self.principal_point_px
        distortion[:1] += self.distortion
        return Camera(camera.model, camera.width_px, camera.height_px, matrix, distortion)


def draw_systematic_errors(
    rng: np.random.Generator,
    *,
    radar: RadarOptions | None = None,
    lens: LensOptions | None = None,
    reflector: ReflectorOptions | None = None,
    angle_biases: bool = False,
) -> SystematicErrors:
    """Draw errors from normal distributions with the standard deviations that the options state.

    Args:
        rng: the only source of randomness; as many numbers are drawn whatever the options.
        radar: None takes the defaults.
        lens: None takes the defaults.
        reflector: None takes the defaults.
        angle_biases: draw the biases of the angles too; they are a rotation, so no pair can tell them from the pose.
    """
    radar, lens, reflector = radar or RadarOptions(), lens or LensOptions(), reflector or ReflectorOptions()
    click_px, offset_m = reflector.click_offset_sigma_px, reflector.offset_sigma_m
    point_px, drawn = lens.principal_point_sigma_px, rng.standard_normal(15).tolist()
    return SystematicErrors(
        azimuth_scale=radar.azimuth_scale_sigma * drawn[0],
        elevation_scale=radar.elevation_scale_sigma * drawn[1],
        range_bias_m=radar.range_bias_sigma_m * drawn[2],
        range_scale=radar.range_scale_sigma * drawn[3],
        click_offset_px=(click_px * drawn[4], click_px * drawn[5]),
        reflector_offset_m=(offset_m * drawn[6], offset_m * drawn[7], offset_m * drawn[8]),
        principal_point_px=(point_px * drawn[9], point_px * drawn[10]),
        focal_length=lens.focal_length_sigma * drawn[11],
        distortion=lens.distortion_sigma * drawn[12],
        azimuth_bias_deg=angle_biases * radar.azimuth_bias_sigma_deg * drawn[13],
        elevation_bias_deg=angle_biases * radar.elevation_bias_sigma_deg * drawn[14],
        elevation_lean=radar.elevation_lean_sigma * float(rng.spawn(1)[0].standard_normal()),
    )


NoiseName = Literal["ti", "ti_fine", "ti_aisle", "imaging", "none"]

NOISE_PROFILES: dict[NoiseName, NoiseOptions] = {
    "ti": NoiseOptions(2.0, 0.015, 0.55, 1.0),
    "ti_fine": NoiseOptions(2.0, 0.008, 0.20, 0.7),
    "ti_aisle": NoiseOptions(2.0, 0.02, 0.8, 2.0),
    "imaging": NoiseOptions(2.0, 0.03, 0.12, 0.25),
    "none": NoiseOptions(0.0, 0.0, 0.0, 0.0),
}
"""Assumed noise of radar families; "none" is exact, and its candidates have the "ti_fine" sigmas."""


FIELD = PairsLayout()
AISLE = PairsLayout(max_range_m=15.0, max_lateral_m=1.2)


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedPairs:
    """Pairs and their truth.

    Attributes:
        rig: the sensors as they are, with the true intrinsics.
        pairs: the input of an estimator; ids "p1", "p2", ...
        points_radar_m: (n, 3) true positions of the reflector's phase centre, in the axes in which the radar reports.
        pixels_px: (n, 2) their true pixels.
        outlier: (n,) whether the pair is wrong.
        true_candidate: for each pair, which of its candidates is the reflector; -1 for an outlier.
        systematic: the errors that all pairs share.
    """

    rig: Rig
    pairs: tuple[Pair, ...]
    points_radar_m: Points3
    pixels_px: Points2
    outlier: Flags
    true_candidate: tuple[int, ...]
    systematic: SystematicErrors = field(default_factory=SystematicErrors)

    def __post_init__(self) -> None:
        n = len(self.pairs)
        freeze(self, points_radar_m=(n, 3), pixels_px=(n, 2))
        freeze(self, np.bool_, outlier=(n,))

    @property
    def camera(self) -> Camera:
        """The intrinsics that an estimator is given."""
        return self.systematic.given_camera(self.rig.camera)

    @property
    def camera_from_radar(self) -> RigidTransform:
        """The true pose of the axes in which the radar reports."""
        return self.rig.camera_from_radar @ self.systematic.turn_of_axes.inverse()


def simulate_pairs(
    count: int = 20,
    *,
    rng: np.random.Generator,
    noise: NoiseOptions | NoiseName = "ti",
    outlier_share: float = 0.0,
    decoys: int = 0,
    layout: PairsLayout = FIELD,
    camera: Camera | None = None,
    rig_options: RigOptions | None = None,
    rig: Rig | None = None,
    systematic: SystematicErrors | None = None,
) -> SimulatedPairs:
    """Draw a rig and pairs of clicks and radar positions.

    The number of outliers is round(outlier_share * count); which pairs they are is random. Half of them are ghosts, a quarter
    each misclicks and wrong pairings.

    Args:
        count: pairs.
        rng: the only source of randomness.
        noise: standard deviations, or the name of a noise profile.
        outlier_share: 0 to 1.
        decoys: additional, wrong candidates per pair. The right one is the most plausible in two pairs out of three.
        layout: where the reflector is put.
        camera: the true intrinsics; None takes 1920 x 1080 with 75 deg and slight barrel distortion.
        rig_options: how the sensors are mounted; None takes the defaults.
        rig: sensors to use instead of random ones.
        systematic: errors that all pairs share; None has none.
    """
    profile = NOISE_PROFILES[noise] if isinstance(noise, str) else noise
    rig = rig or random_rig(rng, camera=camera or study_camera(), options=rig_options)
    systematic = systematic or SystematicErrors()
    points = draw_positions(rng, count=count, rig=rig, layout=layout)
    aimed = systematic.aimed_pixels(rig.camera, rig.camera_from_radar @ points)
    polar = systematic.reported_polar(points)
    reported = points if systematic == SystematicErrors() else cartesian_from_polar(polar)
    measured = cartesian_from_polar(polar + sigma_polar_of(profile) * rng.standard_normal(points.shape))
    clicks = aimed + profile.sigma_px * rng.standard_normal(aimed.shape)
    outlier = np.zeros(count, dtype=np.bool_)
    outlier[rng.permutation(count)[: round(outlier_share * count)]] = True
    for i in np.flatnonzero(outlier).tolist():
        _make_outlier(rng, i, measured, clicks, rig=rig, layout=layout, reported=reported)
    sigma_polar = sigma_polar_of(profile if profile.sigma_range_m > 0 else NOISE_PROFILES["ti_fine"])
    pairs, true_candidate = [], []
    for i in range(count):
        positions, chosen = _positions(rng, measured[i], decoys, rig, layout)
        candidates = _candidates(systematic.without_elevation(positions), sigma_polar)
        pairs.append(Pair(f"p{i + 1}", clicks[i], candidates, sigma_px=max(profile.sigma_px, 0.5)))
        true_candidate.append(-1 if outlier[i] else chosen)
    in_axes = systematic.turn_of_axes @ points
    pixels = rig.camera.project(rig.camera_from_radar @ points)
    return SimulatedPairs(rig, tuple(pairs), in_axes, pixels, outlier, tuple(true_candidate), systematic)


def study_camera() -> Camera:
    """Return the camera of the noise study: 1920 x 1080, 75 deg, slight barrel distortion."""
    plain = typical_camera("plumb_bob", width_px=1920, height_px=1080)
    matrix = plain.matrix_px.copy()
    matrix[:2, 2] = [959.5, 539.5]
    matrix[1, 1] = matrix[0, 0]
    return Camera("plumb_bob", 1920, 1080, matrix, np.array([-0.10, 0.02, 0.0, 0.0]))


def _anywhere(rng: np.random.Generator, rig: Rig, layout: PairsLayout) -> Vector3:
    """Draw a position in front of the radar: a wider field than the reflector's, at any height up to 2 m."""
    range_m = rng.uniform(layout.min_range_m, 1.3 * layout.max_range_m)
    widest_deg = 1.3 * layout.max_azimuth_deg
    azimuth_rad = np.deg2rad(rng.uniform(-widest_deg, widest_deg))
    world = np.array([range_m * np.cos(azimuth_rad), range_m * np.sin(azimuth_rad), rng.uniform(0.0, 2.0)])
    return (rig.radar_from_world @ world[None])[0]


def _make_outlier(
    rng: np.random.Generator,
    i: int,
    measured: Points3,
    clicks: Points2,
    *,
    rig: Rig,
    layout: PairsLayout,
    reported: Points3,
) -> None:
    """Turn pair i into an outlier, in place; reported: (n, 3) what the radar reports without noise.

    A ghost is a reflection anywhere in the field of view, a misclick anywhere in the image, and a wrong pairing has the
    radar position of another placement.
    """
    kind = rng.uniform(0.0, 1.0)
    if kind < 0.5:
        measured[i] = _anywhere(rng, rig, layout)
    elif kind < 0.75 or len(reported) < 2:
        clicks[i] = rng.uniform([0.0, 0.0], [rig.camera.width_px - 1.0, rig.camera.height_px - 1.0])
    else:
        other = int(rng.integers(len(reported) - 1))
        measured[i] = reported[other + (other >= i)] + 0.02 * rng.standard_normal(3)


def _positions(
    rng: np.random.Generator, measured: Vector3, decoys: int, rig: Rig, layout: PairsLayout
) -> tuple[Points3, int]:
    """Return the radar positions of a pair, the most plausible first, and which of them is the measured one."""
    positions = [_anywhere(rng, rig, layout) for _ in range(decoys)]
    place = 0 if decoys == 0 or rng.uniform() < 2.0 / 3.0 else int(rng.integers(1, decoys + 1))
    positions.insert(place, measured)
    return np.array(positions), place


def _candidates(positions: Points3, sigma_polar: Vector3) -> tuple[Candidate, ...]:
    """Build the candidates of a pair from their positions (k, 3), the most plausible first."""
    shares = 0.5 ** np.arange(1, len(positions) + 1)
    covariances = covariance_from_sigma_polar(positions, np.tile(sigma_polar, (len(positions), 1)))
    return tuple(
        Candidate(position, sigma_polar, covariance, score=float(share / shares.sum()), returns=30, scans=30)
        for position, covariance, share in zip(positions, covariances, shares, strict=True)
    )
