"""The options of a simulated radar: which one it is, what it sends, and how it differs from a perfect one."""

from dataclasses import dataclass
from typing import Literal

from calib_core.options import option

RadarName = Literal["awr1843", "imaging"]
RadarMessage = Literal["filled", "stock", "cloud", "vendor"]
ReportedElevation = Literal["measured", "zero", "rounding"]
SecondAzimuth = Literal["none", "column", "topic"]


@dataclass(frozen=True, slots=True)
class RadarDefects:
    """How the radar differs from a perfect one, and what its driver does to the positions."""

    azimuth_scale: float = option(1.0, "Reported azimuth over the true one.", low=0.5, high=2.0)
    elevation_scale: float = option(1.0, "Reported elevation over the true one.", low=0.5, high=2.0)
    scaled: Literal["angle", "sine"] = option(
        "angle", "What the two scales multiply: the angle, or its sine, as a wrong spacing or wavelength does."
    )
    azimuth_bias_deg: float = option(0.0, "Constant azimuth error [deg].", low=-45.0, high=45.0)
    elevation_bias_deg: float = option(0.0, "Constant elevation error [deg].", low=-45.0, high=45.0)
    range_bias_m: float = option(0.0, "Constant range error [m].", low=-2.0, high=2.0)
    range_scale: float = option(1.0, "Reported range over the true one.", low=0.5, high=2.0)
    elevation: ReportedElevation = option(
        "measured", "Elevations: as measured, all zero as from a 2D radar, or a rounding error of 1e-6 rad."
    )
    z_offset_m: float = option(
        0.0, "What the driver adds to z, such as the height of the mount [m].", low=-10.0, high=10.0
    )
    mirrored: bool = option(False, "Have the driver report y to the right, which mirrors the scene.")
    length_unit_m: float = option(
        1.0, "Unit of the lengths that the driver reports, such as 0.001 for millimetres [m].", low=1e-4, high=10.0
    )
    range_bin_m: float | None = option(None, "Width of a range bin [m]; by default the radar's.", low=0.001, high=1.0)
    azimuth_bins: int | None = option(
        None, "Bins over the sine of the azimuth from -1 to 1, 0 to interpolate; by default the radar's.", high=4096
    )
    elevation_bins: int = option(0, "The same for the elevation.", low=0, high=4096)
    scatter_range_m: float | None = option(
        None, "Standard deviation of one scan's range [m]; by default the radar's.", low=0.0, high=2.0
    )
    scatter_azimuth_deg: float | None = option(
        None, "Standard deviation of one scan's azimuth [deg]; by default the radar's.", low=0.0, high=20.0
    )
    scatter_elevation_deg: float | None = option(
        None, "Standard deviation of one scan's elevation [deg]; by default the radar's.", low=0.0, high=20.0
    )
    constant_azimuth_deg: float | None = option(
        None,
        "Standard deviation of the azimuth error that stays the same while an object stands still [deg]; "
        "by default the radar's.",
        low=0.0,
        high=20.0,
    )
    constant_elevation_deg: float | None = option(
        None, "The same for the elevation [deg]; by default the radar's.", low=0.0, high=20.0
    )
    threshold_db: float | None = option(None, "Least SNR of a return [dB]; by default the radar's.", low=0.0, high=60.0)
    gain_db: float = option(
        0.0, "How much stronger every echo is, as with more antennas or a longer chirp [dB].", low=-40.0, high=40.0
    )
    max_speed_mps: float | None = option(
        None, "Largest speed that does not wrap around [m/s]; by default the radar's.", low=0.5, high=100.0
    )
    near_and_far: bool = option(
        False, "Publish near scans (25 Hz, up to 10 m) and far scans (20 Hz, from 5 m) as clouds in two topics."
    )
    second_azimuth: SecondAzimuth = option(
        "none", "Publish a second azimuth of each return: not, or in a column or a topic of its own; as clouds."
    )
    second_azimuth_share: float = option(
        0.15, "Share of the ranges at which the second azimuth is the true one.", low=0.0, high=1.0
    )
    cloud_topic: str = option("/ti_mmwave/radar_scan_pcl", "Topic of the radar's clouds, where it sends clouds.")
    ideal_topic: bool = option(
        False,
        "Publish the same returns in one topic, near and far ones of a moment in one cloud, each at its true azimuth.",
    )
    side_radar: bool = option(
        False, "Also publish the clouds of a weaker radar that looks 60 deg to the left, in /radar_left/points."
    )
