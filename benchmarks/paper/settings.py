"""The one set of settings for all rows, and the simulated sessions that it makes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

from calib_core.options import CalibrationOptions, PaperOptions
from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.presets import PRESETS, PresetName
from calib_core.synthetic.recording import SimulatedRecording, simulate

Dataset: TypeAlias = Literal["d1", "d2", "d3"]
SEED_SETS: Sequence[Sequence[int]] = (range(401, 421), range(421, 441))
"""Of the table: two sets that nothing was fitted on, and that were not looked at before the settings were final."""
FIT_SEEDS: Sequence[int] = range(101, 107)
PPM = CalibrationOptions(method="paper", paper=PaperOptions(region_m=0.0))
"""As the pseudocode has it, without the placement range, which changes little here: docs/paper.md."""
_USUAL_EDGE_M = SimulationOptions().reflector_edge_m


@dataclass(frozen=True, slots=True)
class Settings:
    """What the paper does not say.

    Attributes:
        constant_azimuth_deg: standard deviation of the azimuth error that a placement keeps [deg]; fitted.
        constant_elevation_deg: the same for the elevation [deg]; fitted.
        board_corners: placements of D2, each at another corner of the checkerboard; fitted.
        gross_pairs: pairs of DR+D3 whose radar position is grossly wrong; chosen for that row.
        gross_m: by how much, in a random horizontal direction [m]; chosen for that row.
        width_px: of the images, which are 16 to 9.
        mounting_error_deg: standard deviation of the true rotation about the nominal one, per axis [deg].
        placements: of the reflector on the ground, in D1 and D3.
        distortion: whether the lens has the typical one.
        outshone_share: share of those errors' variance that comes from clutter below the reflector: a larger reflector,
            whose echo grows with the fourth power of its edge, outshines it. The rest is multipath, which grows with it.
        click_sigma_px: standard deviation of a click, per axis [px].
    """

    constant_azimuth_deg: float
    constant_elevation_deg: float
    board_corners: int
    gross_pairs: int = 0
    gross_m: float = 0.0
    width_px: int = 1920
    mounting_error_deg: float = 3.0
    placements: int = 40
    distortion: bool = True
    outshone_share: float = 0.5
    click_sigma_px: float = 0.7


FITTED = Settings(constant_azimuth_deg=0.7, constant_elevation_deg=0.4, board_corners=12, gross_pairs=3, gross_m=4.0)
"""What `python -m benchmarks.paper --fit` finds best: see fit.json."""


def options_of(dataset: Dataset, seed: int, settings: Settings) -> SimulationOptions:
    """Return what to simulate: the preset of the data set under the settings, with nobody in the scene.

    Azimuths are interpolated. The rig depends on the seed and the preset's mounting only, so D1, D2 and D3 share it. In D2 the
    reflector stands at corners of the checkerboard, nowhere else.
    """
    preset: PresetName = f"paper-{dataset}"  # type: ignore[assignment]
    on_board = dataset == "d2"
    return replace(
        under(PRESETS[preset], seed, settings),
        placements=0 if on_board else settings.placements,
        board_corners=settings.board_corners if on_board else 0,
        person=False,
        person_leaves=False,
        dwell_s=4.0,
        radar_rate_hz=5.0,
    )


def under(options: SimulationOptions, seed: int, settings: Settings) -> SimulationOptions:
    """Return options with the sensors of the settings; a larger reflector outshines a part of the constant errors."""
    weaker = (_USUAL_EDGE_M / options.reflector_edge_m) ** 4
    share = (1.0 - settings.outshone_share + settings.outshone_share * weaker) ** 0.5
    defects = replace(
        options.defects,
        constant_azimuth_deg=share * settings.constant_azimuth_deg,
        constant_elevation_deg=share * settings.constant_elevation_deg,
        azimuth_bins=0,
    )
    return replace(
        options,
        seed=seed,
        defects=defects,
        rig=replace(options.rig, camera_angle_sigma_deg=settings.mounting_error_deg),
        camera_model="plumb_bob" if settings.distortion else "pinhole",
        width_px=settings.width_px,
        height_px=settings.width_px * 9 // 16,
        click_sigma_px=settings.click_sigma_px,
    )


def session(dataset: Dataset, seed: int, settings: Settings) -> SimulatedRecording:
    """Simulate scans and clicks of a data set."""
    return simulate(options_of(dataset, seed, settings))


def other_rig(d3: SimulatedRecording) -> SimulatedRecording:
    """Return DR+D3: the same scans with the clicks in the second camera's images."""
    assert d3.other_camera is not None, "D3 has a second camera"
    return d3.other_camera
