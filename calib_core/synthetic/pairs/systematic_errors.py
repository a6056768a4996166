"""Errors that all pairs of a set share: of the radar, the lens and the clicks; a simulated set has them on request.

With the true range, azimuth and elevation (r, a, e) of the reflector, the radar reports, before noise,

    r (1 + range_scale) + range_bias,   a (1 + azimuth_scale) + azimuth_bias,   e (1 + elevation_scale) + elevation_bias;

the click is at the projection through the true lens of the phase centre moved by the reflector offset, plus the click offset,
and the estimator is given intrinsics that are wrong.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Points2, Points3, Vector3
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.options import LensOptions, RadarOptions, ReflectorOptions
from calib_core.radar import polar_from_cartesian


@dataclass(frozen=True, slots=True)
class SystematicErrors:
    """One error of each kind; all zero by default, as of exact instruments."""

    azimuth_scale: float = 0.0
    """Reported azimuth over the true one, minus 1."""
    elevation_scale: float = 0.0
    """The same of the elevation."""
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
    def turns_axes(self) -> bool:
        """Whether the radar reports in other axes than its own."""
        return bool(self.azimuth_bias_deg or self.elevation_bias_deg)

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
        return polar_from_cartesian(points_radar_m) * (1.0 + scale) + bias

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
    drawn = rng.standard_normal(15)
    return SystematicErrors(
        azimuth_scale=radar.azimuth_scale_sigma * drawn[0],
        elevation_scale=radar.elevation_scale_sigma * drawn[1],
        range_bias_m=radar.range_bias_sigma_m * drawn[2],
        range_scale=radar.range_scale_sigma * drawn[3],
        click_offset_px=_pair(reflector.click_offset_sigma_px * drawn[4:6]),
        reflector_offset_m=_triple(reflector.offset_sigma_m * drawn[6:9]),
        principal_point_px=_pair(lens.principal_point_sigma_px * drawn[9:11]),
        focal_length=lens.focal_length_sigma * drawn[11],
        distortion=lens.distortion_sigma * drawn[12],
        azimuth_bias_deg=angle_biases * radar.azimuth_bias_sigma_deg * drawn[13],
        elevation_bias_deg=angle_biases * radar.elevation_bias_sigma_deg * drawn[14],
    )


def _pair(values: np.ndarray) -> tuple[float, float]:
    return float(values[0]), float(values[1])


def _triple(values: Vector3) -> tuple[float, float, float]:
    return float(values[0]), float(values[1]), float(values[2])
