"""All options of a simulated recording, which `cocalib simulate --set` takes by name."""

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, Literal

from calib_core.camera import CameraModel
from calib_core.errors import OptionError
from calib_core.options import option
from calib_core.synthetic.rig import RigOptions

RadarName = Literal["awr1843", "imaging"]
ReportedElevation = Literal["measured", "zero"]
SecondAzimuth = Literal["none", "column", "topic"]


@dataclass(frozen=True, slots=True)
class RadarDefects:
    """How the radar differs from a perfect one, and what its driver does to the positions."""

    azimuth_scale: float = option(1.0, "Reported azimuth over the true one.", low=0.5, high=2.0)
    elevation_scale: float = option(1.0, "Reported elevation over the true one.", low=0.5, high=2.0)
    azimuth_bias_deg: float = option(0.0, "Constant azimuth error [deg].", low=-45.0, high=45.0)
    elevation_bias_deg: float = option(0.0, "Constant elevation error [deg].", low=-45.0, high=45.0)
    range_bias_m: float = option(0.0, "Constant range error [m].", low=-2.0, high=2.0)
    range_scale: float = option(1.0, "Reported range over the true one.", low=0.5, high=2.0)
    elevation: ReportedElevation = option("measured", "Elevations: as measured, or all zero as from a 2D radar.")
    mirrored: bool = option(False, "Have the driver report y to the right, which mirrors the scene.")
    length_unit_m: float = option(
        1.0, "Unit of the lengths that the driver reports, such as 0.001 for millimetres [m].", low=1e-4, high=10.0
    )
    range_bin_m: float | None = option(None, "Width of a range bin [m]; by default the radar's.", low=0.001, high=1.0)
    azimuth_bins: int | None = option(
        None,
        "Bins over the sine of the azimuth from -1 to 1, 0 to interpolate; by default the radar's.",
        low=0,
        high=4096,
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
    side_radar: bool = option(
        False, "Also publish the clouds of a weaker radar that looks 60 deg to the left, in /radar_left/points."
    )


SceneName = Literal["rooftop", "field", "aisle", "checkerboard", "open-rooftop", "open-yard", "road"]
Clutter = Literal["none", "scene", "heavy"]
Container = Literal["ros1", "mcap", "db3", "csv"]


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What stands and walks in the scene besides the reflector."""

    companion: bool = option(False, "Put a cart behind each reflector, at every placement.")
    parked_cars: int = option(0, "Number of parked cars at the sides of the scene.", low=0, high=8)
    fence: bool = option(False, "Put a fence with metal posts along one side of the scene.")
    strong_target_dbsm: float | None = option(
        None,
        "Radar cross-section of one more permanent target, such as 29; by default there is none [dBsm].",
        low=-60.0,
        high=60.0,
    )
    flickering_targets: int = option(
        0,
        "Number of static targets whose echoes come and go every few seconds, as of swaying branches.",
        low=0,
        high=40,
    )
    passers_by: int = option(
        0, "Number of people who walk through the scene; every third stops on the way.", low=0, high=100
    )
    ghost_share: float = option(
        0.25, "Share of the placements with a reflection by way of the ground or a wall.", low=0.0, high=1.0
    )
    clutter_db: float = option(
        0.0, "How much stronger than usual the echoes of the visible scene are [dB].", low=-60.0, high=30.0
    )


@dataclass(frozen=True, slots=True)
class Traffic:
    """Who moves in front of the sensors to be judged: boxes.json has their boxes, labels.json their returns."""

    walkers: int = option(0, "Number of people who walk about in front of the sensors.", low=0, high=6)
    robots: int = option(0, "Number of robot cars that drive in the aisle.", low=0, high=2)
    cars: int = option(0, "Number of cars that drive on the road, in both directions.", low=0, high=8)
    nearest_m: float = option(5.0, "Where the cars turn at the near end of their round [m].", low=3.0, high=80.0)
    farthest_m: float = option(20.0, "Where they turn at its far end [m].", low=15.0, high=120.0)
    duration_s: float = option(60.0, "Length of a recording without placements [s].", low=5.0, high=3600.0)

    @property
    def any(self) -> bool:
        """Whether anything of it moves."""
        return bool(self.walkers or self.robots or self.cars)


@dataclass(frozen=True, slots=True)
class IntrinsicsErrors:
    """How the published intrinsics differ from those of the images."""

    published: bool = option(True, "Record the intrinsics; otherwise the recording says nothing about the lens.")
    focal_length_scale: float = option(1.0, "Published focal length over the true one.", low=0.5, high=2.0)
    principal_point_px: tuple[float, float] = option(
        (0.0, 0.0),
        "How far right and down of the true one the published principal point is [px].",
        low=-16384.0,
        high=16384.0,
    )


@dataclass(frozen=True, slots=True)
class SimulationOptions:
    """What to simulate; the same options give the same bytes."""

    scene: SceneName = option(
        "rooftop",
        "Scene: a rooftop, an open field, a narrow aisle between shelves, a yard with a checkerboard wall, a rooftop and a "
        "yard with nothing that echoes within 20 m (the yard has a checkerboard on a stand), or a road.",
    )
    radar: RadarName = option("awr1843", "Radar: a TI AWR1843 with its bins, or a finer imaging radar.")
    placements: int = option(
        20, "Number of placements of the reflector; 0 for none, where something else moves.", low=0, high=1000
    )
    dwell_s: float = option(
        6.0, "How long the reflector stays at each placement, from release to pick-up [s].", low=3.5, high=3600.0
    )
    heights: bool = option(False, "Put the reflector on a tripod of varying height instead of on the ground.")
    clutter: Clutter = option(
        "scene", "Static radar returns: none, from the visible scene, or also from strong invisible objects."
    )
    person: bool = option(True, "Have a person carry the reflector; otherwise it just appears at each placement.")
    camera_model: CameraModel = option("plumb_bob", "Lens model.")
    field_of_view_deg: float | None = option(
        None,
        "Horizontal field of view before distortion [deg]; by default 75, or 110 for equidistant.",
        low=1.0,
        high=170.0,
    )
    width_px: int = option(1280, "Image width in pixels.", low=64, high=16384)
    height_px: int = option(720, "Image height in pixels.", low=64, high=16384)
    camera_rate_hz: float = option(5.0, "Frames per second.", low=0.01, high=1000.0)
    radar_rate_hz: float = option(10.0, "Scans per second.", low=0.01, high=1000.0)
    jpeg_quality: int = option(85, "JPEG quality.", low=1, high=100)
    sensor_noise_grey: float = option(
        0.0, "Standard deviation of the camera's noise [grey levels of 255]; makes JPEG larger.", low=0.0, high=255.0
    )
    click_sigma_px: float = option(0.7, "Standard deviation of the example clicks, per axis [px].", low=0.0, high=500.0)
    seed: int = option(1, "Seed of the random generator.", low=0)
    reflectors: int = option(
        1, "Number of reflectors, moved in turn; the example clicks name all that stand.", low=1, high=4
    )
    reflectors_apart_m: float | None = option(
        None,
        "How much farther away each further reflector of a scene stands, in another direction [m]; by default anywhere.",
        low=0.0,
        high=5.0,
    )
    islands: bool = option(False, "Record only 2 to 15 s around each dwell, with gaps of 1 to 5 minutes between.")
    rig: RigOptions = option(RigOptions(), "How the sensors are mounted.")
    other_camera: bool = option(
        False,
        "Record a second camera in /camera_2, on a rig of its own, that sees the same placements; clicks_2.json and truth_2.json "
        "are its files.",
    )
    defects: RadarDefects = option(RadarDefects(), "How the radar differs from a perfect one.")
    surroundings: Surroundings = option(Surroundings(), "What stands and walks in the scene besides the reflector.")
    intrinsics: IntrinsicsErrors = option(
        IntrinsicsErrors(), "How the published intrinsics differ from those of the images."
    )
    traffic: Traffic = option(Traffic(), "Who moves in front of the sensors to be judged.")
    waved_board_s: float = option(
        0.0,
        "How long the person waves a checkerboard before the camera at the start, to calibrate its lens with; 0 for no board "
        "[s].",
        low=0.0,
        high=600.0,
    )
    reflector_edge_m: float = option(
        0.16,
        "Length of the edges that meet at the reflector's apex [m]; its echo grows with the fourth power.",
        low=0.05,
        high=1.0,
    )
    board_corners: int = option(
        0, "Number of further placements, in front of inner corners of the checkerboard.", low=0, high=40
    )
    person_leaves: bool = option(
        False,
        "Have the person walk behind the sensors while the reflector stands; dwell_s is how long they stay there.",
    )

    def __post_init__(self) -> None:
        _check_ranges(self)
        _check_combinations(self)

    @property
    def standing_places(self) -> int:
        """The number of placements, those at the checkerboard's corners included."""
        return self.placements + self.board_corners


def _check_combinations(options: SimulationOptions) -> None:
    """Check that everything has room in the scene, and that there is something to record.

    Raises:
        OptionError: says what does not go together, and what to do.
    """
    traffic, scene, surroundings = options.traffic, options.scene, options.surroundings
    only = (
        (traffic.robots, "traffic.robots", ("aisle",), "scene=aisle"),
        (traffic.cars, "traffic.cars", ("road",), "scene=road"),
        (options.board_corners, "board_corners", ("checkerboard", "open-yard"), "scene=open-yard"),
    )
    for number, name, scenes, remedy in only:
        _require(not number or scene in scenes, name, number, f"0 in the scene {scene}; ask for {remedy}")
    roomy = scene != "aisle" or not (surroundings.parked_cars or surroundings.fence)
    _require(roomy, "scene", scene, "another one: the aisle has no room for parked cars or a fence")
    walkable = scene != "road" or not traffic.walkers
    _require(walkable, "traffic.walkers", traffic.walkers, "0 on the road, where cars drive")
    length_m = traffic.farthest_m - traffic.nearest_m
    _require(length_m >= 12.0, "traffic.farthest_m", traffic.farthest_m, "at least 12 m beyond traffic.nearest_m")
    room = int((2.0 * length_m + 20.0) / 12.0)
    _require(traffic.cars <= room, "traffic.cars", traffic.cars, f"at most {room} on a round of this length")
    several = options.defects.near_and_far or options.defects.side_radar or options.defects.second_azimuth != "none"
    _require(not (traffic.any and several), "traffic", "given", "without a radar of several topics")
    apart_m, by_turns = options.reflectors_apart_m, options.reflectors > 1 and options.board_corners == 0
    wanted = "left out with one reflector, or with placements at the checkerboard's corners"
    _require(apart_m is None or by_turns, "reflectors_apart_m", apart_m, wanted)
    waved = options.waved_board_s > 0.0
    _require(not (waved and options.islands), "islands", True, "False where a board is waved before the placements")
    if not options.standing_places:
        _require(not waved, "placements", 0, "at least 1 after a board is waved")
        _require(traffic.any, "placements", 0, "at least 1 where nothing else moves; or ask for traffic.walkers=2")
        _require(not options.islands, "islands", True, "False without placements, around which islands are recorded")


def _check_ranges(options: Any, prefix: str = "") -> None:
    """Compare every number with the range of its field.

    Raises:
        OptionError: names the option, its value and the range.
    """
    for field in dataclasses.fields(options):
        value, name = getattr(options, field.name), f"{prefix}{field.name}"
        if dataclasses.is_dataclass(value):
            _check_ranges(value, f"{name}.")
            continue
        low, high = field.metadata["low"], field.metadata["high"]
        wanted = f"at least {low:g}" if math.isinf(high) else f"{low:g} to {high:g}"
        for number in value if isinstance(value, tuple) else (value,):
            if isinstance(number, int | float) and not isinstance(number, bool):
                _require(math.isfinite(number) and low <= number <= high, name, value, wanted)


def _require(good: bool, name: str, value: object, wanted: str) -> None:
    if not good:
        raise OptionError(f"simulation option {name} is {value}; it must be {wanted}")
