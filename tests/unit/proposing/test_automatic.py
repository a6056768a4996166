"""Automatic clicks: taken where chance would not do, refused with the reason elsewhere."""

from dataclasses import replace

import numpy as np

from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.measurements import Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.proposing import AutomaticClicks, DwellView, PictureCandidate, automatic_clicks, proposals_of
from calib_core.proposing.candidate_rays import candidate_rays
from calib_core.proposing.mounting_prior import mounting_prior
from calib_core.proposing.pose_agreement import chance_scores, pose_agreement
from calib_core.synthetic.rig import typical_camera
from tests.drawn_views import Drawing, DrawnViews, draw_views, with_pictures_of

OPTIONS = CalibrationOptions()
CAMERA = typical_camera()


def taken(views: tuple[DwellView, ...]) -> AutomaticClicks | Unsolvable:
    return automatic_clicks(proposals_of(views, CAMERA, OPTIONS), views, CAMERA, OPTIONS)


def test_clear_proposals_become_snapped_clicks_in_order_of_time() -> None:
    drawn = draw_views(1, Drawing(count=10))
    found = taken(drawn.views)
    assert isinstance(found, AutomaticClicks)
    assert found.confidence > 0.9
    assert len(found.clicks) >= 8
    assert {click.mark for click in found.clicks} == {"snapped"}
    assert list(found.clicks) == sorted(found.clicks)
    rows = {view.image_time: i for i, view in enumerate(drawn.views)}
    for click in found.clicks:
        assert click.sigma_px is not None
        assert np.linalg.norm(drawn.pixels[rows[click.image_time]] - [click.u_px, click.v_px]) < 5.0 * click.sigma_px


def test_the_radar_of_one_recording_with_the_pictures_of_another_is_refused_with_the_reason() -> None:
    views = with_pictures_of(draw_views(1, Drawing(count=10)), draw_views(2, Drawing(count=10)))
    found = taken(views)
    assert isinstance(found, Unsolvable)
    assert found.code == "not-confident"
    assert "chance" in found.reason


def test_a_pose_with_an_equal_rival_is_refused_and_the_reason_says_so() -> None:
    """Every dwell has a second candidate, as strong as the first, where another mounting would see the reflector."""
    drawn = draw_views(3, Drawing(count=10, decoys=0, clutter=0, listed_share=1.0))
    turn = RigidTransform(rotation_exp(np.array([0.0, 0.12, 0.0])), np.zeros(3))
    positions = np.array([view.placement.position_radar_m for view in drawn.views])
    moved = CAMERA.project((turn @ drawn.camera_from_radar) @ positions)
    views = tuple(
        replace(view, candidates=(*view.candidates, replace(view.candidates[0], pixel_px=pixel)))
        for view, pixel in zip(drawn.views, moved, strict=True)
    )
    found = taken(views)
    assert isinstance(found, Unsolvable)
    assert "another mounting fits nearly as well" in found.reason


def test_too_few_placements_are_refused() -> None:
    found = taken(draw_views(1, Drawing(count=4)).views)
    assert isinstance(found, Unsolvable)
    assert found.reason.startswith("the radar shows 4 placements")
    assert isinstance(taken(()), Unsolvable)


def test_wrong_deals_of_the_radar_score_far_below_the_right_one() -> None:
    rays = candidate_rays(draw_views(4, Drawing(count=8)).views, CAMERA, OPTIONS)
    prior = mounting_prior(OPTIONS, is_flat=False)
    right = pose_agreement(rays, prior)
    assert right is not None
    assert right.score > chance_scores(rays, prior).max() + 5.0


def test_a_person_who_stands_at_every_placement_is_refused_and_not_proposed() -> None:
    """The radar and the pictures agree on the mounting, but no apex is seen although a reflector's would be."""
    drawn = draw_views(1, Drawing(count=10, listed_share=1.0))
    near = tuple(replace(view, width_px=30.0) for view in drawn.views)
    assert not proposals_of(near, CAMERA, OPTIONS).ranked
    found = taken(near)
    assert isinstance(found, Unsolvable)
    assert "it may be a person" in found.reason
    assert len(proposals_of(near, CAMERA, OPTIONS, confirmed=[drawn.click(0)]).ranked) >= 8


def test_apexes_where_the_reflector_is_large_confirm_it() -> None:
    drawn = draw_views(1, Drawing(count=10, listed_share=1.0))
    seen = [replace(view, width_px=30.0, candidates=_with_apex(drawn, i)) for i, view in enumerate(drawn.views)]
    assert isinstance(taken(tuple(seen)), AutomaticClicks)


def _with_apex(drawn: DrawnViews, row: int) -> tuple[PictureCandidate, ...]:
    candidates = drawn.views[row].candidates
    nearest = min(candidates, key=lambda one: float(np.linalg.norm(one.pixel_px - drawn.pixels[row])))
    return tuple(replace(one, has_apex=one is nearest) for one in candidates)
