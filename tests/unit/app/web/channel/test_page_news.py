"""What is sent to a page: the newest of each kind, in order, and never more than it can read."""

import asyncio
import logging

import numpy as np
import pytest

from calib_core.measurements import RadarScan, RadarScans, TimeNs
from calib_core.options import GatingOptions
from cocalib.session.state import Session
from cocalib.web.channel.outbox import NewestWins, Outbox
from cocalib.web.channel.radar_survey import placements_at, survey_of
from cocalib.web.radar_sight import RadarSight, overlay_of


def delivered(outbox: Outbox, count: int) -> list[str | bytes]:
    got: list[str | bytes] = []

    async def take(message: str | bytes) -> None:
        got.append(message)
        if len(got) == count:
            raise EOFError

    with pytest.raises(EOFError):
        asyncio.run(outbox.deliver(take))
    return got


def test_of_one_kind_only_the_newest_is_sent_and_answers_are_all_sent():
    outbox = Outbox()
    for message in ("view 1", "done 1", "view 2", "frame 1", "done 2", "frame 2"):
        kind = message.split()[0]
        outbox.put(message, kind=None if kind == "done" else kind)
    assert delivered(outbox, 4) == ["done 1", "view 2", "done 2", "frame 2"]


def test_a_change_is_shown_before_it_is_confirmed_also_if_a_newer_one_comes_while_both_wait():
    outbox, newest = Outbox(), ["view 1"]
    outbox.put(lambda: newest[0], kind="view")
    outbox.put("done 1")
    newest[0] = "view 2"
    outbox.put(lambda: newest[0], kind="view")
    assert delivered(outbox, 2) == ["view 2", "done 1"]


def test_a_page_that_reads_nothing_is_given_up():
    outbox = Outbox()
    for number in range(2001):
        outbox.put(f"done {number}")

    async def never(message: str | bytes) -> None:
        await asyncio.Event().wait()

    with pytest.raises(BufferError, match="2001"):
        asyncio.run(outbox.deliver(never))


def test_of_the_waiting_work_only_the_newest_is_done_and_work_that_fails_is_logged(caplog):
    worked: list[int] = []

    async def run() -> None:
        going, ended = asyncio.Event(), asyncio.Event()

        async def work(item: int) -> None:
            worked.append(item)
            await going.wait()
            if item == 4:
                worker.give(5)
                raise ZeroDivisionError("bad work")
            if item == 5:
                ended.set()

        worker = NewestWins(work)
        worker.give(1)
        await asyncio.sleep(0)
        for item in (2, 3, 4):
            worker.give(item)
        going.set()
        await ended.wait()

    with caplog.at_level(logging.ERROR):
        asyncio.run(run())
    assert worked == [1, 4, 5]
    assert "bad work" in caplog.text


def scan(time_s: float, points: list[list[float]]) -> RadarScan:
    rows = np.array(points, dtype=float).reshape(-1, 3)
    return RadarScan(
        TimeNs(int(time_s * 1e9)), rows, np.zeros(len(rows)), np.full(len(rows), 20.0), np.full((len(rows), 3), np.nan)
    )


def recorded() -> RadarScans:
    """Return ten seconds at 10 Hz: a pole that is always there, and a reflector from 3 s to 7 s."""
    generator = np.random.default_rng(1)
    scans = []
    for time_s in np.arange(0, 10, 0.1):
        points = [generator.normal([12.0, 3.0, 0.0], 0.01)]
        if 3 <= time_s <= 7:
            points.append(generator.normal([6.0, -1.0, -0.3], 0.01))
        scans.append(scan(time_s, [list(point) for point in points]))
    return RadarScans.from_scans(scans)


def test_the_survey_finds_the_reflector_and_a_frame_to_click_in_and_counts_returns_per_scan():
    image_times = (np.arange(0, 10, 0.7) * 1e9).astype(np.int64)
    survey = survey_of([recorded()], image_times, GatingOptions())
    [row] = survey.rows
    assert row.range_m == pytest.approx(np.sqrt(36 + 1 + 0.09), abs=0.05)
    assert (row.start_s, row.end_s) == pytest.approx((3, 7), abs=0.3)
    assert row.frame == 7, "4.9 s is nearest to the middle"
    assert placements_at(survey, int(5e9)) == [survey.placements[0]]
    assert placements_at(survey, int(1e9)) == []
    assert placements_at(None, int(5e9)) == ()
    activity = survey.activity
    assert (activity.returns[0], activity.returns[int(5 / activity.step_s)]) == (1, 2)
    assert len(activity.returns) * activity.step_s == pytest.approx(9.8, abs=activity.step_s)


def test_a_placement_that_no_frame_shows_is_not_offered_and_a_survey_of_no_radar_is_empty():
    assert survey_of([recorded()], np.array([0, int(9.9e9)]), GatingOptions()).rows == ()
    survey = survey_of([], np.array([0, int(1e9)], dtype=np.int64), GatingOptions())
    assert survey.rows == ()
    assert set(survey.activity.returns) == {0.0}


def test_a_survey_in_windows_and_in_stretches_finds_the_same(monkeypatch):
    image_times = (np.arange(0, 10, 0.7) * 1e9).astype(np.int64)
    whole, scans = survey_of([recorded()], image_times, GatingOptions()), recorded()
    windows = [scans.between(TimeNs(int(s * 1e9)), TimeNs(int((s + 1) * 1e9) - 1)) for s in range(10)]
    assert survey_of(windows, image_times, GatingOptions()).rows == whole.rows
    assert survey_of(windows, image_times, GatingOptions()).activity == whole.activity
    monkeypatch.setattr("calib_core.association.placements.MOST_STATIC_RETURNS", 128)  # 9 s of 10
    in_stretches = survey_of(windows, image_times, GatingOptions())
    assert [row.frame for row in in_stretches.rows] == [row.frame for row in whole.rows]
    assert in_stretches.activity == whole.activity


class Radar:
    def radar_scans_around(self, times: list[TimeNs], half_window_s: float) -> RadarScans:
        low, high = times[0] - int(half_window_s * 1e9), times[0] + int(half_window_s * 1e9)
        return recorded().between(TimeNs(low), TimeNs(high))


def test_the_scan_of_a_frame_is_the_nearest_one_and_none_when_none_is_near():
    sight = RadarSight(Radar())
    found = sight.scan_at(TimeNs(int(4.96e9)))
    assert found.time == pytest.approx(5.0e9, abs=1e3)
    assert len(found) == 2
    assert sight.scan_at(TimeNs(int(60e9))) is None


def test_without_a_calibration_nothing_is_projected_into_the_image():
    overlay = overlay_of(3, Session(), scan(0, [[5, 0, 0]]), ())
    assert overlay.returns is None
    assert overlay.guesses == ()
