"""The pose on which dwells and candidates agree, on views drawn at random."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.measurements import TimeNs
from calib_core.options import CalibrationOptions, CameraPositionPrior, SolvingOptions
from calib_core.proposing import DwellView, proposals_of
from calib_core.proposing.candidate_rays import CandidateRays, candidate_rays
from calib_core.proposing.pose_agreement import (
    PoseAgreement,
    mounting_prior,
    pose_agreement,
    rotation_consensus,
)
from tests.drawn_views import Drawing, DrawnViews, draw_views

OPTIONS = CalibrationOptions()


def agreed(rays: CandidateRays, options: CalibrationOptions = OPTIONS) -> PoseAgreement:
    found = pose_agreement(rays, mounting_prior(options, is_flat=rays.is_flat))
    assert found is not None
    return found


def test_a_camera_half_a_metre_away_is_found_there():
    drawn = draw_views(1, Drawing(count=16, offset_m=(0.0, 0.5, 0.1)))
    found = agreed(candidate_rays(drawn.views, drawn.camera, OPTIONS))
    assert found.camera_from_radar.inverse().translation_m[1] == pytest.approx(0.5, abs=0.25)


def test_a_measured_camera_position_is_kept():
    drawn = draw_views(1, Drawing(count=8, offset_m=(0.0, 0.5, 0.1)))
    measured = CameraPositionPrior(position_m=(0.0, 0.5, 0.1), sigma_m=0.01)
    options = replace(OPTIONS, solving=SolvingOptions(camera_position=measured))
    found = agreed(candidate_rays(drawn.views, drawn.camera, options), options)
    assert found.camera_from_radar.inverse().translation_m == pytest.approx([0.0, 0.5, 0.1], abs=0.05)


def test_without_elevation_the_camera_is_found_above_the_plane_of_the_placements():
    """The radar reports what lies 1.2 m below it as if it lay at its own height, so the camera seems to be that much higher."""
    drawn = draw_views(2, Drawing(count=16, is_flat=True))
    rays = candidate_rays(drawn.views, drawn.camera, OPTIONS)
    assert rays.is_flat
    assert agreed(rays).camera_from_radar.inverse().translation_m[2] == pytest.approx(1.25, abs=0.25)


def test_the_noise_of_a_coarse_radar_is_noticed():
    levels = [
        agreed(candidate_rays(draw_views(3, Drawing(noise=noise)).views, draw_views(3).camera, OPTIONS)).noise
        for noise in (0.3, 4.0)
    ]
    assert levels[0] < levels[1]


def test_a_dwell_does_not_vouch_for_its_own_candidate():
    drawn = draw_views(4, Drawing(count=8, decoys=0, clutter=0, listed_share=1.0))
    moved = replace(drawn.views[2].candidates[0], pixel_px=drawn.pixels[2] + [150.0, 100.0])
    views = [replace(view, candidates=(moved,)) if i == 2 else view for i, view in enumerate(drawn.views)]
    found = agreed(candidate_rays(views, drawn.camera, OPTIONS))
    assert found.probability[2, 0] < 0.1
    assert np.delete(found.probability[:, 0], 2).min() > 0.8


def test_what_repeats_itself_at_one_place_counts_less():
    drawn = draw_views(5, Drawing(count=10, decoys=2, clutter=1))
    rays = candidate_rays(drawn.views, drawn.camera, OPTIONS)
    true_px = drawn.pixels
    repeated, moved = [], []
    for i, view in enumerate(drawn.views):
        for k, one in enumerate(view.candidates):
            others = [other.pixel_px for j, own in enumerate(drawn.views) if j != i for other in own.candidates]
            near = sum(np.linalg.norm(one.pixel_px - other) < 5.0 for other in others)
            if near >= 5:
                repeated.append(rays.density[i, k])
            elif np.linalg.norm(one.pixel_px - true_px[i]) < 30.0:
                moved.append(rays.density[i, k])
    assert min(repeated) > 5.0 * float(np.median(moved))


def test_one_dwell_in_ten_is_no_reflector_however_plain_its_only_place_is():
    drawn = draw_views(5, Drawing(count=4, decoys=0, clutter=0, listed_share=1.0))
    plain = [replace(view, candidates=(replace(view.candidates[0], has_apex=True),)) for view in drawn.views]
    missing = candidate_rays(plain, drawn.camera, OPTIONS).missing
    assert 0.07 < missing.min() <= missing.max() < 0.15


def two_at_once() -> tuple[DrawnViews, list[DwellView]]:
    """All dwells of an even number last until the next one ends, and both reflectors are seen in each."""
    drawn = draw_views(6, Drawing(count=8, decoys=1, clutter=0, listed_share=1.0))
    views: list[DwellView] = []
    for i, view in enumerate(drawn.views):
        first, second = drawn.views[i - i % 2], drawn.views[i - i % 2 + 1]
        both = TimeNs(first.placement.start), TimeNs(second.placement.end)
        placement = replace(view.placement, start=both[0], end=both[1])
        candidates = (*first.candidates, *second.candidates)
        views.append(replace(view, placement=placement, image_time=second.image_time, candidates=candidates))
    return drawn, views


@pytest.mark.parametrize("reported", [True, False])
def test_a_click_while_two_reflectors_stand_covers_the_one_that_it_shows_if_the_radar_reports_it(reported):
    drawn, views = two_at_once()
    click = replace(drawn.click(2), image_time=views[2].image_time)
    other = views[3].placement
    proposals = proposals_of(views if reported else [*views[:2], *views[3:]], drawn.camera, OPTIONS, confirmed=[click])
    assert len(proposals.ranked) + len(proposals.unproposed) == 7
    shown = [one for one in proposals.ranked if one.placement is other]
    assert len(shown) == 1
    assert np.linalg.norm(shown[0].pixel_px - drawn.pixels[3]) < 5.0 * shown[0].sigma_px


def test_two_dwells_give_every_rotation_that_the_mounting_allows():
    drawn = draw_views(7, Drawing(count=2, decoys=0, clutter=0, listed_share=1.0))
    rays = candidate_rays(drawn.views, drawn.camera, OPTIONS)
    found = rotation_consensus(rays, mounting_prior(OPTIONS, is_flat=False))
    assert found.tried == 1
    assert np.einsum("hij,hkj->hik", found.rotations, found.rotations)[0] == pytest.approx(np.eye(3), abs=1e-9)


def test_nothing_to_agree_on_is_none():
    drawn = draw_views(8, Drawing(count=3, decoys=0, clutter=0, listed_share=0.0))
    rays = candidate_rays(drawn.views, drawn.camera, OPTIONS)
    assert pose_agreement(rays, mounting_prior(OPTIONS, is_flat=False)) is None
