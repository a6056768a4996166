"""Named sets of options: one per way in which the world is unkind, and one with many of them at once."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal, TypeAlias

from calib_core.synthetic.options import (
    IntrinsicsErrors,
    RadarDefects,
    SimulationOptions,
    Surroundings,
    Traffic,
)
from calib_core.synthetic.rig import RigOptions

_LEVEL = RigOptions(radar_height_m=0.5, radar_tilt_deg=0.0)
"""A radar at the height of a bumper that looks straight ahead."""
_BARE = Surroundings(ghost_share=0.0)
"""Nothing near that reflects the reflector's echo."""
_PAPER_RADAR = RadarDefects(threshold_db=15.0, constant_azimuth_deg=0.5, constant_elevation_deg=1.0)
_ROAD_RADAR = RadarDefects(gain_db=10.0, max_speed_mps=16.0)
"""A radar that sees cars at 60 m and tells speeds up to 16 m/s apart."""
_CAR_PARK = Surroundings(parked_cars=3, fence=True, strong_target_dbsm=29.0)

PRESETS: Mapping[str, SimulationOptions] = {
    "default": SimulationOptions(),
    "angle-scale": SimulationOptions(defects=RadarDefects(azimuth_scale=1.03)),
    "biased-radar": SimulationOptions(
        defects=RadarDefects(
            azimuth_scale=0.98,
            elevation_scale=1.03,
            azimuth_bias_deg=1.0,
            elevation_bias_deg=-1.0,
            range_bias_m=-0.05,
        )
    ),
    "mirrored-radar": SimulationOptions(defects=RadarDefects(mirrored=True)),
    "millimetres": SimulationOptions(defects=RadarDefects(length_unit_m=0.001)),
    "flat": SimulationOptions(rig=_LEVEL, defects=RadarDefects(elevation="zero")),
    "coarse": SimulationOptions(
        defects=RadarDefects(
            range_bin_m=0.15,
            azimuth_bins=32,
            scatter_range_m=0.15,
            scatter_azimuth_deg=1.5,
            scatter_elevation_deg=3.0,
        )
    ),
    "fine": SimulationOptions(
        radar="imaging", defects=RadarDefects(range_bin_m=0.01, azimuth_bins=512, elevation_bins=256)
    ),
    "near-far": SimulationOptions(radar="imaging", defects=RadarDefects(near_and_far=True)),
    "near-far-azimuths": SimulationOptions(
        radar="imaging", defects=RadarDefects(near_and_far=True, second_azimuth="topic")
    ),
    "near-far-column": SimulationOptions(
        radar="imaging", defects=RadarDefects(near_and_far=True, second_azimuth="column", second_azimuth_share=0.5)
    ),
    "two-radars": SimulationOptions(
        radar="imaging",
        scene="field",
        surroundings=_CAR_PARK,
        defects=RadarDefects(cloud_topic="/front/points", side_radar=True),
    ),
    "lidar-name": SimulationOptions(radar="imaging", defects=RadarDefects(cloud_topic="/lidar_top/points")),
    "two-reflectors": SimulationOptions(reflectors=2),
    "companion": SimulationOptions(surroundings=Surroundings(companion=True)),
    "car-park": SimulationOptions(scene="field", surroundings=_CAR_PARK),
    "flickering": SimulationOptions(surroundings=Surroundings(flickering_targets=10)),
    "busy": SimulationOptions(
        scene="field",
        clutter="heavy",
        surroundings=Surroundings(
            parked_cars=4, fence=True, strong_target_dbsm=29.0, flickering_targets=40, passers_by=6
        ),
    ),
    "passers-by": SimulationOptions(surroundings=Surroundings(passers_by=6)),
    "islands": SimulationOptions(dwell_s=10.0, islands=True),
    "two-reflectors-close": SimulationOptions(reflectors=2, reflectors_apart_m=0.7),
    "two-reflectors-azimuths": SimulationOptions(
        radar="imaging", reflectors=2, reflectors_apart_m=0.7, defects=RadarDefects(second_azimuth="column")
    ),
    "focal-length": SimulationOptions(intrinsics=IntrinsicsErrors(focal_length_scale=1.02)),
    "principal-point": SimulationOptions(intrinsics=IntrinsicsErrors(principal_point_px=(30.0, 0.0))),
    "unkind": SimulationOptions(
        scene="field",
        reflectors=2,
        islands=True,
        click_sigma_px=2.0,
        defects=RadarDefects(azimuth_scale=1.02, elevation_scale=0.97, range_bias_m=0.05),
        surroundings=Surroundings(parked_cars=2, strong_target_dbsm=29.0, passers_by=4),
    ),
    "paper-d1": SimulationOptions(
        scene="open-rooftop", person_leaves=True, camera_rate_hz=1.0, defects=_PAPER_RADAR, surroundings=_BARE
    ),
    "paper-d2": SimulationOptions(
        scene="open-yard",
        board_corners=12,
        person_leaves=True,
        camera_rate_hz=1.0,
        defects=_PAPER_RADAR,
        surroundings=_BARE,
    ),
    "paper-d3": SimulationOptions(
        scene="aisle",
        reflector_edge_m=0.3,
        person_leaves=True,
        camera_rate_hz=1.0,
        defects=RadarDefects(threshold_db=26.0, constant_azimuth_deg=0.5, constant_elevation_deg=1.0),
        surroundings=Surroundings(ghost_share=0.0, clutter_db=-12.0),
        other_camera=True,
    ),
    "people": SimulationOptions(placements=0, traffic=Traffic(walkers=3)),
    "robot": SimulationOptions(scene="aisle", placements=0, traffic=Traffic(robots=1)),
    "cars-near": SimulationOptions(
        scene="road", radar="imaging", placements=0, defects=_ROAD_RADAR, traffic=Traffic(cars=2)
    ),
    "cars-far": SimulationOptions(
        scene="road",
        radar="imaging",
        placements=0,
        defects=_ROAD_RADAR,
        traffic=Traffic(cars=4, nearest_m=20.0, farthest_m=60.0),
    ),
    "intrinsics": SimulationOptions(
        placements=12,
        dwell_s=4.0,
        width_px=640,
        height_px=400,
        jpeg_quality=92,
        intrinsics=IntrinsicsErrors(published=False),
        waved_board_s=24.0,
    ),
}
"""The presets by name; what one does not name has its default."""

if TYPE_CHECKING:
    PresetName: TypeAlias = str
else:
    PresetName = Literal[tuple(PRESETS)]
