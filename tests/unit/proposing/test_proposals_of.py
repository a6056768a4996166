"""Proposals from dwell views drawn at random, with known truth."""

import json
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from calib_core.association.placements import Placement
from calib_core.geometry import RigidTransform, rotation_angle_rad, rotation_exp
from calib_core.interchange.own.proposal_documents import PROPOSALS_SCHEMA, ProposalsDocument
from calib_core.json_forms import from_json
from calib_core.measurements import NS_PER_S, ReflectorClick, TimeNs, Unsolvable
from calib_core.options import CalibrationOptions, MountingOptions
from calib_core.proposing import (
    AutomaticClicks,
    DwellView,
    ImageCandidate,
    Proposal,
    Proposals,
    automatic_clicks,
    chance,
    proposals_of,
)
from calib_core.proposing.chance import OTHER_WIDTHS, Chance, chance_of
from calib_core.proposing.proposals import named_proposals, proposals_json
from calib_core.synthetic.rig import typical_camera
from tests.drawn_views import Drawing, DrawnViews, draw_views, with_images_of

OPTIONS = CalibrationOptions()


@pytest.fixture(autouse=True)
def fewer_deals(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Compare fewer deals, which take most of the time; the slow tests of chance compare all."""
    if request.node.get_closest_marker("slow") is None:
        monkeypatch.setattr(chance, "_DEALS", 16)


def proposed(drawn: DrawnViews, clicked: tuple[int, ...] = ()) -> Proposals:
    confirmed = [drawn.click(row) for row in clicked]
    return proposals_of(drawn.views, drawn.camera, OPTIONS, confirmed=confirmed)


def right(drawn: DrawnViews, proposals: Proposals) -> list[bool]:
    """Return for each proposal whether it shows the reflector."""
    row_of = {view.placement.start: i for i, view in enumerate(drawn.views)}
    return [
        bool(np.linalg.norm(one.pixel_px - drawn.pixels[row_of[one.placement.start]]) < 5.0 * one.sigma_px)
        for one in proposals.ranked
    ]


@pytest.mark.parametrize(
    ("drawing", "least_share"),
    [
        pytest.param(Drawing(), 0.9, id="usual", marks=pytest.mark.slow),
        pytest.param(Drawing(offset_m=(0.1, 0.4, 0.3)), 0.9, id="far-apart", marks=pytest.mark.slow),
        pytest.param(Drawing(first_share=0.3, listed_share=0.8), 0.7, id="hard-to-see", marks=pytest.mark.slow),
        pytest.param(Drawing(count=10, is_flat=True), 0.85, id="flat"),
        pytest.param(Drawing(noise=3.0), 0.85, id="coarse", marks=pytest.mark.slow),
        pytest.param(Drawing(count=6), 0.85, id="few"),
    ],
)
def test_nearly_every_reflector_is_proposed_and_few_proposals_are_wrong(drawing, least_share):
    drawn = [draw_views(seed, drawing) for seed in range(2)]
    verdicts = [verdict for one in drawn for verdict in right(one, proposed(one))]
    assert sum(verdicts) >= least_share * 2 * drawing.count
    assert sum(verdicts) >= 0.9 * len(verdicts)


def test_the_pose_is_right_to_a_few_degrees():
    drawn = draw_views(3)
    found = proposed(drawn).agreement.camera_from_radar
    assert rotation_angle_rad(found.rotation @ drawn.camera_from_radar.rotation.T) < np.radians(3.0)


def test_a_person_who_stood_still_is_not_proposed_and_the_reason_says_why():
    drawn = draw_views(5, Drawing(persons=4))
    proposals = proposed(drawn)
    persons = {drawn.views[i].placement.start for i in np.flatnonzero(np.isnan(drawn.pixels[:, 0]))}
    left_out = {placement.start: reason for placement, reason in proposals.unproposed}
    assert persons <= set(left_out)
    assert all("where the other placements expect it" in left_out[start] for start in persons)


def test_what_is_confirmed_is_not_proposed_again_and_counts():
    drawn = draw_views(2, Drawing(count=5, first_share=0.2))
    before, after = proposed(drawn), proposed(drawn, (0, 3))
    covered = {drawn.views[i].placement.start for i in (0, 3)}
    assert not covered & {one.placement.start for one in after.ranked}
    assert not covered & {placement.start for placement, _ in after.unproposed}
    assert all(right(drawn, after))
    assert min((one.confidence for one in after.ranked), default=0.0) >= min(
        (one.confidence for one in before.ranked), default=0.0
    )


def test_one_click_makes_proposals_of_two_dwells_possible():
    drawn = draw_views(1, Drawing(count=3, clutter=0))
    assert all(right(drawn, proposed(drawn, (0,))))


def test_the_images_decide_between_two_positions_of_the_same_returns():
    drawn = draw_views(1, Drawing(count=8, clutter=0))
    positions = [view.placement.position_radar_m for view in drawn.views]
    mirrored = [position * [1.0, -1.0, 1.0] for position in positions]
    listed = [
        (own, other) if row % 4 else (other, own)
        for row, (own, other) in enumerate(zip(positions, mirrored, strict=True))
    ]
    views = tuple(
        replace(view, placement=replace(view.placement, position_radar_m=first, others_radar_m=second[None]))
        for view, (first, second) in zip(drawn.views, listed, strict=True)
    )
    both = proposals_of(views, drawn.camera, OPTIONS)
    assert len(both.ranked) >= 7
    assert all(right(drawn, both))
    assert {one.placement for one in both.ranked} <= {view.placement for view in views}
    assert {views[0].placement, views[4].placement} & {one.placement for one in both.ranked}


def test_the_proposed_pixel_is_always_a_candidate_of_the_image():
    drawn = draw_views(4)
    candidates = {view.placement.start: view.candidates for view in drawn.views}
    for one in proposed(drawn).ranked:
        assert one.candidates[0] in candidates[one.placement.start]
        assert (one.pixel_px == one.candidates[0].pixel_px).all()


def test_dwells_without_images_or_changes_say_so():
    drawn = draw_views(6)
    dark = replace(drawn.views[0], frames=np.zeros(0, np.int64), candidates=())
    same = replace(drawn.views[1], candidates=())
    proposals = proposals_of([dark, same, *drawn.views[2:]], drawn.camera, OPTIONS)
    reasons = {placement.start: reason for placement, reason in proposals.unproposed}
    assert "frame" in reasons[dark.placement.start]
    assert "change" in reasons[same.placement.start]


def test_the_nominal_mounting_is_where_the_search_starts():
    drawn = draw_views(7, Drawing(count=8, turned_deg=0.0))
    turned = replace(OPTIONS, mounting=MountingOptions(yaw_deg=60.0))
    assert proposed(drawn).ranked
    assert not proposals_of(drawn.views, drawn.camera, turned).ranked


@settings(max_examples=4, deadline=None)
@given(seed=st.integers(0, 10_000), count=st.integers(0, 5), listed=st.floats(0.0, 1.0), data=st.data())
def test_every_dwell_is_proposed_or_not_exactly_once_in_any_order(seed, count, listed, data):
    drawn = draw_views(seed, Drawing(count=count, listed_share=listed, decoys=2))
    proposals = proposed(drawn)
    starts = [one.placement.start for one in proposals.ranked] + [one.start for one, _ in proposals.unproposed]
    assert sorted(starts) == sorted(view.placement.start for view in drawn.views)
    confidences = [one.confidence for one in proposals.ranked]
    assert confidences == sorted(confidences, reverse=True)
    assert all(0.0 < one <= 1.0 for one in confidences)
    shuffled = data.draw(st.permutations(drawn.views))
    again = proposals_of(shuffled, drawn.camera, OPTIONS)
    assert [one.placement.start for one in again.ranked] == [one.placement.start for one in proposals.ranked]


def test_one_wrong_click_does_not_mislead():
    drawn = draw_views(3, Drawing(count=10, listed_share=1.0))
    wrong = replace(drawn.click(1), u_px=60.0, v_px=60.0)
    proposals = proposals_of(drawn.views, drawn.camera, OPTIONS, confirmed=[wrong])
    assert len(proposals.ranked) >= 8
    assert all(right(drawn, proposals))


@pytest.mark.parametrize(("off_px", "slips"), [(0.0, False), (45.0, True), (400.0, False)])
def test_a_click_that_slips_is_named_and_its_placement_is_not_offered(off_px, slips):
    """What is much farther off may be another reflector, which the radar does not report."""
    drawn = draw_views(3, Drawing(count=8, listed_share=1.0))
    click = drawn.click(1)
    click = replace(click, u_px=click.u_px + off_px * (1.0 if click.u_px < 640.0 else -1.0))
    found = proposals_of(drawn.views, drawn.camera, OPTIONS, confirmed=[drawn.click(0), click, drawn.click(2)])
    assert [slip.click for slip in found.slips] == [click.id] * slips
    assert all(slip.off_px == pytest.approx(off_px, rel=0.5) for slip in found.slips)
    offered = {proposal.placement.start for proposal in found.ranked}
    assert (drawn.views[1].placement.start in offered) == (off_px > 100.0)


@pytest.mark.slow
def test_confidence_is_borne_out():
    """Of proposals with confidence p a share of about p is right, and the surer third is right more often than the other end."""
    drawn = [draw_views(seed, Drawing(count=10, decoys=9, first_share=0.5, listed_share=0.8)) for seed in range(6)]
    found = [(one.confidence, good) for own in drawn for one, good in _with_verdicts(own)]
    confidence, good = np.array(sorted(found)).T
    third = len(found) // 3
    assert confidence.mean() == pytest.approx(good.mean(), abs=0.1)
    assert good[:third].mean() < good[-third:].mean()


def _with_verdicts(drawn: DrawnViews) -> list[tuple[Proposal, bool]]:
    proposals = proposed(drawn)
    return list(zip(proposals.ranked, right(drawn, proposals), strict=True))


@pytest.mark.parametrize(("apart_px", "is_same"), [(2.0, True), (40.0, False)])
def test_an_echo_of_a_marked_reflector_is_not_proposed_and_says_where_it_is_marked(apart_px, is_same):
    drawn = draw_views(3, Drawing(count=2, decoys=0, clutter=0, listed_share=1.0))
    first = replace(drawn.views[0], width_px=30.0)
    placement = first.placement
    later = replace(
        placement, start=TimeNs(first.image_time + 1), position_radar_m=1.4 * np.array(placement.position_radar_m)
    )
    seen = replace(first.candidates[0], pixel_px=drawn.pixels[0] + [apart_px, 0.0], likeness=0.95)
    echo = replace(first, placement=later, candidates=(seen,))
    views = [first, drawn.views[1], echo]
    found = proposals_of(views, drawn.camera, OPTIONS, confirmed=[drawn.click(0)])
    assert (later.start in {one.placement.start for one in found.ranked}) != is_same
    reasons = {one.start: reason for one, reason in found.unproposed}
    range_m = np.linalg.norm(placement.position_radar_m)
    words = f"its place is marked already, at the placement of {range_m:.1f} m"
    assert (reasons.get(later.start) == words) == is_same
    out = replace(drawn.click(0), excluded=True)
    without = proposals_of(views, drawn.camera, OPTIONS, confirmed=[out])
    assert words not in {reason for _, reason in without.unproposed}


def test_a_fairly_sure_proposal_says_when_its_apex_is_not_seen():
    found = [one for seed in (3, 4, 7) for one in proposed(draw_views(seed, Drawing(count=5))).ranked]
    fairly = [one for one in found if 0.8 <= one.confidence < 0.9]
    assert fairly
    assert all("blurred" in one.reason for one in fairly)


# Proposals as JSON: valid, the same each time, and with ids that confirming does not change.


SOURCE = ProposalsDocument(PROPOSALS_SCHEMA, ["radar.bag"], "/image", ["/radar"], 0.24, ["c1"], [], [])


def placement(number: int, x_m: float) -> Placement:
    start = 10 * number * NS_PER_S
    return Placement(TimeNs(start), TimeNs(start + 4 * NS_PER_S), np.array([x_m, 1.0, 0.0]), 0.9)


def view(one: Placement) -> DwellView:
    return DwellView(one, np.zeros(0, np.int64), one.start, np.zeros((0, 0, 3), np.uint8), 1.0)


def proposal(one: Placement, confidence: float) -> Proposal:
    candidate = ImageCandidate(np.array([30.0, 40.0]), 0.5, 12.0)
    return Proposal(one, one.start, candidate.pixel_px, 0.5, confidence, (candidate,))


PLACEMENTS = (placement(1, 5.0), placement(1, 9.0), placement(2, 7.0))
VIEWS = tuple(map(view, PLACEMENTS))


def test_an_id_is_the_number_of_the_placement_whatever_else_is_proposed():
    first, second, third = (proposal(one, 0.9) for one in PLACEMENTS)
    assert [name for name, _ in named_proposals(Proposals((third, first, second)), VIEWS)] == ["p3", "p1", "p2"]
    assert [name for name, _ in named_proposals(Proposals((third,)), VIEWS)] == ["p3"]


def test_an_id_that_a_click_has_is_not_given_twice():
    named = named_proposals(Proposals((proposal(PLACEMENTS[0], 0.9),)), VIEWS, ["p1", "p1-proposed"])
    assert [name for name, _ in named] == ["p1-proposed-proposed"]


def test_the_document_follows_its_schema_and_unknown_figures_are_null():
    agreement = replace(proposed(draw_views(3, Drawing(count=6))).agreement, share=0.8)
    proposals = Proposals((proposal(PLACEMENTS[2], 0.9),), ((PLACEMENTS[0], "nothing changed"),), agreement)
    text = proposals_json(proposals, VIEWS, SOURCE)
    assert text == proposals_json(proposals, VIEWS, SOURCE)
    document = json.loads(text)
    msgspec.convert(document, ProposalsDocument, dec_hook=from_json)
    (one,) = document["proposals"]
    assert one["click"] == {
        "id": "p3",
        "image_time": {"sec": 20, "nanosec": 0},
        "pixel_px": [30.0, 40.0],
        "sigma_px": 0.5,
        "mark": "snapped",
    }
    assert one["candidates"][0]["likeness"] is None
    assert one["placement"]["snr_db"] is None
    assert document["unproposed"][0]["reason"] == "nothing changed"
    assert document["camera_from_radar"]["agreement"] == 0.8


def test_without_a_mounting_there_is_none_in_the_document():
    assert json.loads(proposals_json(Proposals(()), VIEWS, SOURCE))["camera_from_radar"] is None


# Automatic clicks: taken where chance would not do, refused with the reason elsewhere.

CAMERA = typical_camera()


def taken(views: tuple[DwellView, ...], *confirmed: ReflectorClick) -> AutomaticClicks | Unsolvable:
    proposals = proposals_of(views, CAMERA, OPTIONS, confirmed=confirmed)
    return automatic_clicks(proposals, len(views), confirmed=confirmed)


@pytest.mark.slow
def test_clear_proposals_become_snapped_clicks_in_order_of_time():
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


def test_the_radar_of_one_recording_with_the_images_of_another_is_refused_with_the_reason():
    views = with_images_of(draw_views(1, Drawing(count=10)), draw_views(2, Drawing(count=10)))
    found = taken(views)
    assert found.code == "not-confident"
    assert found.facts["why"] == "chance"


def test_a_pose_with_an_equal_rival_is_refused_and_the_reason_says_so():
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
    assert found.code == "not-confident"
    assert found.facts["why"] == "rival"


def test_too_few_placements_are_refused():
    found = taken(draw_views(1, Drawing(count=4)).views)
    assert found.code == "not-confident"
    assert found.facts == {"why": "few-placements", "placements": 4}
    assert isinstance(taken(()), Unsolvable)


def faded(drawn: DrawnViews, fading_db: float) -> tuple[DwellView, ...]:
    return tuple(replace(view, placement=replace(view.placement, fading_db=fading_db)) for view in drawn.views)


def test_a_person_who_stands_at_every_placement_is_refused_and_not_proposed():
    """The radar and the images agree on the mounting, but the echo fades."""
    drawn = draw_views(1, Drawing(count=10, listed_share=1.0))
    views = faded(drawn, 5.6)
    assert not proposals_of(views, CAMERA, OPTIONS).ranked
    found = taken(views)
    assert found.code == "not-confident"
    assert found.facts["why"] == "fading"
    assert len(proposals_of(views, CAMERA, OPTIONS, confirmed=[drawn.click(0)]).ranked) >= 8
    with_a_click = taken(views, drawn.click(0))
    assert isinstance(with_a_click, AutomaticClicks)
    assert drawn.views[0].image_time not in {click.image_time for click in with_a_click.clicks}


@pytest.mark.parametrize(
    ("fading_db", "is_reflector"), [(1.0, True), pytest.param(1.8, True, marks=pytest.mark.slow), (3.6, False)]
)
def test_an_echo_that_fades_is_a_persons_until_somebody_clicks(fading_db, is_reflector):
    drawn = draw_views(1, Drawing(count=6))
    views = faded(drawn, fading_db)
    found = proposals_of(views, CAMERA, OPTIONS)
    assert (found.reflectors > 0.5) == is_reflector
    assert bool(found.ranked) == is_reflector
    assert proposals_of(views, CAMERA, OPTIONS, confirmed=[drawn.click(0)]).ranked


@pytest.mark.parametrize(("apexes", "is_reflector"), [(0, False), (3, True)])
def test_without_strengths_apexes_tell_a_reflector_until_somebody_clicks(apexes, is_reflector):
    drawn = draw_views(1, Drawing(count=6, first_share=1.0, listed_share=1.0))
    views = [
        replace(view, candidates=tuple(replace(one, has_apex=True) for one in view.candidates)) if k < apexes else view
        for k, view in enumerate(faded(drawn, float("nan")))
    ]
    found = proposals_of(views, CAMERA, OPTIONS)
    assert bool(found.ranked) == is_reflector
    assert proposals_of(views, CAMERA, OPTIONS, confirmed=[drawn.click(0)]).ranked


@pytest.mark.slow
def test_the_width_is_found_far_beyond_chance_where_images_and_radar_belong_together():
    few = Drawing(count=6)
    views, of_another = draw_views(4, few).views, with_images_of(draw_views(4, few), draw_views(24, few))
    own, other = (chance_of(one, CAMERA, OPTIONS, widths=(1.0, *OTHER_WIDTHS)) for one in (views, of_another))
    assert own.probability > 0.9
    assert other.probability < 0.5
    assert own.score > max(own.by_chance.max(), other.score) + 5.0


def test_without_other_times_chance_is_unknown_and_nothing_is_trusted():
    views = draw_views(4, Drawing(count=8)).views
    first = views[0].placement
    at_once = [replace(view, placement=replace(view.placement, start=first.start, end=first.end)) for view in views]
    found = chance_of(at_once, CAMERA, OPTIONS)
    assert not len(found.by_chance)
    assert found.probability == 0.0


def test_a_pose_is_no_farther_beyond_chance_than_it_explains_what_full_images_show():
    mixed = with_images_of(draw_views(1, Drawing(count=6)), draw_views(2, Drawing(count=6)))
    found = proposals_of(mixed, CAMERA, OPTIONS, chance=Chance(1.0, 50.0, np.zeros(9), is_clicked=False))
    assert found.chance.score == found.agreement.score < 50.0
    assert not found.ranked


def test_the_spread_of_deals_is_wider_where_there_are_more_than_are_compared():
    few, many = (Chance(1.0, 0.0, np.tile([-4.0, 4.0], count), is_clicked=False) for count in (4, 8))
    assert few.bound == pytest.approx(16.0)
    assert many.bound == pytest.approx(1.1 * few.bound)
