"""Radar returns from objects: the radar equation, bins, constant biases, misses and ghosts.

What a real radar and its driver do to a position comes last: scales, biases, missing elevation, a second azimuth. Positions
there are rows of direction cosines: range [m], sines of azimuth and elevation as in `direction_cosines`.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Flags, Indices, Points3, Values, frozen_array
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.measurements import RadarScan, TimeNs
from calib_core.radar import direction_cosines
from calib_core.synthetic.options import RadarDefects
from calib_core.synthetic.radar_profiles import RadarProfile

_MISSED = 0.02
_SIDE_LOBE_SHARE = 0.12
_SIDE_LOBE_DB = 11.0
_NO_DEFECTS = RadarDefects()


@dataclass(frozen=True, slots=True, eq=False)
class Targets:
    """The objects in front of the radar at one time.

    Attributes:
        points_radar_m: (n, 3) true positions.
        velocity_mps: (n,) true radial speeds, positive moving away.
        rcs_dbsm: (n,) radar cross-sections.
        fading_db: (n,) standard deviation of the echo's level from scan to scan.
        bias: (n, 3) constant errors of each object: range [m], sines of azimuth and elevation.
        hidden: (n,) whether a person stands in the way.
        tracks: the object that each is a part of, if that is to be known; "" for what nobody judges.
    """

    points_radar_m: Points3
    velocity_mps: Values
    rcs_dbsm: Values
    fading_db: Values
    bias: Points3
    hidden: Flags
    tracks: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        n = len(self.points_radar_m)
        for name, shape in (
            ("points_radar_m", (n, 3)),
            ("velocity_mps", (n,)),
            ("rcs_dbsm", (n,)),
            ("fading_db", (n,)),
            ("bias", (n, 3)),
        ):
            object.__setattr__(self, name, frozen_array(getattr(self, name), shape))
        object.__setattr__(self, "hidden", frozen_array(self.hidden, (n,), dtype=np.bool_))

    def __len__(self) -> int:
        return len(self.points_radar_m)

    def within(self, min_range_m: float, max_range_m: float) -> "Targets":
        """Return only the objects between two ranges."""
        range_m = np.linalg.norm(self.points_radar_m, axis=1)
        rows = (range_m >= min_range_m) & (range_m <= max_range_m)
        return Targets(
            self.points_radar_m[rows],
            self.velocity_mps[rows],
            self.rcs_dbsm[rows],
            self.fading_db[rows],
            self.bias[rows],
            self.hidden[rows],
            tuple(track for track, row in zip(self.tracks, rows, strict=True) if row) if self.tracks else (),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """A scan and the origin of its returns.

    Attributes:
        scan: as the sensor sends it.
        target: (m,) for each return in the scan's order, the target it comes from; -1 for a false alarm.
    """

    scan: RadarScan
    target: Indices

    def __post_init__(self) -> None:
        object.__setattr__(self, "target", frozen_array(self.target, (len(self.scan),), dtype=np.int64))


def measure(
    rng: np.random.Generator,
    targets: Targets,
    *,
    profile: RadarProfile,
    time: TimeNs,
    angle_bins: bool = True,
    calibration_phase: float = 0.0,
    defects: RadarDefects = _NO_DEFECTS,
) -> Measured:
    """Measure all targets once.

    Positions are as the sensor sends them: on bins, in single precision. The stock demo computes
    y = -R Wx, z = R Wz, x = sqrt(R^2 - y^2 - z^2) with Wx on its lattice.

    Args:
        rng: the only source of randomness.
        targets: the objects.
        profile: the radar.
        time: the stamp.
        angle_bins: whether azimuths lie on the profile's lattice.
        calibration_phase: where the smooth angle error is zero; a property of one radar.
        defects: how the radar differs from a perfect one.
    """
    echoes = _echoes(rng, targets, profile, calibration_phase)
    echoes = _with_side_lobes(rng, echoes, profile)
    echoes = _with_false_alarms(rng, echoes, profile)
    cosines, velocity = _on_bins(distorted(echoes.cosines, defects), echoes.velocity_mps, profile, angle_bins)
    kept = _resolved(cosines, velocity, echoes.snr_db, profile)
    kept = kept[np.argsort(cosines[kept, 0], kind="stable")]
    points = reported_points(rng, cosines[kept], defects).astype(np.float32).astype(np.float64)
    n = len(points)
    scan = RadarScan(
        time,
        points,
        velocity[kept].astype(np.float32).astype(np.float64),
        (np.round(10.0 * echoes.snr_db[kept]) / 10.0).astype(np.float32).astype(np.float64),
        np.full((n, 3), np.nan),
    )
    return Measured(scan, echoes.target[kept])


@dataclass(frozen=True, slots=True, eq=False)
class _Echoes:
    """What is detected: (m, 3) range and sines of the angles, (m,) speeds, SNR and number of the target or -1."""

    cosines: Points3
    velocity_mps: Values
    snr_db: Values
    target: Indices

    def and_also(self, cosines: Points3, velocity_mps: Values, snr_db: Values, target: Indices) -> "_Echoes":
        """Append others."""
        return _Echoes(
            np.concatenate([self.cosines, cosines]),
            np.concatenate([self.velocity_mps, velocity_mps]),
            np.concatenate([self.snr_db, snr_db]),
            np.concatenate([self.target, target]),
        )


def _echoes(rng: np.random.Generator, targets: Targets, profile: RadarProfile, phase: float) -> _Echoes:
    """Return the targets that are detected."""
    n = len(targets)
    true = direction_cosines(targets.points_radar_m)
    azimuth = np.arcsin(np.clip(true[:, 1], -1.0, 1.0))
    elevation = np.arcsin(np.clip(true[:, 2], -1.0, 1.0))
    gain_db = -3.0 * (azimuth / np.deg2rad(profile.beam_azimuth_deg)) ** 2
    gain_db -= 3.0 * (elevation / np.deg2rad(profile.beam_elevation_deg)) ** 2
    path_db = -40.0 * np.log10(np.maximum(true[:, 0], 0.3) / 10.0)
    snr = profile.snr_at_10_m_db + targets.rcs_dbsm + path_db + gain_db
    snr = snr + targets.fading_db * rng.standard_normal(n)
    noise = rng.standard_normal((n, 3)) * [profile.range_sigma_m, profile.azimuth_sigma, profile.elevation_sigma]
    weak = np.sqrt(1.0 + 10.0 ** ((14.0 - np.minimum(snr, 60.0)) / 10.0))  # thermal noise matters near the threshold
    cosines = true + targets.bias + noise * weak[:, None]
    cosines[:, 1] += profile.calibration_azimuth * np.sin(5.0 * true[:, 1] + phase)
    cosines[:, 2] += profile.calibration_elevation * np.cos(4.0 * true[:, 1] + 6.0 * true[:, 2] + phase)
    missed = rng.uniform(size=n) < _MISSED
    seen = (snr > profile.threshold_db) & ~missed & ~targets.hidden & (targets.points_radar_m[:, 0] > 0.1)
    return _Echoes(cosines[seen], targets.velocity_mps[seen], snr[seen], np.flatnonzero(seen))


def _with_side_lobes(rng: np.random.Generator, echoes: _Echoes, profile: RadarProfile) -> _Echoes:
    """Let strong echoes occasionally appear in a neighbouring range bin too."""
    snr = echoes.snr_db
    spill = (snr > profile.threshold_db + _SIDE_LOBE_DB + 3.0) & (rng.uniform(size=len(snr)) < _SIDE_LOBE_SHARE)
    extra = echoes.cosines[spill].copy()
    extra[:, 0] += rng.choice([-2.0, 2.0], size=len(extra)) * profile.range_bin_m
    extra[:, 2] += 2.0 * profile.elevation_sigma * rng.standard_normal(len(extra))
    return echoes.and_also(extra, echoes.velocity_mps[spill], snr[spill] - _SIDE_LOBE_DB, echoes.target[spill])


def _with_false_alarms(rng: np.random.Generator, echoes: _Echoes, profile: RadarProfile) -> _Echoes:
    """Add false returns."""
    n = int(rng.poisson(profile.false_alarms))
    fastest = 0.5 * profile.doppler_bins * profile.doppler_bin_mps
    anywhere = np.stack(
        [rng.uniform(0.6, 28.0, n), rng.uniform(-0.8, 0.8, n), rng.uniform(-0.3, 0.3, n)], axis=1
    ).reshape(-1, 3)
    speeds = rng.uniform(-fastest, fastest, n)
    return echoes.and_also(
        anywhere, speeds, profile.threshold_db + rng.exponential(1.5, n), np.full(n, -1, dtype=np.int64)
    )


def _on_bins(cosines: Points3, velocity: Values, profile: RadarProfile, angle_bins: bool) -> tuple[Points3, Values]:
    """Round range, azimuth and speed to the radar's bins."""
    cosines = cosines.copy()
    cosines[:, 0] = np.round(cosines[:, 0] / profile.range_bin_m) * profile.range_bin_m
    if angle_bins and profile.angle_bins:
        half = profile.angle_bins / 2.0
        cosines[:, 1] = np.clip(np.round(cosines[:, 1] * half), -half, half - 1.0) / half
    if profile.elevation_bins:
        half = profile.elevation_bins / 2.0
        cosines[:, 2] = np.clip(np.round(cosines[:, 2] * half), -half, half - 1.0) / half
    cosines[:, 2] = np.clip(cosines[:, 2], -0.95, 0.95)
    half_bins = profile.doppler_bins // 2
    index = np.round(velocity / profile.doppler_bin_mps)
    index = (index + half_bins) % profile.doppler_bins - half_bins
    return cosines, index * profile.doppler_bin_mps


def _resolved(cosines: Points3, velocity: Values, snr: Values, profile: RadarProfile) -> np.ndarray:
    """Return the rows that give separate returns: of close ones only the strongest."""
    kept: list[int] = []
    for i in np.argsort(-snr, kind="stable").tolist():
        near = [
            j
            for j in kept
            if abs(cosines[i, 0] - cosines[j, 0]) < 1.5 * profile.range_bin_m
            and abs(cosines[i, 1] - cosines[j, 1]) < profile.resolution_azimuth
            and abs(velocity[i] - velocity[j]) < 0.5 * profile.doppler_bin_mps
        ]
        if not near and cosines[i, 0] > 0.0 and cosines[i, 1] ** 2 + cosines[i, 2] ** 2 < 1.0:
            kept.append(i)
    return np.array(kept, dtype=np.int64)


_ROUNDING_RAD = 1e-6
_PERIOD = 0.6
"""Distance of the two azimuths in sine: antennas 1.7 wavelengths apart cannot tell them apart."""
_FADING_M = 0.9
"""How often over range the wrong one of two azimuths is taken for the better one."""


def distorted(cosines: Points3, defects: RadarDefects) -> Points3:
    """Apply scales and biases to what a perfect radar would measure."""
    ideal = RadarDefects()
    names = (
        "azimuth_scale",
        "elevation_scale",
        "azimuth_bias_deg",
        "elevation_bias_deg",
        "range_bias_m",
        "range_scale",
    )
    if all(getattr(defects, name) == getattr(ideal, name) for name in names):
        return cosines
    r, u, w = cosines.T
    elevation = np.arcsin(np.clip(w, -1.0, 1.0))
    azimuth = np.arctan2(u, np.sqrt(np.maximum(0.0, 1.0 - u * u - w * w)))
    azimuth = _scaled(azimuth, defects.azimuth_scale, defects) + np.deg2rad(defects.azimuth_bias_deg)
    elevation = _scaled(elevation, defects.elevation_scale, defects) + np.deg2rad(defects.elevation_bias_deg)
    range_m = r * defects.range_scale + defects.range_bias_m
    return np.stack([range_m, np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], axis=1)


def _scaled(angle_rad: Values, scale: float, defects: RadarDefects) -> Values:
    if defects.scaled == "angle":
        return angle_rad * scale
    return np.arcsin(np.clip(np.sin(angle_rad) * scale, -1.0, 1.0))


def reported_points(rng: np.random.Generator, cosines: Points3, defects: RadarDefects) -> Points3:
    """Convert to x, y, z as the driver does: with its axes, its unit and its origin of z, and perhaps without elevation.

    Args:
        rng: used for the rounding error only.
        cosines: (n, 3) the measured ones.
        defects: what the driver does.
    """
    r, u, w = cosines.T
    if defects.elevation != "measured":
        size = _ROUNDING_RAD if defects.elevation == "rounding" else 0.0
        w = size * rng.uniform(-1.0, 1.0, len(w)) if size else np.zeros(len(w))
    x = r * np.sqrt(np.maximum(0.0, 1.0 - u * u - w * w))
    z = r * w + defects.z_offset_m if defects.z_offset_m else r * w
    points = np.stack([x, -r * u if defects.mirrored else r * u, z], axis=1)
    return points if defects.length_unit_m == 1.0 else points / defects.length_unit_m


def radar_from_reported(defects: RadarDefects) -> RigidTransform:
    """Return the radar's frame from the frame in which it reports: a bias of the angles turns it, an offset of z moves it.

    The azimuth's bias and the offset of z are exactly such a motion, the elevation's bias only straight ahead.
    """
    turn = rotation_exp(np.array([0.0, 0.0, -np.deg2rad(defects.azimuth_bias_deg)]))
    nod = rotation_exp(np.array([0.0, np.deg2rad(defects.elevation_bias_deg), 0.0]))
    rotation = nod @ turn
    return RigidTransform(rotation, -rotation @ np.array([0.0, 0.0, defects.z_offset_m]))


def second_azimuths(points_radar_m: Points3) -> Points3:
    """Return the positions (n, 3) [m] with the other azimuth that the antennas cannot tell apart from the given one."""
    x, y, z = points_radar_m.T
    across = np.hypot(x, y)
    far = np.maximum(np.hypot(across, z), 1e-9)
    u = y / far
    other = far * (u - np.where(u >= 0.0, _PERIOD, -_PERIOD))
    return np.stack([np.sqrt(np.maximum(0.0, across**2 - other**2)), other, z], axis=1)


def second_is_true(range_m: Values, phase: float, share: float) -> Flags:
    """Return at which ranges the radar takes the wrong azimuth for the better one: a pattern of reflections, not chance.

    Args:
        range_m: (n,) of the returns.
        phase: where the pattern begins, 0 to 1; a property of one recording.
        share: of all ranges.
    """
    return np.asarray((range_m / _FADING_M + phase) % 1.0 < share)
