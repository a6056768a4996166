"""A recording without images: what the whole radar recording says, and what is shown at one moment."""

import numpy as np
import pytest

from calib_core.measurements import NS_PER_S, RadarScan, RadarScans, TimeNs
from calib_core.options import GatingOptions
from cocalib.web.channel.radar_survey import (
    RadarMapSum,
    placement_figures,
    placement_note,
    placement_summary,
    survey_of,
)
from cocalib.web.channel.space_feed import surveyed_extent
from cocalib.web.messages.space_messages import PlacementRow
from cocalib.web.radar_sight import RadarSight, Returns, look_of

NAN = float("nan")


def scan(time_s: float, rows: list[tuple[float, float, float, float, float]]) -> RadarScan:
    """Return a scan from rows of x, y, z [m], speed [m/s], amplitude [dB]."""
    table = np.array(rows, dtype=float).reshape(-1, 5)
    return RadarScan(
        TimeNs(round(time_s * NS_PER_S)), table[:, :3], table[:, 3], table[:, 4], np.full((len(table), 3), NAN)
    )


def recorded(reflector_db: float = 30.0) -> RadarScans:
    """Return twenty seconds at 10 Hz: a wall, somebody walking, and a reflector from 5 s to 9 s at the wall's range."""
    scans = []
    for time_s in np.arange(0, 20, 0.1):
        rows = [(6.0, 3.0, 0.0, 0.0, 15.0), (4.0, -2.0 + 0.1 * time_s, 0.0, 1.0, 25.0)]
        if 5 <= time_s <= 9:
            rows.append((6.0, -3.0, -0.3, 0.0, reflector_db))
        scans.append(scan(time_s, rows))
    return RadarScans.from_scans(scans)


class Radar:
    def radar_scans_around(self, times: list[TimeNs], half_window_s: float) -> RadarScans:
        half_ns = round(half_window_s * NS_PER_S)
        return recorded().between(TimeNs(times[0] - half_ns), TimeNs(times[0] + half_ns))


def row(lasted_s: float = 6.0, azimuth_deg: float = 10.0, snr_db: float | None = 30.0, note: str = "") -> PlacementRow:
    return PlacementRow(0.0, lasted_s, 3, 5.0, 1.0, (5.0, 0.0, 0.0), azimuth_deg, snr_db, 12.0, note)


def test_without_a_placement_the_3d_view_reaches_as_far_as_the_radar_sees():
    far = RadarScans.from_scans(
        [scan(0.1 * n, [(8.0, 0.0, 0.0, 0.0, 10.0), (180.0, 30.0, 0.0, 0.0, 10.0)]) for n in range(6)]
    )
    seen = Returns.of(far, TimeNs(0), GatingOptions(), lambda points_m: points_m)
    assert surveyed_extent(survey_of([far], far.times_ns, GatingOptions()), seen).range_m == pytest.approx(200.0)
    scans = recorded()
    assert surveyed_extent(survey_of([scans], scans.times_ns, GatingOptions()), seen).range_m < 10.0


@pytest.mark.parametrize(
    ("reflector_db", "stands_out_db", "note"), [(30.0, 15.0, ""), (13.0, -2.0, "2 dB weaker than other returns")]
)
def test_without_frames_a_placement_is_found_at_the_radars_own_moments(reflector_db, stands_out_db, note):
    scans = recorded(reflector_db)
    survey = survey_of([scans], scans.times_ns, GatingOptions())
    (found,) = survey.rows
    assert found.frame == pytest.approx(70, abs=2), "7 s, the middle, is scan 70"
    assert found.range_m == pytest.approx(np.sqrt(36 + 9 + 0.09), abs=1e-6)
    assert found.azimuth_deg == pytest.approx(-26.57, abs=0.01)
    assert found.position_radar_m == (6.0, -3.0, -0.3)
    assert (found.snr_db, found.stands_out_db, found.note) == (reflector_db, stands_out_db, note)
    assert "6.7 to 6.7 m" in survey.message.summary
    assert "27° right to 27°" in survey.message.summary


def test_a_recording_shorter_than_a_placement_is_not_searched(monkeypatch):
    monkeypatch.setattr("cocalib.web.channel.radar_survey.find_placements", None)
    scans = recorded().between(TimeNs(0), TimeNs(NS_PER_S))
    assert survey_of([scans], scans.times_ns, GatingOptions()).rows == ()


def test_the_summary_says_how_many_where_and_which_to_look_at():
    assert placement_note(2.1, None) == "lasted only 2.1 s"
    assert "4 dB above" in placement_note(6.0, 4.0)
    assert placement_note(6.0, 20.0) == ""
    rows = [row(), row(azimuth_deg=-31.2, snr_db=41.0), row(2.1, 28.4, note="lasted only 2.1 s"), row(), row()]
    summary, quiet = placement_summary(rows, 60.0), placement_summary([row(snr_db=None)] * 5, 60.0)
    parts = ("5 placements", "5.0 to 5.0 m", "31° right to 28°", "placement 2, 41 dB", "placement 3 lasted")
    assert [part for part in parts if part not in summary] == []
    assert "10° left to 10°" in quiet
    assert "strongest" not in quiet
    assert placement_summary([], 60.0).startswith("No placement found")
    assert "0.4 s long" in placement_summary([], 0.4)


def test_few_placements_are_a_warning():
    few, enough = (placement_figures([row()] * count, 7.0, 10.0)[0] for count in (3, 4))
    assert (few.value, few.level) == ("3", "warning")
    assert (enough.value, enough.level) == ("4", "good")
    assert placement_figures([], 0.0, NAN)[1].value == "–"


def test_the_map_says_how_long_something_was_where():
    total = RadarMapSum(GatingOptions())
    for start in range(0, 20, 5):
        total.add(recorded().between(TimeNs(start * NS_PER_S), TimeNs((start + 5) * NS_PER_S - 1)))
    found = total.total()
    shares = {(round(x), round(y)): share for x, y, share in zip(found.x_m, found.y_m, found.share, strict=True)}
    assert shares[(6, 3)] == 1.0
    assert shares[(6, -3)] == pytest.approx(41 / 200, abs=0.006)
    assert found.cell_m == pytest.approx(0.2)
    assert found.low_db is not None
    assert found.high_db is not None
    assert found.low_db <= 15 <= 30 <= found.high_db + 0.5


@pytest.mark.parametrize("amplitude_db", [NAN, 1.0], ids=["none", "equal"])
def test_a_radar_without_differing_amplitudes_has_a_map_without_amplitude(amplitude_db):
    total = RadarMapSum(GatingOptions())
    total.add(RadarScans.from_scans([scan(time_s, [(5.0, 0.0, 0.0, 0.0, amplitude_db)]) for time_s in range(5)]))
    found = total.total()
    assert (found.snr_db, found.low_db) == ((), None)
    assert found.share == (1.0,)


def test_returns_of_the_last_seconds_are_shown_with_their_age():
    sight, now = RadarSight(Radar()), TimeNs(6 * NS_PER_S)
    trail = sight.trail(now, 2.0)
    assert (int(trail.times_ns[0]), int(trail.times_ns[-1])) == (4 * NS_PER_S, 6 * NS_PER_S)
    look = look_of(60, now, trail, GatingOptions())
    ages = [seen.age_s for seen in look.returns]
    assert ages == sorted(ages, reverse=True)
    assert (ages[0], ages[-1]) == (2.0, 0.0)
    walker = next(seen for seen in look.returns if seen.x_m == 4.0)
    assert (walker.static, walker.doppler_mps, walker.snr_db) == (False, 1.0, 25.0)
    assert len(sight.trail(now, 0.0)) == 1, "one scan"
    seen = Returns.of(trail, now, GatingOptions(), lambda points_m: points_m)
    assert len(seen.thinned(10)) <= 10 < len(seen.thinned(1000)) == len(trail.points_radar_m)
