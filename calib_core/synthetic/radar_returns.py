"""Radar returns from objects: the radar equation, bins, constant biases, misses and ghosts.

What a real radar and its driver do to a position comes last: scales, biases, missing elevation, a second azimuth. Positions
there are rows of direction cosines: range [m], sines of azimuth and elevation as in `direction_cosines`.

Two kinds of radar have a resolution and a noise, which the options change; one antenna, or two that scan in turn. The values are
assumptions in line with vendors' figures and with an array simulation; no real radar was measured.
"""

from dataclasses import dataclass, fields, replace

import numpy as np

from calib_core.arrays import Flags, Indices, Points3, Values, freeze
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.measurements import RadarScan, TimeNs
from calib_core.radar import direction_cosines
from calib_core.synthetic.options import RadarDefects, RadarName, SimulationOptions
from calib_core.synthetic.timeline import RecordedSegments, SensorTimes, draw_times


@dataclass(frozen=True, slots=True)
class RadarProfile:
    """A radar in its measurement coordinates: range, sines of the angles, Doppler."""

    range_bin_m: float
    """Width of a range bin [m]; positions lie on bins."""
    angle_bins: int
    """Bins over the sine of the azimuth from -1 to 1 (64 gives a lattice of 1/32); 0 interpolates."""
    doppler_bin_mps: float
    """Width of a Doppler bin [m/s]; a speed below half of it has Doppler exactly 0."""
    doppler_bins: int
    """Bins from the fastest approaching to the fastest receding; beyond these, speeds wrap around."""
    range_sigma_m: float
    """Noise of one scan's range, before binning [m]."""
    azimuth_sigma: float
    """Noise of one scan's sine of azimuth."""
    elevation_sigma: float
    """Noise of one scan's sine of elevation."""
    azimuth_bias_sigma: float
    """Standard deviation of the part of the azimuth error that is constant for each object (multipath, clutter below it)."""
    elevation_bias_sigma: float
    """The same for the elevation."""
    calibration_azimuth: float
    """Amplitude of the smooth azimuth error over the field of view."""
    calibration_elevation: float
    """The same for the elevation."""
    snr_at_10_m_db: float
    """SNR of a 0 dBsm object at 10 m on the axis [dB]."""
    threshold_db: float
    """Least SNR of a return [dB]."""
    beam_azimuth_deg: float
    """Half-power half-width of the antenna in azimuth [deg], two-way."""
    beam_elevation_deg: float
    """The same for the elevation [deg]."""
    resolution_azimuth: float
    """Two objects in one range bin closer than this in sine of azimuth give one return."""
    false_alarms: float
    """Mean number of false returns per scan."""
    latency_s: float
    """Delay from the measurement to its stamp [s]."""
    elevation_bins: int = 0
    """Bins over the sine of the elevation from -1 to 1; 0 interpolates."""


RADAR_PROFILES: dict[RadarName, RadarProfile] = {
    "awr1843": RadarProfile(
        range_bin_m=0.0436,
        angle_bins=64,
        doppler_bin_mps=0.1256,
        doppler_bins=32,
        range_sigma_m=0.012,
        azimuth_sigma=0.0035,
        elevation_sigma=0.010,
        azimuth_bias_sigma=0.0025,
        elevation_bias_sigma=0.012,
        calibration_azimuth=0.0025,
        calibration_elevation=0.004,
        snr_at_10_m_db=16.0,
        threshold_db=11.0,
        beam_azimuth_deg=38.0,
        beam_elevation_deg=18.0,
        resolution_azimuth=0.25,
        false_alarms=0.12,
        latency_s=0.018,
    ),
    "imaging": RadarProfile(
        range_bin_m=0.03,
        angle_bins=0,
        doppler_bin_mps=0.05,
        doppler_bins=256,
        range_sigma_m=0.015,
        azimuth_sigma=0.0012,
        elevation_sigma=0.003,
        azimuth_bias_sigma=0.0012,
        elevation_bias_sigma=0.003,
        calibration_azimuth=0.0008,
        calibration_elevation=0.0015,
        snr_at_10_m_db=22.0,
        threshold_db=10.0,
        beam_azimuth_deg=50.0,
        beam_elevation_deg=22.0,
        resolution_azimuth=0.02,
        false_alarms=0.5,
        latency_s=0.030,
    ),
}


def profile_with(name: RadarName, defects: RadarDefects) -> RadarProfile:
    """Return a radar's profile with the bins and the scatter that the options ask for."""
    usual = RADAR_PROFILES[name]
    fastest_mps = defects.max_speed_mps
    changes: dict[str, float | int | None] = {
        "range_bin_m": defects.range_bin_m,
        "angle_bins": defects.azimuth_bins,
        "elevation_bins": defects.elevation_bins,
        "range_sigma_m": defects.scatter_range_m,
        "azimuth_sigma": _sine(defects.scatter_azimuth_deg),
        "elevation_sigma": _sine(defects.scatter_elevation_deg),
        "azimuth_bias_sigma": _sine(defects.constant_azimuth_deg),
        "elevation_bias_sigma": _sine(defects.constant_elevation_deg),
        "threshold_db": defects.threshold_db,
        "snr_at_10_m_db": usual.snr_at_10_m_db + defects.gain_db,
        "doppler_bin_mps": None if fastest_mps is None else 2.0 * fastest_mps / usual.doppler_bins,
    }
    return replace(usual, **{key: value for key, value in changes.items() if value is not None})  # type: ignore[arg-type]


def _sine(angle_deg: float | None) -> float | None:
    return None if angle_deg is None else float(np.sin(np.deg2rad(angle_deg)))


_NEAR_HZ, _NEAR_END_M = 25.0, 10.0
_FAR_HZ, _FAR_BEGIN_M = 20.0, 5.0
_NEAR_BEAM_DEG, _FAR_BEAM_DEG = 60.0, 20.0
_NEAR_GAIN_DB, _FAR_GAIN_DB = -4.0, 8.0
_NEAR_COARSER = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class Antenna:
    """One antenna with scans of its own.

    Attributes:
        name: "near" or "far"; "" for the only one.
        profile: what it resolves.
        times: when it scanned.
        min_range_m: nearest object in its scans [m].
        max_range_m: farthest [m].
    """

    name: str
    profile: RadarProfile
    times: SensorTimes
    min_range_m: float = 0.0
    max_range_m: float = np.inf


def antennas_of(
    options: SimulationOptions,
    profile: RadarProfile,
    rngs: tuple[np.random.Generator, np.random.Generator],
    *,
    duration_s: float,
    segments: RecordedSegments,
) -> tuple[Antenna, ...]:
    """Return the antennas with their times; of two the far one first.

    Args:
        options: what to simulate.
        profile: of the radar.
        rngs: the only source of randomness of the first and the second antenna.
        duration_s: of the story.
        segments: what of it is recorded.
    """

    def times(rng: np.random.Generator, rate_hz: float) -> SensorTimes:
        return draw_times(rng, duration_s, rate_hz, latency_s=profile.latency_s, transfer_s=0.003, segments=segments)

    if not options.defects.near_and_far:
        return (Antenna("", profile, times(rngs[0], options.radar_rate_hz)),)
    near = replace(
        profile,
        beam_azimuth_deg=_NEAR_BEAM_DEG,
        snr_at_10_m_db=profile.snr_at_10_m_db + _NEAR_GAIN_DB,
        azimuth_sigma=_NEAR_COARSER * profile.azimuth_sigma,
        resolution_azimuth=_NEAR_COARSER * profile.resolution_azimuth,
    )
    far = replace(profile, beam_azimuth_deg=_FAR_BEAM_DEG, snr_at_10_m_db=profile.snr_at_10_m_db + _FAR_GAIN_DB)
    return (
        Antenna("far", far, times(rngs[0], _FAR_HZ), min_range_m=_FAR_BEGIN_M),
        Antenna("near", near, times(rngs[1], _NEAR_HZ), max_range_m=_NEAR_END_M),
    )


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
        freeze(self, points_radar_m=(n, 3), bias=(n, 3), velocity_mps=(n,), rcs_dbsm=(n,), fading_db=(n,))
        freeze(self, np.bool_, hidden=(n,))

    def __len__(self) -> int:
        return len(self.points_radar_m)

    def within(self, min_range_m: float, max_range_m: float) -> "Targets":
        """Return only the objects between two ranges."""
        range_m = np.linalg.norm(self.points_radar_m, axis=1)
        rows = np.flatnonzero((range_m >= min_range_m) & (range_m <= max_range_m))
        columns = {field.name: getattr(self, field.name)[rows] for field in fields(self)[:-1]}
        return Targets(**columns, tracks=tuple(self.tracks[row] for row in rows))


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
        freeze(self, np.int64, target=(len(self.scan),))


def measure(
    rng: np.random.Generator,
    targets: Targets,
    *,
    profile: RadarProfile,
    time: TimeNs,
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
        calibration_phase: where the smooth angle error is zero; a property of one radar.
        defects: how the radar differs from a perfect one.
    """
    echoes = _echoes(rng, targets, profile, calibration_phase)
    echoes = _with_side_lobes(rng, echoes, profile)
    echoes = _with_false_alarms(rng, echoes, profile)
    cosines, velocity = _on_bins(distorted(echoes.cosines, defects), echoes.velocity_mps, profile)
    kept = _resolved(cosines, velocity, echoes.snr_db, profile)
    kept = kept[np.argsort(cosines[kept, 0], kind="stable")]
    points = reported_points(cosines[kept], defects).astype(np.float32).astype(np.float64)
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


def _on_bins(cosines: Points3, velocity: Values, profile: RadarProfile) -> tuple[Points3, Values]:
    """Round range, azimuth and speed to the radar's bins."""
    cosines = cosines.copy()
    cosines[:, 0] = np.round(cosines[:, 0] / profile.range_bin_m) * profile.range_bin_m
    for column, bins in ((1, profile.angle_bins), (2, profile.elevation_bins)):
        if bins:
            half = bins / 2.0
            cosines[:, column] = np.clip(np.round(cosines[:, column] * half), -half, half - 1.0) / half
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


_PERIOD = 0.6
"""Distance of the two azimuths in sine: antennas 1.7 wavelengths apart cannot tell them apart."""


def distorted(cosines: Points3, defects: RadarDefects) -> Points3:
    """Apply scales and biases to what a perfect radar would measure."""
    scales = defects.range_scale, defects.azimuth_scale, defects.elevation_scale
    if scales == (1.0, 1.0, 1.0) and not (
        defects.range_bias_m or defects.azimuth_bias_deg or defects.elevation_bias_deg
    ):
        return cosines
    r, u, w = cosines.T
    elevation = np.arcsin(np.clip(w, -1.0, 1.0))
    azimuth = np.arctan2(u, np.sqrt(np.maximum(0.0, 1.0 - u * u - w * w)))
    azimuth = azimuth * defects.azimuth_scale + np.deg2rad(defects.azimuth_bias_deg)
    elevation = elevation * defects.elevation_scale + np.deg2rad(defects.elevation_bias_deg)
    range_m = r * defects.range_scale + defects.range_bias_m
    return np.stack([range_m, np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], axis=1)


def reported_points(cosines: Points3, defects: RadarDefects) -> Points3:
    """Convert to x, y, z as the driver does: with its axes and its unit, and perhaps without elevation.

    Args:
        cosines: (n, 3) the measured ones.
        defects: what the driver does.
    """
    r, u, w = cosines.T
    if defects.elevation == "zero":
        w = np.zeros(len(w))
    x = r * np.sqrt(np.maximum(0.0, 1.0 - u * u - w * w))
    points = np.stack([x, -r * u if defects.mirrored else r * u, r * w], axis=1)
    return points if defects.length_unit_m == 1.0 else points / defects.length_unit_m


def radar_from_reported(defects: RadarDefects) -> RigidTransform:
    """Return the radar's frame from the frame in which it reports: a bias of the angles turns it.

    The azimuth's bias is exactly such a turn, the elevation's bias only straight ahead.
    """
    turn = rotation_exp(np.array([0.0, 0.0, -np.deg2rad(defects.azimuth_bias_deg)]))
    nod = rotation_exp(np.array([0.0, np.deg2rad(defects.elevation_bias_deg), 0.0]))
    return RigidTransform(nod @ turn, np.zeros(3))


def second_azimuths(points_radar_m: Points3) -> Points3:
    """Return the positions (n, 3) [m] with the other azimuth that the antennas cannot tell apart from the given one."""
    x, y, z = points_radar_m.T
    across = np.hypot(x, y)
    far = np.maximum(np.hypot(across, z), 1e-9)
    u = y / far
    other = far * (u - np.where(u >= 0.0, _PERIOD, -_PERIOD))
    return np.stack([np.sqrt(np.maximum(0.0, across**2 - other**2)), other, z], axis=1)
