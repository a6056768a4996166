"""Which clock is used in which case, with a warning."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S
from calib_core.recordings import RecordingOptions, describe, inspect_recording, open_recording, recording_summary
from calib_core.recordings.time.clock_choice import Stamps, choose_clock, choose_clocks, header_fault
from calib_core.recordings.time.clock_diagnosis import clock_warnings, diagnose
from calib_core.recordings.topics import Rhythm

START_NS = 1_700_000_000 * NS_PER_S
YEAR_NS = 365 * 86_400 * NS_PER_S
RECEIVE_NS = START_NS + 100_000_000 * np.arange(50)


def stamps(header_ns, receive_ns=RECEIVE_NS, topic="/radar") -> Stamps:
    header = None if header_ns is None else np.asarray(header_ns, dtype=np.int64)
    return Stamps(topic, np.asarray(receive_ns, dtype=np.int64), header)


SOUND = stamps(RECEIVE_NS - 20_000_000, topic="/camera")


@pytest.mark.parametrize(
    ("header_ns", "words"),
    [
        (np.zeros(50), "has only zero stamps (50 messages)"),
        (np.full(50, START_NS), "has the same stamp in all 50 messages"),
        (np.where(np.arange(50) % 10 == 3, 0, RECEIVE_NS), "has 5 zero stamps in 50 messages"),
        (RECEIVE_NS - START_NS + 7 * NS_PER_S, "has stamps from the year 1970 (9.450 s)"),
        (RECEIVE_NS[::-1], "has 49 of 50 stamps that go backwards, by up to 0.100 s"),
        (np.where(np.arange(50) < 25, RECEIVE_NS, RECEIVE_NS - 60 * NS_PER_S), "by up to 59.900 s"),
        (None, "has no stamps"),
    ],
)
def test_stamps_that_cannot_be_right_fall_back_to_receive_time_with_a_warning(header_ns, words):
    radar = stamps(header_ns)
    fault = header_fault(radar)
    assert fault is not None
    assert words in fault
    choice = choose_clocks(radar, SOUND)
    assert choice.clocks == ("receive", "header")
    assert [warning.code for warning in choice.warnings] == ["stamps-unusable"]
    assert choice.warnings[0].facts["message"].startswith(f"/radar {fault}")
    assert choose_clocks(SOUND, radar).clocks == ("header", "receive")


def test_isolated_zeros_and_small_steps_back_do_not_disqualify_the_stamps():
    header = RECEIVE_NS.copy()
    header[30] -= 150_000_000
    assert header_fault(stamps(header)) is None
    many = START_NS + 100_000_000 * np.arange(500)
    header = many.copy()
    header[3] = 0
    assert header_fault(stamps(header, many)) is None


def test_stamps_years_from_receive_time_are_right_when_both_sensors_agree():
    radar = stamps(RECEIVE_NS - YEAR_NS)
    camera = stamps(RECEIVE_NS - YEAR_NS - 15_000_000, topic="/camera")
    choice = choose_clocks(radar, camera)
    assert (choice.clocks, choice.warnings) == (("header", "header"), ())


@pytest.mark.parametrize("radar_first", [True, False])
def test_if_one_falls_back_and_the_other_clock_is_off_by_years_both_use_receive_times(radar_first):
    zero, old = stamps(np.zeros(50)), stamps(RECEIVE_NS - YEAR_NS, topic="/camera")
    choice = choose_clocks(zero, old) if radar_first else choose_clocks(old, zero)
    assert choice.clocks == ("receive", "receive")
    assert [warning.code for warning in choice.warnings] == ["stamps-unusable", "mixed-clocks"]
    assert "by 365.0 days" in choice.warnings[1].facts["message"]


def test_two_clocks_more_than_a_second_apart_are_not_compared():
    hour = stamps(RECEIVE_NS - 3600 * NS_PER_S)
    choice = choose_clocks(hour, SOUND)
    assert choice.clocks == ("receive", "receive")
    assert "60.0 minutes apart" in choice.warnings[0].facts["message"]
    assert choose_clocks(stamps(RECEIVE_NS - 900_000_000), SOUND).clocks == ("header", "header")


LONG_NS = START_NS + 100_000_000 * np.arange(1000)


def late(by_s, of=LONG_NS):
    """Stamps that lag receive time by this much in the last two fifths."""
    return of - np.where(np.arange(1000) < 600, 0, int(by_s * NS_PER_S))


@pytest.mark.parametrize(
    ("radar_ns", "camera_ns", "clock"),
    [
        (late(-3.0), LONG_NS, "receive"),
        (LONG_NS, late(-1.5), "receive"),
        (late(-0.5), LONG_NS, "header"),
        (late(-3.0), late(-3.0), "header"),
        (LONG_NS + 1_900_000 * np.arange(1000), LONG_NS, "receive"),
        (LONG_NS + 900_000 * np.arange(1000), LONG_NS, "header"),
    ],
    ids=["radar set", "camera set", "set by little", "recorder set", "much drift", "some drift"],
)
def test_stamps_that_diverge_during_the_recording_are_not_compared(radar_ns, camera_ns, clock):
    choice = choose_clocks(stamps(radar_ns, LONG_NS), stamps(camera_ns, LONG_NS, "/camera"))
    assert choice.clocks == (clock, clock)
    told = [warning.facts["message"] for warning in choice.warnings]
    assert ("/radar and /camera diverge" in "".join(told)) == (clock == "receive")


def test_recordings_rewritten_at_different_times_are_matched_by_their_stamps():
    radar = stamps(RECEIVE_NS, RECEIVE_NS + YEAR_NS)
    assert choose_clocks(radar, SOUND).clocks == ("header", "header")


def test_simulated_time_of_both_sensors_is_kept():
    boot = RECEIVE_NS - START_NS + 60 * NS_PER_S
    choice = choose_clocks(stamps(boot), stamps(boot + 5_000_000, topic="/camera"))
    assert (choice.clocks, choice.warnings) == (("header", "header"), ())
    assert choose_clock(stamps(boot)).clocks == ("header",)


@given(
    st.lists(st.integers(-(10**6), 10**6), min_size=2, max_size=60),
    st.integers(-(10**15), 10**15),
    st.sampled_from(["header", "receive"]),
)
def test_the_requested_clock_is_used(jitter, shift, requested):
    receive = START_NS + 10**8 * np.arange(len(jitter))
    radar = stamps(receive + np.array(jitter) + shift, receive)
    choice = choose_clocks(radar, stamps(receive, receive, "/camera"), requested)
    assert (choice.clocks, choice.warnings) == ((requested, requested), ())


@given(
    st.integers(2, 60),
    st.sampled_from(["sound", "zero", "constant", "boot", "backwards"]),
    st.sampled_from(["sound", "zero", "constant", "boot", "backwards"]),
    st.integers(-(10**17), 10**17),
)
def test_times_in_use_never_differ_from_one_another_by_more_than_the_receive_times_do(
    n, radar_kind, camera_kind, shift
):
    """For any stamps, simultaneous messages get times within a second, or both sensors use receive times."""
    receive = START_NS + 10**8 * np.arange(n)

    def header(kind, extra):
        return {
            "sound": receive + extra,
            "zero": np.zeros(n),
            "constant": np.full(n, START_NS),
            "boot": receive - START_NS + 10**9,
            "backwards": receive[::-1] - 10**8 * n,
        }[kind]

    radar, camera = stamps(header(radar_kind, shift), receive), stamps(header(camera_kind, 0), receive, "/camera")
    choice = choose_clocks(radar, camera)
    times = [
        both.header_ns if clock == "header" else both.receive_ns
        for both, clock in zip((radar, camera), choice.clocks, strict=True)
    ]
    assert np.abs(np.median(times[0] - times[1])) <= NS_PER_S
    assert bool(choice.warnings) == (choice.clocks != ("header", "header"))


# -- through files
def test_zero_stamps_of_the_radar_are_replaced_with_a_warning(ros, write, plain, jpeg, cloud_points):
    rows = [
        (topic, at, ros.cloud(0, cloud_points()) if topic == "/radar/points" else message)
        for topic, at, message in plain(ros, jpeg)
    ]
    with open_recording(write(ros, rows)) as recording:
        np.testing.assert_array_equal(recording.radar_times, START_NS + 10**8 * np.arange(20) + 30_000_000)
        np.testing.assert_array_equal(recording.image_times, START_NS + 10**8 * np.arange(20) + 50_000_000)
        assert [warning.code for warning in recording.warnings] == ["stamps-unusable"]
        clocks = {topic.name: topic.clock for topic in recording.topics}
        assert (clocks["/radar/points"], clocks["/camera/image/compressed"]) == ("receive", "header")


def test_the_user_can_choose_the_clock(ros, write, plain, jpeg):
    rows = plain(ros, jpeg, radar_shift_ns=-3600 * NS_PER_S, camera_shift_ns=-3600 * NS_PER_S)
    path = write(ros, rows)
    with open_recording(path, RecordingOptions(clock="receive")) as recording:
        assert recording.radar_times[0] == START_NS + 30_000_000
    with open_recording(path, RecordingOptions(clock="header")) as recording:
        assert recording.radar_times[0] == START_NS - 3600 * NS_PER_S


def test_a_few_zero_stamps_are_filled_in_from_the_delay_of_the_others(ros1, write, plain, jpeg, cloud_points):
    rows = plain(ros1, jpeg, n=200)
    place = next(i for i, row in enumerate(rows) if row[0] == "/radar/points" and i > 100)
    at = rows[place][1]
    rows[place] = ("/radar/points", at, ros1.cloud(0, cloud_points()))
    with open_recording(write(ros1, rows)) as recording:
        assert at - 30_000_000 in recording.radar_times
        assert len(recording.radar_times) == 200


def test_types_without_stamps_cannot_use_the_header_clock(ros1, write, plain, jpeg):
    ros1.define("bare_msgs/msg/Image", "string format\nuint8[] data\n")
    rows = plain(ros1, jpeg)
    rows = [
        (
            topic,
            at,
            ros1.new("bare_msgs/msg/Image", format="jpeg", data=message.data) if "image" in topic else message,
        )
        for topic, at, message in rows
    ]
    path = write(ros1, rows)
    with open_recording(path) as recording:
        assert recording.image_times[0] == START_NS + 80_000_000
        assert "has no stamps" in recording.warnings[0].facts["message"]
    with pytest.raises(RecordingError, match=r"has no stamps; use the receive times: --clock receive"):
        open_recording(path, RecordingOptions(clock="header"))


@pytest.mark.parametrize("received_ns", [0, START_NS])
def test_equal_receive_times_are_not_preferred_to_sound_stamps(received_ns, ros, write, plain, jpeg):
    """Radar and camera with sound stamps of clocks an hour apart, and a recorder without a clock."""
    rows = [(topic, received_ns, message) for topic, _, message in plain(ros, jpeg, n=40)]
    with open_recording(write(ros, rows)) as recording:
        assert len(recording.image_times) == len(recording.radar_times) == 40
        assert recording.image_clock == recording.radar_clock == "header"
        (clocks,) = [topic.clocks for topic in recording.topics if topic.name == "/radar/points"]
    assert clocks.reason.endswith("stamps are sound")


def test_a_recorders_clock_that_was_set_back_is_not_mistaken_for_stamps_out_of_order(ros1, write, plain, jpeg):
    rows = [
        (topic, at - (10 * NS_PER_S if number >= 90 else 0), message)
        for number, (topic, at, message) in enumerate(plain(ros1, jpeg, n=60))
    ]
    with open_recording(write(ros1, rows)) as recording:
        assert recording.image_clock == recording.radar_clock == "header"
        assert [warning.code for warning in recording.warnings] == []


# The diagnosis of the two clocks of a topic.

MS = 1_000_000
LONG_RECEIVE_NS = START_NS + 100 * MS * np.arange(2000)
SOUND_NS = LONG_RECEIVE_NS - 20 * MS


def look(
    header_ns, receive_ns=LONG_RECEIVE_NS, *, chosen="header", requested="auto", times_ns=None, one_per_return=False
):
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
    assert (found.remarks, clock_warnings([found])) == ((), [])
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
    assert [warning.code for warning in clock_warnings([found])] == ([code] if code else [])


def test_islands_and_gaps_of_data_are_counted():
    times = np.concatenate([SOUND_NS[:500], SOUND_NS[500:1000] + 600 * NS_PER_S, SOUND_NS[1000:] + 4000 * NS_PER_S])
    found = look(times, times + 20 * MS)
    assert found.islands == 3
    assert found.covered_s == pytest.approx(199.7, abs=0.01)
    assert Rhythm.of(times).rate_hz == pytest.approx(10.0), "nothing happens between islands, which is no slower rate"
    assert any(remark.startswith("3 separate stretches") for remark in found.remarks)
    (warning,) = clock_warnings([found])
    assert warning.code == "islands"
    assert "up to 56.7 minutes" in warning.facts["message"]
    dropped = look(np.delete(SOUND_NS, np.s_[700:720]), np.delete(LONG_RECEIVE_NS, np.s_[700:720]))
    assert [remark.split(" ")[-2] for remark in dropped.remarks] == ["2.100"]


def test_stretches_that_both_sensors_have_are_one_warning():
    times = START_NS + np.concatenate([np.arange(20) * 10**8, 10**11 + np.arange(20) * 10**8])
    both = [
        diagnose(stamps(times, times, topic), times_ns=times, chosen="header", requested="auto")
        for topic in ("/radar", "/camera")
    ]
    (warning,) = clock_warnings(both)
    assert warning.code == "islands"
    assert warning.facts["message"].startswith("/radar and /camera ")


def test_the_reason_for_the_clock_is_given():
    assert "zero stamps (2000 messages)" in look(np.zeros(2000), chosen="receive").reason
    assert look(None, chosen="receive", times_ns=LONG_RECEIVE_NS).reason == "it has no stamps"
    assert look(SOUND_NS, chosen="receive", requested="receive").reason == "--clock receive was given"
    assert "cannot be compared" in look(SOUND_NS, chosen="receive").reason
    assert "the same clock" in look(SOUND_NS - START_NS).reason
    assert "jump or drift" in look(changed(np.s_[1000:], 5 * NS_PER_S)).reason


def test_a_driver_that_stamps_every_return_is_recognised():
    found = look(SOUND_NS, one_per_return=True)
    assert [remark.split(":")[0] for remark in found.remarks] == ["one message per return"]


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
    assert (rear.chosen, rear.clocks.chosen, rear.clocks.zero_stamps) == (False, "receive", 10)
    (line,) = (line for line in text.splitlines() if "/rear/points: not in use" in line)
    assert "receive times" in line
    assert "zero stamps (10 messages)" in line


def test_the_warnings_of_the_clocks_reach_the_recording(ros1, write, plain, jpeg):
    rows = [
        (t, at + (3600 * NS_PER_S if number > 120 else 0), m)
        for number, (t, at, m) in enumerate(plain(ros1, jpeg, n=60))
    ]
    with open_recording(write(ros1, rows)) as recording:
        codes = [warning.code for warning in recording.warnings]
    assert codes.count("clock-jumps") == 2


def test_zero_stamps_stay_zero_when_the_others_are_moved():
    receive_ns = np.arange(1, 6) * NS_PER_S + 10**18
    header_ns = np.where(np.arange(5) == 2, 0, receive_ns)
    moved = Stamps("/radar", receive_ns, header_ns).earlier(10**9)
    assert moved.header_ns is not None
    assert moved.header_ns.tolist() == [value and value - 10**9 for value in header_ns.tolist()]
