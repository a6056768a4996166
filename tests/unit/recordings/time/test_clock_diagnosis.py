"""The diagnosis of the two clocks of a topic."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from calib_core.measurements import NS_PER_S
from calib_core.recordings import describe, inspect_recording, open_recording, recording_summary
from calib_core.recordings.time.clock_choice import Stamps
from calib_core.recordings.time.clock_diagnosis import about_clocks, diagnose
from calib_core.recordings.topics import Rhythm

START_NS = 1_700_000_000 * NS_PER_S
MS = 1_000_000
RECEIVE_NS = START_NS + 100 * MS * np.arange(2000)
SOUND_NS = RECEIVE_NS - 20 * MS


def look(header_ns, receive_ns=RECEIVE_NS, *, chosen="header", requested="auto", times_ns=None, one_per_return=False):
    header = None if header_ns is None else np.asarray(header_ns, dtype=np.int64)
    times = np.sort(header if chosen == "header" else receive_ns) if times_ns is None else times_ns
    stamps = Stamps("/radar", np.asarray(receive_ns, dtype=np.int64), header)
    return diagnose(stamps, times_ns=times, chosen=chosen, requested=requested, one_per_return=one_per_return)


def changed(where, by_ns):
    header = SOUND_NS.copy()
    header[where] += by_ns
    return header


def test_sound_clocks_give_no_remarks():
    found = look(SOUND_NS)
    assert (found.remarks, about_clocks([found])) == ((), [])
    assert (found.reason, found.messages, found.islands, found.gaps) == ("the stamps are sound", 2000, 1, 0)
    assert found.delay_s == pytest.approx(0.02)
    assert found.period_s == pytest.approx(0.1)
    assert found.drift_s == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("header_ns", "remark", "code"),
    [
        (np.where(np.arange(2000) % 500 == 7, 0, SOUND_NS), "4 of 2000 stamps are zero", None),
        (changed(np.s_[100:103], -300 * MS), "1 stamp goes backwards, by up to 0.200 s", None),
        (changed([50], -100 * MS), "1 stamp repeats the previous one", None),
        (changed(np.s_[1000:], 5 * NS_PER_S), "the delay jumps 1 time by up to 5.000 s", "clock-jumps"),
        (SOUND_NS + np.arange(2000) * 10_000, "the stamps drift by 20 ms (100 ppm)", None),
        (SOUND_NS + np.arange(2000) * 50_000, "the stamps drift by 99 ms (500 ppm)", "clock-drift"),
        (SOUND_NS - START_NS + 60 * NS_PER_S, "the stamps count from the start of a device, not from 1970", None),
    ],
)
def test_irregular_stamps_give_remarks(header_ns, remark, code):
    found = look(header_ns, times_ns=np.sort(header_ns[header_ns != 0]))
    small = "20 ms" in remark
    assert (remark in found.remarks) != small
    assert [warning.code for warning in about_clocks([found])] == ([code] if code else [])


def test_islands_and_gaps_of_data_are_counted():
    times = np.concatenate([SOUND_NS[:500], SOUND_NS[500:1000] + 600 * NS_PER_S, SOUND_NS[1000:] + 4000 * NS_PER_S])
    found = look(times, times + 20 * MS)
    assert found.islands == 3
    assert found.covered_s == pytest.approx(199.7, abs=0.01)
    assert Rhythm.of(times).rate_hz == pytest.approx(10.0), "nothing happens between islands, which is no slower rate"
    assert "3 separate stretches of data, 3.3 minutes in total" in found.remarks
    (warning,) = about_clocks([found])
    assert warning.code == "islands"
    assert "separated by up to 56.7 minutes" in warning.message
    dropped = look(np.delete(SOUND_NS, np.s_[700:720]), np.delete(RECEIVE_NS, np.s_[700:720]))
    assert dropped.remarks == ("1 gap, the longest 2.100 s",)


def test_the_reason_for_the_clock_is_given():
    assert look(np.zeros(2000), chosen="receive").reason == "it has only zero stamps (2000 messages)"
    assert look(None, chosen="receive", times_ns=RECEIVE_NS).reason == "it has no stamps"
    assert look(SOUND_NS, chosen="receive", requested="receive").reason == "--clock receive was given"
    assert "cannot be compared" in look(SOUND_NS, chosen="receive").reason
    assert "both sensors use the same clock" in look(SOUND_NS - START_NS).reason
    assert "jump or drift relative to the receive times" in look(changed(np.s_[1000:], 5 * NS_PER_S)).reason


def test_a_driver_that_stamps_every_return_is_recognised():
    found = look(SOUND_NS, one_per_return=True)
    assert found.remarks == ("one message per return: stamps differ within a scan",)


@given(st.lists(st.integers(-(2**62), 2**62), max_size=80), st.sampled_from(["header", "receive"]))
def test_any_stamps_can_be_diagnosed(header, chosen):
    receive = START_NS + 100 * MS * np.arange(len(header))
    found = look(header, receive, chosen=chosen)
    assert found.messages == len(header)
    assert all(found.remarks)


def test_clocks_of_sensors_that_are_not_in_use_are_shown_too(ros, write, plain, jpeg, cloud_points):
    rows = plain(ros, jpeg)
    rows += [("/rear/points", at + 5 * MS, ros.cloud(0, cloud_points(3))) for at in SOUND_NS[:10].tolist()]
    with inspect_recording(write(ros, sorted(rows, key=lambda row: row[1]))) as recording:
        text = describe(recording)
        (rear,) = [topic for topic in recording_summary(recording).topics if topic.name == "/rear/points"]
    assert rear.clocks is not None
    assert (rear.chosen, rear.clocks.chosen, rear.clocks.zero_stamps) == (False, "receive", 10)
    assert (
        "/rear/points: not in use; times are the recorder's receive times, because it has only zero stamps (10 messages)"
        in text
    )


def test_the_warnings_of_the_clocks_reach_the_recording(ros1, write, plain, jpeg):
    rows = [
        (t, at + (3600 * NS_PER_S if number > 120 else 0), m)
        for number, (t, at, m) in enumerate(plain(ros1, jpeg, n=60))
    ]
    with open_recording(write(ros1, rows)) as recording:
        codes = [warning.code for warning in recording.warnings]
    assert codes.count("clock-jumps") == 2
