"""The one list of reflectors seen: which placement a click is of, and what leaves the list once there is a usable pose."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulated_pairs import simulate_pairs
from calib_core.association.placements import Placement
from calib_core.calibration import calibrate_pairs
from calib_core.measurements import ReflectorClick, TimeNs, Unsolvable
from calib_core.radar import polar_from_cartesian
from calib_core.results import Calibration
from cocalib.session.applying import History, advance
from cocalib.session.events import ClickPlaced, PlacementDismissed
from cocalib.session.state import RecordingFacts, Session
from cocalib.view.build import view
from cocalib.view.placement_states import SeenPlacements, Spots, placement_states, placements_of_clicks

S = 10**9
FACTS = RecordingFacts("drive", S * np.arange(50), width_px=640, height_px=480)


def placement(start_s: float, position_m: object = (5.0, 0.0, 0.0), lasts_s: float = 4.0) -> Placement:
    start = TimeNs(int(start_s * S))
    return Placement(start, TimeNs(start + int(lasts_s * S)), np.array(position_m, dtype=np.float64), 1.0)


def states(session: Session, *placements: Placement, **spots: Spots) -> tuple[str, ...]:
    of_clicks = placements_of_clicks(session, placements)
    return placement_states(
        session, SeenPlacements(placements, {int(name[1:]): one for name, one in spots.items()}), of_clicks
    )


def test_a_placement_is_open_until_it_is_clicked_or_dismissed():
    found = [placement(1), placement(11), placement(21), placement(31), placement(31, (9.0, 0.0, 0.0))]
    history = advance(History(), ClickPlaced(TimeNs(12 * S), (1.0, 1.0), "clicked"), FACTS)
    history = advance(history, PlacementDismissed(TimeNs(32 * S), (5.0, 0.0, 0.0)), FACTS)
    assert states(history.present, *found) == ("open", "marked", "open", "dismissed", "open")
    seen = view(history, FACTS, seen=SeenPlacements(tuple(found)))
    assert (seen.placements.count("open"), seen.clicks[0].placement) == (3, 1)
    assert view(history, FACTS).clicks[0].placement == -1, "no placement is known"


def test_a_mark_that_nobody_has_touched_is_a_guess():
    click = ReflectorClick(TimeNs(2 * S), "c1", 1.0, 1.0)
    for one, state in (
        (click, "marked"),
        (replace(click, excluded=True), "marked"),
        (replace(click, mark="untouched"), "guess"),
    ):
        assert states(Session(clicks=(one,)), placement(1)) == (state,)


def test_of_several_at_one_time_the_radar_position_tells(solved: Calibration):
    session = session_of(solved)
    first, second = (pair.point_radar_m for pair in solved.pairs[:2])
    found = (placement(0, second, 30), placement(0, first, 30), placement(0, first + 20.0, 30))
    of_clicks = placements_of_clicks(session, found)
    assert (of_clicks[solved.pairs[0].id], of_clicks[solved.pairs[1].id]) == (1, 0)
    waiting = replace(session, outcome=Unsolvable("no-camera"))
    assert set(placements_of_clicks(waiting, found).values()) == {-1}


@pytest.fixture(scope="module")
def solved() -> Calibration:
    drawn = simulate_pairs(20, rng=np.random.default_rng(8), noise="imaging")
    return calibrate_pairs(drawn.pairs, drawn.camera).unwrap()


def session_of(calibration: Calibration) -> Session:
    clicks = tuple(ReflectorClick(TimeNs(S), pair.id, *pair.pixel_px.tolist()) for pair in calibration.pairs)
    return Session(clicks=clicks, outcome=calibration)


def test_with_a_usable_pose_what_the_camera_does_not_see_leaves_the_list(solved: Calibration):
    session = session_of(solved)
    inside = solved.pairs[0].point_radar_m
    range_m, _, elevation = polar_from_cartesian(inside[None])[0]
    beside = range_m * np.array([np.cos(1.2), np.sin(1.2), elevation])
    found = (placement(40, inside), placement(45, beside), placement(50, -inside))
    assert states(session, *found) == ("open", "unlikely", "unlikely")
    assert (
        states(replace(session, outcome=replace(solved, covariance=1e4 * solved.covariance)), *found) == ("open",) * 3
    )
    assert states(replace(session, outcome=None), *found) == ("open",) * 3


def test_with_a_usable_pose_only_where_something_was_put_down_and_is_not_marked_is_the_list(solved: Calibration):
    session = session_of(solved)
    position = solved.pairs[0].point_radar_m
    there = solved.reproject(position[None])
    empty, elsewhere, seen = (
        Spots(pixels, 20.0) for pixels in (np.zeros((0, 2)), there + 200.0, np.vstack([there + 200.0, there]))
    )
    for spots, state in ((empty, "unlikely"), (elsewhere, "unlikely"), (seen, "open")):
        assert states(session, placement(40, position), _0=spots) == (state,)
    marked = replace(session.clicks[0], id="c99", image_time=TimeNs(41 * S))
    at_once = (placement(40, position), placement(40, position + 30.0))
    outcome = replace(solved, pairs=(*solved.pairs, replace(solved.pairs[0], id="c99", point_radar_m=position + 30.0)))
    session = replace(session, clicks=(*session.clicks, marked), outcome=outcome)
    assert states(session, *at_once, _0=seen) == ("unlikely", "marked"), "what is seen there is marked already"
