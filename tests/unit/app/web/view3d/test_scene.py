"""Shapes of the 3D view are where they should be; a view drawn again assigns properties and adds no node."""

import contextlib
import io
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from calib_core.association.placements import Placement
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform
from calib_core.measurements import RadarScan, ReflectorClick, TimeNs
from calib_core.options import CalibrationOptions, NoiseOptions
from calib_core.radar import RadarErrors, cartesian_from_polar, polar_from_cartesian
from calib_core.results import Calibration, Metrics, NextPlacement, PairResult
from cocalib.colours import residual_colours
from cocalib.session.applying import History
from cocalib.session.state import DismissedPlacement, RecordingFacts, Session
from cocalib.view.build import view
from cocalib.view.model import Advice
from cocalib.web.frames import Frame
from cocalib.web.messages.outgoing import FrameHeader
from cocalib.web.radar_sight import Returns
from cocalib.web.view3d.extent import UNKNOWN, Extent
from cocalib.web.view3d.returns import Colouring
from cocalib.web.view3d.scene import TabScene
from cocalib.web.view3d.shapes import (
    ellipsoids,
    next_place,
    nominal_camera_from_radar,
    range_rings,
    rays_to,
    vertical_field_of_view_rad,
)
from cocalib.web.view3d.sight import Sight, space_frame

CAMERA = Camera("pinhole", 640, 480, np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]]))
FACTS = RecordingFacts("made", np.arange(4, dtype=np.int64) * 1000, 640, 480)


def calibration(*, off_px: float = 0.0) -> Calibration:
    """Return a calibration whose clicks lie `off_px` right of their reprojections."""
    camera_from_radar = RigidTransform(nominal_camera_from_radar().rotation, np.array([0.1, 0.2, 0.0]))
    points = np.array([[5.0, 1.0, -0.5], [8.0, -2.0, 0.3], [12.0, 0.5, -0.8], [6.0, 0.0, 0.0]])
    pixels = CAMERA.project(camera_from_radar @ points)
    pairs = tuple(
        PairResult(f"c{place + 1}", np.add(pixel, (off_px, 0.0)), pixel, point, inlier=True)
        for place, (pixel, point) in enumerate(zip(pixels, points, strict=True))
    )
    metrics = Metrics(off_px, 0.0, off_px, n=len(pairs))
    return Calibration(camera_from_radar, np.full((6, 6), np.nan), CAMERA, metrics, pairs, (), (), CalibrationOptions())


@pytest.mark.parametrize("errors", [RadarErrors(), RadarErrors(0.02, -0.01, 0.1)], ids=["none", "of the radar"])
def test_a_ray_of_an_exact_click_ends_at_the_true_position_of_its_return(errors):
    solved = calibration()
    biased = tuple(replace(pair, point_radar_m=reported(errors, pair.point_radar_m)) for pair in solved.pairs)
    rays = rays_to(replace(solved, pairs=biased, radar_errors=errors), biased)
    assert rays[:, 1] == pytest.approx(np.array([pair.point_radar_m for pair in solved.pairs]), abs=1e-9)
    centre = solved.camera_from_radar.inverse().translation_m
    assert rays[:, 0] == pytest.approx(np.broadcast_to(centre, (4, 3)), abs=1e-12)


def reported(errors: RadarErrors, point_radar_m: np.ndarray) -> np.ndarray:
    """Return what a radar with these errors reports for a true position (3,)."""
    scales = np.array([1.0, 1.0 + errors.azimuth_scale, 1.0 + errors.elevation_scale])
    polar = polar_from_cartesian(point_radar_m[None]) * scales + np.array([errors.range_bias_m, 0.0, 0.0])
    return cartesian_from_polar(polar)[0]


def test_rings_are_at_their_ranges():
    ranges = polar_from_cartesian(range_rings((5.0, 10.0, 50.0)).reshape(-1, 3))[:, 0]
    assert set(np.round(ranges, 9)) == {5, 10, 50}


def test_an_ellipsoid_holds_its_point_and_reaches_as_far_as_the_noise_says():
    point = np.array([[10.0, 0.0, 0.0]])
    shell = ellipsoids(
        point, NoiseOptions(sigma_range_m=0.1, sigma_azimuth_deg=1.0, sigma_elevation_deg=2.0), (1, 1, 2, 1)
    )
    reach = np.abs(shell.reshape(-1, 3) - point).max(axis=0)
    sigma_m = [0.1, 10 * np.deg2rad(1.0) * 2, 10 * np.deg2rad(2.0)]
    assert reach == pytest.approx(np.sqrt(7.8147) * np.array(sigma_m), rel=0.02)


def test_small_residuals_are_blue_large_ones_red_and_unknown_ones_grey():
    small, large, beyond, unknown = residual_colours(np.array([0.0, 10.0, 99.0, np.nan]), 10.0).astype(int)
    assert small[2] > small[0]
    assert large[0] > large[2]
    assert np.array_equal(large, beyond)
    assert np.ptp(unknown) < 30


def test_the_nominal_camera_looks_along_the_radars_x_axis():
    ahead, left, up = nominal_camera_from_radar() @ np.eye(3)
    assert ahead == pytest.approx([0, 0, 1])
    assert left == pytest.approx([-1, 0, 0])
    assert up == pytest.approx([0, -1, 0])
    assert vertical_field_of_view_rad(CAMERA) == pytest.approx(2 * np.arctan(240 / 500))


class Drawn:
    """A 3D view over a real viser server, with the client's camera recorded."""

    def __init__(self, server: Any) -> None:
        self.moved: list[Any] = []
        self.camera = SimpleNamespace(
            position=(-5.0, 0.0, 3.6), image_width=1600, image_height=1000, on_update=self.moved.append
        )
        client = SimpleNamespace(scene=server.scene, camera=self.camera, atomic=server.atomic, flush=server.flush)
        self.scene = TabScene(client)
        self.node = server.scene.get_handle_by_name

    def names(self) -> list[str]:
        return sorted(
            name
            for name in ("/returns_2", "/window", "/chosen", "/rays", "/ray", "/gap", "/next")
            if self.node(name).visible
        )


@pytest.fixture
def drawn() -> Iterator[Drawn]:
    import viser

    with contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
        yield Drawn(server)
        server.stop()


def coloured(extent: Extent = UNKNOWN, *, light: bool = False) -> Colouring:
    return Colouring("speed", extent, None, 1.0, light)


def sight(outcome: Calibration | None = None, *, selected: str | None = None, index: int = 0) -> Sight:
    clicks = tuple(ReflectorClick(TimeNs(place * 1000), f"c{place + 1}", 100.0, 100.0) for place in range(4))
    session = Session(clicks=clicks, outcome=outcome, outcome_revision=0 if outcome else -1)
    points, none = np.array([[4.0, 0.0, 0.0], [9.0, 1.0, 0.2]]), np.full(2, np.nan)
    scan = RadarScan(TimeNs(0), points, np.array([0.0, 1.5]), none, np.full((2, 3), np.nan))
    returns = Returns.of_scan(scan, session.options.gating, lambda reported: reported)
    image = Frame(FrameHeader(index, 0, 640, 480, 1.0, "jpeg"), b"jpeg")
    return Sight(
        number=index + 1,
        index=index,
        session=session,
        view=view(History(session), FACTS),
        selected=selected,
        returns=returns,
        trail_s=0.0,
        window=returns.rows(np.array([0])),
        image=image,
        camera=CAMERA,
        has_images=True,
        colouring=coloured(),
    )


def test_before_a_calibration_the_camera_stands_dimmed_at_the_radar_and_carries_the_image(drawn):
    drawn.scene.show(sight())
    frustum = drawn.node("/camera")
    assert frustum.position == pytest.approx([0, 0, 0])
    assert frustum._image_data == b"jpeg"
    assert drawn.names() == ["/returns_2", "/window"], "without SNR, all returns have the middle size"
    still, moving = drawn.node("/returns_2").colors.tolist()
    assert still != moving


def test_with_a_calibration_the_camera_moves_to_its_place_and_the_pairs_appear_until_an_undo_to_nothing(drawn):
    drawn.scene.show(sight())
    dimmed = drawn.node("/camera").color
    solved = calibration(off_px=12.0)
    drawn.scene.show(sight(solved, selected="c2"))
    frustum = drawn.node("/camera")
    assert frustum.position == pytest.approx(solved.camera_from_radar.inverse().translation_m)
    assert frustum.color != dimmed
    assert drawn.names() == ["/chosen", "/gap", "/ray", "/rays", "/returns_2", "/window"]
    assert len(drawn.node("/chosen").points) == 4
    drawn.scene.show(sight(solved))
    assert "/gap" not in drawn.names()
    drawn.scene.show(sight())
    assert drawn.names() == ["/returns_2", "/window"]
    assert drawn.node("/camera").position == pytest.approx([0, 0, 0])


def test_the_best_next_placement_is_ringed_until_no_more_are_needed(drawn):
    segments = next_place(np.array([[6.0, -2.0, 0.4]]), radius_m=0.5)
    ring, plumb = segments[:-1], segments[-1]
    assert np.linalg.norm(ring - [6.0, -2.0, 0.4], axis=2) == pytest.approx(0.5)
    assert ring[..., 2] == pytest.approx(0.4), "it is level"
    assert np.linalg.norm(ring[:, 1] - ring[:, 0], axis=1).sum() == pytest.approx(np.pi * 0.5, rel=0.01), "half gaps"
    assert plumb == pytest.approx(np.array([[6.0, -2.0, 0.15], [6.0, -2.0, 0.65]]))
    best = NextPlacement(np.array([4.0, 3.0, 0.0]), np.array([10.0, 20.0]), 1.4, False)
    for may_stop in (False, True):
        seen, advice = sight(calibration()), Advice(replace(best, may_stop=may_stop), 5.0, "There.")
        drawn.scene.show(replace(seen, view=replace(seen.view, advice=advice)))
        assert ("/next" in drawn.names()) == (not may_stop)
    assert drawn.node("/next").points.reshape(-1, 3).mean(axis=0) == pytest.approx([4.0, 3.0, 0.0], abs=0.05)


def test_in_the_light_theme_nothing_is_white_on_white(drawn):
    solved = calibration()
    drawn.scene.show(sight(solved, selected="c2"))
    dark = drawn.node("/camera").color
    drawn.scene.show(replace(sight(solved, selected="c2"), colouring=coloured(light=True)))
    assert drawn.node("/camera").color != dark
    for name in ("/ray", "/returns_2", "/window", "/ground/rings"):
        assert np.asarray(drawn.node(name).colors).reshape(-1, 3).mean(axis=1).max() < 170
    drawn.scene.show(sight(solved, selected="c2"))
    assert drawn.node("/camera").color == dark
    assert np.asarray(drawn.node("/ray").colors).min() == 255


def test_the_page_can_tell_which_frame_the_3d_view_has_drawn(drawn):
    drawn.scene.show(sight(index=312))
    assert drawn.node("/shown").position == pytest.approx((312, 313, 0))
    assert space_frame(sight(index=312)).number == 313


@pytest.mark.parametrize("viewpoint", ["behind", "above", "side"])
def test_every_viewpoint_looks_at_what_lies_before_the_radar(drawn, viewpoint):
    drawn.scene.show(sight(calibration()))
    drawn.scene.look_from(viewpoint)
    direction = np.subtract(drawn.camera.look_at, drawn.camera.position)
    to_reflector = np.subtract((6.0, 0.0, 0.0), drawn.camera.position)
    cosine = direction @ to_reflector / np.linalg.norm(direction) / np.linalg.norm(to_reflector)
    assert cosine > 0.95


def test_once_the_extent_is_known_the_viewpoint_fits_it_unless_the_user_has_moved_it(drawn):
    drawn.scene.show(sight())
    before = np.array(drawn.camera.position)
    road = Extent(200.0, ((0.0, 0.0), (200.0, -140.0), (200.0, 140.0)), -1.0, 4.0)
    drawn.scene.show(replace(sight(), colouring=coloured(road)))
    stands = np.array(drawn.camera.position)
    assert np.linalg.norm(stands) > 5 * np.linalg.norm(before)
    assert polar_from_cartesian(drawn.node("/ground/rings").points.reshape(-1, 3))[:, 0].max() == pytest.approx(200)
    drawn.camera.position = moved = (1.0, 2.0, 3.0)
    drawn.scene.show(replace(sight(), colouring=coloured(replace(road, range_m=50.0))))
    assert drawn.camera.position == moved


def test_a_view_of_another_shape_is_fitted_again_unless_the_user_has_moved_it(drawn):
    drawn.scene.show(sight())
    drawn.scene.look_from("above")
    before, drawn.camera.image_width = drawn.camera.position, 400
    drawn.moved[0](drawn.camera)
    assert drawn.camera.position[2] > before[2]
    drawn.camera.position, drawn.camera.image_width = (1.0, 2.0, 3.0), 1600
    drawn.moved[0](drawn.camera)
    assert drawn.camera.position == (1.0, 2.0, 3.0)


def test_the_image_in_the_frustum_is_an_outline_where_it_would_hide_a_placement(drawn):
    drawn.scene.show(replace(sight(), placements=(Placement(TimeNs(0), TimeNs(500), np.array([6.0, 0.0, 0.0]), 1.0),)))
    frustum = drawn.node("/camera")
    for viewer_m, data in (
        ((-6.0, 0.0, 0.0), None),
        ((-6.0, 0.0, 9.0), b"jpeg"),
        ((-6.0, 0.0, 0.1), None),
        ((-6.0, 0.0, 0.3), None),
        ((9.0, 0.0, 0.0), b"jpeg"),
    ):
        drawn.camera.position = viewer_m
        drawn.moved[0](drawn.camera)
        assert frustum._image_data == data


def test_axes_and_frustum_keep_their_size_on_the_screen(drawn):
    drawn.scene.show(sight())
    seen = []
    for range_m in (10.0, 300.0):
        drawn.scene.show(
            replace(sight(), colouring=coloured(Extent(range_m, ((0.0, -range_m), (range_m, range_m)), -1.0, 1.0)))
        )
        distance_m = np.linalg.norm(drawn.camera.position)
        seen.append([drawn.node("/camera").scale / distance_m, drawn.node("/radar").axes_length / distance_m])
    assert seen[0] == pytest.approx(seen[1])


def test_a_placement_is_open_marked_or_dismissed():
    apart = [(5.0, 1.0, -0.5), (5.0, -4.0, 0.0), (8.0, -2.0, 0.3), (9.0, 0.0, 0.0)]
    spans = [(0, 500), (0, 500), (1000, 1500), (9000, 9500)]
    placements = tuple(
        Placement(TimeNs(start), TimeNs(end), np.array(place), 1.0)
        for (start, end), place in zip(spans, apart, strict=True)
    )
    seen = replace(sight(calibration()), placements=placements)
    assert seen.placement_states() == ("marked", "open", "marked", "open"), "two at once: the pair's is the marked one"
    dismissed = replace(seen.session, dismissed=(DismissedPlacement(TimeNs(9100), (9.0, 0.0, 0.0)),))
    states = replace(seen, session=dismissed).placement_states()
    assert states == ("marked", "open", "marked", "dismissed")
    assert [one.state for one in space_frame(seen).placements] == list(seen.placement_states())


def test_what_can_be_picked_is_where_the_lens_shows_it():
    solved = calibration()
    look = space_frame(sight(solved, selected="c2"))
    assert look.projected
    pixels = solved.camera.project(solved.camera_from_radar @ np.array([[4.0, 0.0, 0.0]]))
    assert (look.returns[0].seen.u_px, look.returns[0].seen.v_px) == pytest.approx(pixels[0], abs=0.01)
    assert [one.id for one in look.reflectors] == ["c1", "c2", "c3", "c4"]
    assert [label.kind for label in look.labels] == ["selected"]
    before = space_frame(sight())
    assert not before.projected
    assert np.isnan(before.returns[0].seen.u_px)
    assert before.rings_m[-1] >= UNKNOWN.range_m
