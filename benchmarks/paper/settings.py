"""The one set of settings for all rows, and the simulated sessions that it makes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

from calib_core.options import CalibrationOptions, CameraPositionPrior, PaperOptions, SolvingOptions
from calib_core.synthetic import PRESETS, PresetName, SimulatedScans, SimulationOptions, simulate_scans

__all__ = [
    "FITTED",
    "FIT_SEEDS",
    "SEEDS",
    "Dataset",
    "Settings",
    "pmm_options",
    "ppm_options",
    "session",
]

Dataset: TypeAlias = Literal["d1", "d2", "d3", "dr-a", "dr-b"]
SEEDS: Sequence[int] = range(1, 21)
FIT_SEEDS: Sequence[int] = range(101, 105)
"""Of the fit; none of the table's."""

BOARD_CORNERS = 20
"""Placements of D2."""
_USUAL_EDGE_M = SimulationOptions().reflector_edge_m


@dataclass(frozen=True, slots=True)
class Settings:
    """What the paper does not say, or is not available to us.

    Attributes:
        constant_azimuth_deg: standard deviation of the azimuth error that a placement keeps [deg]; fitted.
        constant_elevation_deg: the same for the elevation [deg]; fitted.
        width_px: of the pictures, which are 16 to 9.
        mounting_error_deg: standard deviation of the true rotation about the nominal one, per axis [deg].
        placements: of the reflector on the ground, in each data set.
        outshone_share: share of those errors' variance that comes from clutter below the reflector: a larger reflector,
            whose echo grows with the fourth power of its edge, outshines it. The rest is multipath, which grows with it.
        ransac_threshold_px: of Algorithm 1.
    """

    constant_azimuth_deg: float
    constant_elevation_deg: float
    width_px: int = 1920
    mounting_error_deg: float = 3.0
    placements: int = 40
    outshone_share: float = 0.5
    ransac_threshold_px: float = 8.0


FITTED = Settings(constant_azimuth_deg=0.6, constant_elevation_deg=0.4)
"""The best place of the grid that `python -m benchmarks.paper --fit` searches, on PPM+D1 and PPM+D2 alone: see fit.json."""


def options_of(
    dataset: Dataset, seed: int, settings: Settings, board_corners: int = BOARD_CORNERS
) -> SimulationOptions:
    """Return what to simulate: the preset of the data set under the settings, with nobody in the scene.

    Azimuths are interpolated. The rig depends on the seed and the preset's mounting only, so D1, D2 and D3 share it. In D2 the
    reflector stands at corners of the checkerboard, nowhere else.
    """
    preset: PresetName = f"paper-{dataset}"  # type: ignore[assignment]
    options = PRESETS[preset]
    weaker = (_USUAL_EDGE_M / options.reflector_edge_m) ** 4
    share = (1.0 - settings.outshone_share + settings.outshone_share * weaker) ** 0.5
    defects = replace(
        options.defects,
        constant_azimuth_deg=share * settings.constant_azimuth_deg,
        constant_elevation_deg=share * settings.constant_elevation_deg,
    )
    on_board = board_corners if dataset == "d2" else 0
    return replace(
        options,
        seed=seed,
        defects=defects,
        rig=replace(options.rig, camera_angle_sigma_deg=settings.mounting_error_deg),
        angle_bins=False,
        width_px=settings.width_px,
        height_px=settings.width_px * 9 // 16,
        placements=0 if dataset == "d2" else settings.placements,
        board_corners=on_board,
        person=False,
        person_leaves=False,
        dwell_s=4.0,
        radar_rate_hz=5.0,
    )


def session(dataset: Dataset, seed: int, settings: Settings, board_corners: int = BOARD_CORNERS) -> SimulatedScans:
    """Simulate scans and clicks of a data set."""
    return simulate_scans(options_of(dataset, seed, settings, board_corners))


def ppm_options(settings: Settings) -> CalibrationOptions:
    """Return the options of the paper's method."""
    return CalibrationOptions(method="paper", paper=PaperOptions(ransac_threshold_px=settings.ransac_threshold_px))


def pmm_options(simulated: SimulatedScans) -> CalibrationOptions:
    """Return the options of the mounting: the nominal rotation, and the camera where the drawing of the mast has it."""
    tape = CameraPositionPrior(simulated.stage.options.rig.camera_offset_m)
    return CalibrationOptions(method="paper", solving=SolvingOptions(camera_position=tape))
