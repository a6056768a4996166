"""Everything decided before the sensors measure: scene, sensors, story, stamps.

The truth about each placement follows from it: where and when the reflector stood, and in which frames it can be clicked.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from calib_core.arrays import Flags, Points3, Vector2, Vector3, freeze
from calib_core.camera import Camera
from calib_core.errors import OptionError
from calib_core.geometry import RigidTransform
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.synthetic.options import IntrinsicsErrors, SimulationOptions
from calib_core.synthetic.radar_returns import Antenna, RadarProfile, antennas_of, profile_with, radar_from_reported
from calib_core.synthetic.rig import OTHER_OFFSET_M, OTHER_YAW_DEG, Rig, random_rig, typical_camera
from calib_core.synthetic.scene.person import PersonState, capsules
from calib_core.synthetic.scene.scenes import STANDS_LOWER, USUAL_EDGE_M, PairsLayout, Scatterer, Scene, scene_named
from calib_core.synthetic.scene.story import Resting, Story, tell_story
from calib_core.synthetic.scene.surroundings import Flicker, draw_flickers, furnished, in_sight
from calib_core.synthetic.scene.traffic import VehicleState, draw_movers, draw_passers_by, hidden_by
from calib_core.synthetic.timeline import EVERYTHING, START_NS, RecordedSegments, SensorTimes, draw_segments, draw_times

if TYPE_CHECKING:  # boards need what calibrates a lens, which is slow to import
    from calib_core.synthetic.scene.board_waving import BoardWaving

_BEFORE_BOARD_M = 0.02
"""How far in front of the board's surface the apex is; the reflector's edges reach no farther back."""
_TRIPOD_M = 1.4
_WIDEST_RAD, _MOST_DIRECTIONS = np.deg2rad(31.0), 60  # drawn for a further reflector of a scene
_RIM_SHARE = 0.03
"""Share of the image's width at its border where no reflector is put, so that all of it is visible."""


@dataclass(frozen=True, slots=True, eq=False)
class Stage:
    """Everything decided before the sensors measure.

    Attributes:
        options: the options it was made with.
        scene: the scene.
        rig: the sensors.
        story: where person and reflector are at any time.
        frame_times: of the camera.
        antennas: the radar's, each with its times; one, or a near and a far one.
        segments: the recorded parts of the story.
        clutter: static objects that the radar sees, in the world.
        clutter_bias: (k, 3) the constant error of each of them: range [m], sines of azimuth and elevation.
        reflector_bias: (n, 3) the constant error of each placement: range [m], sines of azimuth and elevation.
        ghosts: for each placement the static reflection that comes and goes with it, or None.
        flickers: static targets that the radar sees at times.
        waving: of a board before the camera at the start; None for none.
    """

    options: SimulationOptions
    scene: Scene
    rig: Rig
    story: Story
    frame_times: SensorTimes
    antennas: tuple[Antenna, ...]
    segments: RecordedSegments
    clutter: tuple[Scatterer, ...]
    clutter_bias: Points3
    reflector_bias: Points3
    ghosts: tuple[Scatterer | None, ...]
    flickers: tuple[Flicker, ...] = ()
    waving: "BoardWaving | None" = None

    @property
    def profile(self) -> RadarProfile:
        """The radar's profile."""
        return profile_with(self.options.radar, self.options.defects)

    @property
    def published_camera(self) -> Camera:
        """The intrinsics in the recording's camera info, which may be wrong; those of the images are the rig's."""
        camera, errors = self.rig.camera, self.options.intrinsics
        if errors == IntrinsicsErrors():
            return camera
        matrix = camera.matrix_px.copy()
        matrix[[0, 1], [0, 1]] *= errors.focal_length_scale
        matrix[:2, 2] += errors.principal_point_px
        return replace(camera, matrix_px=matrix)

    @property
    def of_other_camera(self) -> "Stage | None":
        """The same story and radar with the camera on the other rig; None if there is none."""
        rig = _other_rig(self.rig, self.options)
        if rig is None:
            return None
        times = _frame_times(child_rng(self.options, 24), self.story, self.segments, self.options)
        return replace(self, rig=rig, frame_times=times, waving=None)

    @property
    def camera_from_reported(self) -> RigidTransform:
        """The pose that maps what the radar reports to the camera, without scales: what an overlay needs."""
        return self.rig.camera_from_radar @ radar_from_reported(self.options.defects)

    def recorded_span(self, start_s: float, end_s: float) -> tuple[TimeNs, TimeNs]:
        """Return the first and the last time, on the camera's clock, at which a part of the story is recorded."""
        recorded_s = self.segments.first_after_s(start_s), self.segments.last_before_s(end_s)
        first, last = (TimeNs(START_NS + round(time_s * NS_PER_S)) for time_s in recorded_s)
        return first, last


def child_rng(options: SimulationOptions, number: int) -> np.random.Generator:
    """Return a separate generator for each purpose, so that changing one does not change the draws of the others."""
    return np.random.default_rng([options.seed, number])


def set_stage(options: SimulationOptions) -> Stage:
    """Decide where everything is at any time, from the options alone."""
    if not options.standing_places:
        options = replace(options, person=False)
    scene, added = furnished(child_rng(options, 13), scene_named(options.scene), options.surroundings)
    camera = typical_camera(
        options.camera_model,
        width_px=options.width_px,
        height_px=options.height_px,
        field_of_view_deg=options.field_of_view_deg,
    )
    rig = random_rig(child_rng(options, 0), camera=camera, options=options.rig)
    positions = _positions(child_rng(options, 1), scene, added, rig, options)
    story = _story(positions, scene, options)
    segments = _segments(story, options)
    profile = profile_with(options.radar, options.defects)
    frame_times = _frame_times(child_rng(options, 3), story, segments, options)
    antennas = antennas_of(
        options,
        profile,
        (child_rng(options, 4), child_rng(options, 14)),
        duration_s=story.duration_s,
        segments=segments,
    )
    rng = child_rng(options, 5)
    bias_sigma = [0.004, profile.azimuth_bias_sigma, profile.elevation_bias_sigma]
    bias = rng.standard_normal((len(positions), 3)) * bias_sigma
    ghosts = tuple(_ghost(rng, resting.position_m, options.surroundings.ghost_share) for resting in story.restings)
    clutter = _clutter(child_rng(options, 6), scene, options)
    clutter_bias = child_rng(options, 7).standard_normal((len(clutter), 3)) * bias_sigma
    flickers = draw_flickers(child_rng(options, 18), options.surroundings.flickering_targets, scene)
    sensors = (frame_times, antennas, segments)
    waving = _waving(camera, options)
    return Stage(options, scene, rig, story, *sensors, clutter, clutter_bias, bias, ghosts, flickers, waving)


def _story(positions_m: Points3, scene: Scene, options: SimulationOptions) -> Story:
    if len(positions_m):
        story = tell_story(child_rng(options, 2), positions_m, options, narrow=scene.narrow)
    else:
        story = Story((), options.traffic.duration_s, (), np.zeros(0))
    duration_s, count = story.duration_s, options.surroundings.passers_by
    movers = draw_movers(child_rng(options, 20), options.traffic, scene, duration_s)
    passers_by = draw_passers_by(child_rng(options, 15), count, duration_s, 0.8 * scene.layout.max_range_m)
    return replace(story, movers=movers, passers_by=passers_by)


def _waving(camera: Camera, options: SimulationOptions) -> "BoardWaving | None":
    if not options.waved_board_s:
        return None
    from calib_core.synthetic.scene.board_waving import draw_waving

    return draw_waving(child_rng(options, 21), camera, options.waved_board_s)


def _other_rig(rig: Rig, options: SimulationOptions) -> Rig | None:
    """Draw the rig of the same radar and the second camera, of the same make as the first."""
    if not options.other_camera:
        return None
    nominal = replace(options.rig, camera_offset_m=OTHER_OFFSET_M, camera_angles_deg=(0.0, OTHER_YAW_DEG, 0.0))
    return random_rig(child_rng(options, 23), camera=rig.camera, options=nominal)


def _frame_times(
    rng: np.random.Generator, story: Story, segments: RecordedSegments, options: SimulationOptions
) -> SensorTimes:
    rate_hz = options.camera_rate_hz
    return draw_times(rng, story.duration_s, rate_hz, latency_s=0.0, transfer_s=0.022, segments=segments)


def _segments(story: Story, options: SimulationOptions) -> RecordedSegments:
    if not options.islands:
        return EVERYTHING
    middles_s = np.array([resting.start_s + 0.5 * options.dwell_s for resting in story.restings])
    return draw_segments(child_rng(options, 16), middles_s)


def _positions(rng: np.random.Generator, scene: Scene, added: Scene, rig: Rig, options: SimulationOptions) -> Points3:
    """Draw apex positions in the world, clear of the solids."""
    rigs = [one for one in (rig, _other_rig(rig, options)) if one is not None]
    room = _Room(scene, added, rigs, _layout(scene, options), options)
    world_from_radar = rig.radar_from_world.inverse()
    found: list[Vector3] = []
    for _ in range(400):
        drawn = draw_positions(rng, count=min(options.placements, 8), rig=rig, layout=room.layout)
        for position in room.that_fit(world_from_radar @ drawn, found):
            if len(found) < options.placements:
                found += room.scene_at(rng, position, found)[: options.placements - len(found)]
        if len(found) == options.placements:
            return np.concatenate([np.array(found).reshape(-1, 3), _board_places(rng, scene, rig, options)])
    raise OptionError(f"only {len(found)} of {options.placements} placements fit in the {scene.name}; ask for fewer")


def draw_positions(rng: np.random.Generator, *, count: int, rig: Rig, layout: PairsLayout) -> Points3:
    """Draw reflector positions (count, 3) in the radar frame that the camera sees, apart from one another.

    Raises:
        OptionError: they do not all fit in the layout.
    """
    found: list[np.ndarray] = []
    for _ in range(2000 * count):
        if len(found) == count:
            break
        range_m = rng.uniform(layout.min_range_m, layout.max_range_m)
        azimuth_rad = np.deg2rad(rng.uniform(-layout.max_azimuth_deg, layout.max_azimuth_deg))
        if layout.max_lateral_m < 50.0:  # narrow: spread over the width instead of the angle
            azimuth_rad = np.arcsin(min(1.0, layout.max_lateral_m / range_m)) * rng.uniform(-1.0, 1.0)
        height_m = layout.height_m + layout.roughness_m * rng.standard_normal()
        height_m += rng.uniform(0.0, 1.0) * max(0.0, layout.max_height_m - layout.height_m)
        world = np.array([range_m * np.cos(azimuth_rad), range_m * np.sin(azimuth_rad), height_m])
        point = (rig.radar_from_world @ world[None])[0]
        apart = all(np.linalg.norm(point - other) >= layout.separation_m for other in found)
        if apart and bool(rig.camera.sees(rig.camera_from_radar @ point[None])[0]):
            found.append(point)
    if len(found) < count:
        raise OptionError(f"only {len(found)} of {count} placements fit, {layout.separation_m} m apart and in view")
    return np.array(found).reshape(-1, 3)


@dataclass(frozen=True, slots=True, eq=False)
class _Room:
    """Where reflectors may stand: in the scene as it is and with what was added to it, seen from all rigs."""

    scene: Scene
    added: Scene
    rigs: Sequence[Rig]
    layout: PairsLayout
    options: SimulationOptions

    def that_fit(self, batch: Points3, taken: Sequence[Vector3]) -> Iterator[Vector3]:
        """Yield those of some positions (n, 3) that all cameras see, clear of the solids and of what is taken by then."""
        whole = in_sight(self.added, batch)
        for rig in self.rigs:
            whole &= _in_image(rig, batch)
        if self.scene.board is not None:
            whole &= ~self.scene.board.hides(batch)
        for position in batch[whole]:
            apart = all(np.linalg.norm(position[:2] - other[:2]) >= self.layout.separation_m for other in taken)
            if apart and self.scene.free(position[:2], 0.7):
                yield position

    def scene_at(self, rng: np.random.Generator, first: Vector3, taken: Sequence[Vector3]) -> list[Vector3]:
        """Draw where the other reflectors of a scene stand, each farther away than the first; nothing if one does not fit."""
        places, apart_m = [first], self.options.reflectors_apart_m
        if apart_m is None:
            return places
        for number in range(1, self.options.reflectors):
            range_m = float(np.linalg.norm(first[:2])) + number * apart_m
            azimuths_rad = rng.uniform(-_WIDEST_RAD, _WIDEST_RAD, _MOST_DIRECTIONS)
            ground_m = range_m * np.stack([np.cos(azimuths_rad), np.sin(azimuths_rad)], axis=1)
            batch = np.column_stack([ground_m, np.full(_MOST_DIRECTIONS, first[2])])
            places += list(self.that_fit(batch, [*taken, *places]))[:1]
        return places if len(places) == self.options.reflectors else []


def _in_image(rig: Rig, places_m: Points3) -> Flags:
    """Return which places in the world (n, 3) the camera sees, off the image's border."""
    camera = rig.camera
    return camera.in_image(camera.project(rig.camera_from_world @ places_m), margin_px=-_RIM_SHARE * camera.width_px)


def _layout(scene: Scene, options: SimulationOptions) -> PairsLayout:
    """Return where the scene has room for the reflector; a larger one stands higher."""
    layout = scene.layout
    lifted_m = STANDS_LOWER * (options.reflector_edge_m - USUAL_EDGE_M)
    if lifted_m > 0.0:
        layout = replace(layout, height_m=layout.height_m + lifted_m)
    return replace(layout, max_height_m=_TRIPOD_M) if options.heights else layout


def _board_places(rng: np.random.Generator, scene: Scene, rig: Rig, options: SimulationOptions) -> Points3:
    """Draw apex positions in front of inner corners of the scene's checkerboard, each another corner.

    Raises:
        OptionError: the camera sees fewer corners.
    """
    if not options.board_corners:
        return np.zeros((0, 3))
    assert scene.board is not None, "the options ask for corners only where there is a board"
    places = scene.board.corners_m - [_BEFORE_BOARD_M, 0.0, 0.0]
    seen = _in_image(rig, places)
    if options.board_corners > int(seen.sum()):
        raise OptionError(
            f"simulation option board_corners is {options.board_corners}, but the camera sees {int(seen.sum())} inner "
            "corners of the checkerboard; ask for fewer, or for another seed"
        )
    return places[seen][rng.choice(int(seen.sum()), options.board_corners, replace=False)]


def _clutter(rng: np.random.Generator, scene: Scene, options: SimulationOptions) -> tuple[Scatterer, ...]:
    """Return the static objects that the radar sees; heavy clutter adds strong ones among the placements."""
    if options.clutter == "none":
        return ()
    louder_db = options.surroundings.clutter_db
    visible = tuple(replace(scatterer, rcs_dbsm=scatterer.rcs_dbsm + louder_db) for scatterer in scene.scatterers)
    if options.clutter == "scene":
        return visible
    reach = min(scene.layout.max_lateral_m + 0.4, 7.0)
    low, high = (3.0, -reach, 0.05, 6.0), (scene.layout.max_range_m, reach, 1.0, 18.0)
    drawn = (rng.uniform(low, high).tolist() for _ in range(8))
    return (*visible, *(Scatterer((x_m, y_m, z_m), rcs_dbsm) for x_m, y_m, z_m, rcs_dbsm in drawn))


def _ghost(rng: np.random.Generator, position_m: Vector3, wanted_share: float) -> Scatterer | None:
    """Draw the static reflection that comes and goes with a placement: farther away, slightly to the side, weaker."""
    share, extra_m, aside_rad, rcs_dbsm = rng.uniform([0.0, 0.8, -0.08, -4.0], [1.0, 3.5, 0.08, 3.0])
    if share > wanted_share:
        return None
    range_m = float(np.linalg.norm(position_m[:2])) + extra_m
    azimuth_rad = float(np.arctan2(position_m[1], position_m[0])) + aside_rad
    x_m, y_m = float(range_m * np.cos(azimuth_rad)), float(range_m * np.sin(azimuth_rad))
    return Scatterer((x_m, y_m, float(-position_m[2])), float(rcs_dbsm))


_CLEARANCE_M = 0.16
"""How far a limb must be from the line of sight for all of the reflector to be visible."""


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedPlacement:
    """The truth about one placement.

    Attributes:
        id: "placement-01" and so on.
        start: when the reflector is released, on the camera's clock.
        end: when it is picked up again.
        position_radar_m: (3,) its apex, which is its phase centre.
        pixel_px: (2,) where the camera sees that apex.
        best_image_time: stamp of the frame nearest to the middle of the dwell with nobody in front.
    """

    id: str
    start: TimeNs
    end: TimeNs
    position_radar_m: Vector3
    pixel_px: Vector2
    best_image_time: TimeNs

    def __post_init__(self) -> None:
        freeze(self, position_radar_m=(3,), pixel_px=(2,))


def placements_of(stage: Stage) -> tuple[SimulatedPlacement, ...]:
    """Return the truth about every placement."""
    placements: list[SimulatedPlacement] = []
    for resting in stage.story.restings:
        point = (stage.rig.radar_from_world @ resting.position_m[None])[0]
        pixel = stage.rig.camera.project(stage.rig.camera_from_radar @ point[None])[0]
        start, end = stage.recorded_span(resting.start_s, resting.end_s)
        best = _best_frame(stage, resting, [placement.best_image_time for placement in placements])
        placements.append(SimulatedPlacement(f"placement-{resting.index + 1:02d}", start, end, point, pixel, best))
    return tuple(placements)


def _best_frame(stage: Stage, resting: Resting, taken: list[TimeNs]) -> TimeNs:
    """Find the frame nearest to the middle of a placement in which the whole reflector is visible.

    Raises:
        OptionError: no frame shows it; the frame rate is too low for the dwell.
    """
    for time in clear_frames(stage, resting):
        if time not in taken:
            return time
    raise OptionError(f"no frame shows placement {resting.index + 1}: raise the frame rate or the dwell time")


def clear_frames(stage: Stage, resting: Resting) -> Iterator[TimeNs]:
    """Yield the stamps of the frames in which nobody hides a placement, those nearest to the middle of its dwell first.

    Several reflectors are clicked when the last of them has been put down, before the first one is moved again.
    """
    restings, together = stage.story.restings, stage.options.reflectors
    last = restings[min(resting.index - resting.index % together + together, len(restings)) - 1]
    start_s, end_s = max(resting.start_s, last.start_s), min(resting.end_s, last.left_alone_s)
    moments = stage.frame_times.moment_s
    inside = np.flatnonzero((moments > start_s) & (moments < end_s))
    middle_s = 0.5 * (start_s + end_s)
    for i in inside[np.argsort(np.abs(moments[inside] - middle_s), kind="stable")].tolist():
        moment = stage.story.at(float(moments[i]))
        people = (moment.person, *moment.passers_by) if stage.options.person else moment.passers_by
        states = (*people, *(actor.state for actor in moment.traffic))
        if not any(_hides(stage, state, resting.position_m) for state in states):
            yield TimeNs(int(stage.frame_times.header_ns[i]))


def _hides(stage: Stage, state: PersonState | VehicleState, position_m: Vector3) -> bool:
    """Return whether a vehicle or a limb is near the line of sight from the camera to the reflector."""
    eye = stage.rig.camera_position_world_m
    if isinstance(state, VehicleState):
        return bool(hidden_by(state, eye, position_m[None])[0])
    sight = np.linspace(0.02, 0.98, 60)[:, None] * (position_m - eye) + eye
    for limb in capsules(state):
        steps = np.linspace(0.0, 1.0, 4)[:, None] * (limb.end_m - limb.start_m) + limb.start_m
        gap = np.linalg.norm(sight[:, None] - steps[None], axis=2).min()
        if gap < max(limb.start_radius_m, limb.end_radius_m) + _CLEARANCE_M:
            return True
    return False
