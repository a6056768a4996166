"""Which topics are one radar, and which radar is used."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S, RadarScans, TimeNs
from calib_core.radar import cartesian_from_polar
from calib_core.recordings import Recording, RecordingOptions, describe, open_recording, recording_summary
from calib_core.recordings.containers.writing import CloudMessage, RecordedMessage, write_ros1_bag
from calib_core.recordings.radar.merging import Spread, merged, moments_of, spread_of
from calib_core.recordings.radar.sensors import sensor_name
from calib_core.synthetic.files import SIDE_FRAME, SIDE_TOPIC, radar_messages
from calib_core.synthetic.presets import PRESETS
from calib_core.synthetic.recording import simulate
from tests.scans import scan_of

START_NS = 1_700_000_000 * NS_PER_S
NAMES = ("x", "y", "z", "intensity", "velocity")
OTHER_RAD = -0.55


def targets(seed: int, count: int = 40, *, far_m: float = 28.0) -> np.ndarray:
    """Return ranges, azimuths and elevations (n, 3) of things that stand around."""
    rng = np.random.default_rng(seed)
    return np.column_stack(
        [rng.uniform(1.5, far_m, count), rng.uniform(-0.9, 0.9, count), rng.uniform(-0.1, 0.1, count)]
    )


def clouds(
    topic: str,
    polar: np.ndarray,
    *,
    seed: int,
    frame: str = "radar",
    rate_hz: float = 20.0,
    scans: int = 60,
    turned_rad: float = 0.0,
    names: tuple[str, ...] = NAMES,
) -> Iterable[RecordedMessage]:
    """Yield noisy scans of static things; equal seeds give equal noise."""
    rng = np.random.default_rng(seed)
    for number in range(scans):
        noisy = polar + [0.02, 0.006, 0.01] * rng.standard_normal(polar.shape)
        noisy[:, 1] += turned_rad
        columns = {
            **dict(zip("xyz", cartesian_from_polar(noisy).T, strict=True)),
            "intensity": np.full(len(polar), 20.0),
            "velocity": np.where(np.arange(len(polar)) % 9 == 8, 1.5, 0.0),
        }
        columns |= {"doppler_vel": columns["velocity"], "power": columns["intensity"]}
        stamp = TimeNs(START_NS + round(number * NS_PER_S / rate_hz))
        values = np.column_stack([columns[name] for name in names])
        yield RecordedMessage(topic, TimeNs(stamp + 2_000_000), CloudMessage(stamp, frame, names, values))


def bag(folder: Path, *streams: Iterable[RecordedMessage]) -> Path:
    messages = sorted((message for stream in streams for message in stream), key=lambda message: message.receive_time)
    return write_ros1_bag(folder / "radar.bag", messages)


def opened(path: Path, radar_topic: str | None = None) -> Recording:
    return open_recording(path, RecordingOptions(radar_topic=radar_topic), require=("radar",))


def near_and_far(everything: np.ndarray) -> tuple[Iterable[RecordedMessage], Iterable[RecordedMessage]]:
    near, far = everything[everything[:, 0] < 10.0], everything[everything[:, 0] > 5.0]
    return clouds("/radar/near", near, seed=1, rate_hz=25.0, scans=75), clouds("/radar/far", far, seed=2)


def test_near_and_far_scans_are_one_radar(tmp_path):
    everything = targets(7, 60)
    with opened(bag(tmp_path, *near_and_far(everything))) as recording:
        assert set(recording.radar_topics) == {"/radar/near", "/radar/far"}
        scans = recording.radar_scans()
        assert 75 <= len(scans) <= 77
        assert "/radar/far + /radar/near" in recording.radar_choice
        counts = np.diff(scans.first_return)
        assert np.median(counts) == pytest.approx(len(everything), abs=2)  # what both report counts once
        assert [topic.chosen for topic in recording.topics] == [True, True]
        windows = list(recording.radar_windows())
        assert np.array_equal(np.concatenate([one.points_radar_m for one in windows]), scans.points_radar_m)
        middle = TimeNs(int(scans.times_ns[40]))
        around = recording.radar_scans_around([middle], 0.5)
        assert np.array_equal(around.times_ns, scans.between(around.times_ns[0], around.times_ns[-1]).times_ns)
        assert len(around) == pytest.approx(26, abs=2)


def test_radars_that_look_elsewhere_stay_apart_although_their_frames_are_named_alike(tmp_path):
    everything = targets(8)
    path = bag(tmp_path, clouds("/a", everything, seed=1), clouds("/b", everything, seed=2, turned_rad=0.5))
    with opened(path) as recording:
        assert len(recording.radar_topics) == 1
        assert len(recording.radar_sensors) == 2
        (warning,) = recording.warnings
        assert warning.code == "several-radars"
        assert "at 20.0 Hz" in warning.facts["message"]
        assert "--radar-topic" in warning.facts["hint"]


def test_corner_radars_stay_apart_even_where_they_agree(tmp_path):
    streams = near_and_far(targets(7, 60))
    renamed = [
        [replace(message, topic=name) for message in stream]
        for stream, name in zip(streams, ("/radar_left", "/radar_right"), strict=True)
    ]
    with opened(bag(tmp_path, *renamed)) as recording:
        assert len(recording.radar_topics) == 1


def in_turn(streams: Sequence[Iterable[RecordedMessage]]) -> list[list[RecordedMessage]]:
    """Move the second topic's scans to the middle between those of the first, all of 20 Hz."""
    half = NS_PER_S // 40
    first, second = (list(stream) for stream in streams)
    moved = []
    for one in second:
        assert isinstance(one.body, CloudMessage)
        body = replace(one.body, stamp=TimeNs(one.body.stamp + half))
        moved.append(replace(one, receive_time=TimeNs(one.receive_time + half), body=body))
    return [first, moved]


def flat(message: RecordedMessage) -> RecordedMessage:
    """Report every return at the radar's height, as a radar without elevation does."""
    assert isinstance(message.body, CloudMessage)
    return replace(message, body=replace(message.body, values=message.body.values * [1.0, 1.0, 0.0, 1.0, 1.0]))


def test_topics_of_one_frame_that_alternate_in_time_are_one_radar(tmp_path):
    near, far = targets(7, 20), targets(17, 6)
    streams = in_turn([clouds("/radar/scan0", near, seed=1), clouds("/radar/scan1", far, seed=2)])
    with opened(bag(tmp_path, *streams)) as recording:
        assert set(recording.radar_topics) == {"/radar/scan0", "/radar/scan1"}
        assert "/radar/scan0 + /radar/scan1 as" in recording.radar_choice
        assert recording.warnings == ()


def test_topics_that_alternate_but_show_the_same_ranges_elsewhere_are_two_radars(tmp_path):
    everything = targets(8, 30)
    streams = in_turn([clouds("/a", everything, seed=1), clouds("/b", everything, seed=2, turned_rad=0.5)])
    with opened(bag(tmp_path, *streams)) as recording:
        assert len(recording.radar_sensors) == 2


def test_near_and_far_scans_without_elevation_are_one_radar(tmp_path):
    streams = [[flat(message) for message in stream] for stream in near_and_far(targets(7, 60))]
    with opened(bag(tmp_path, *streams)) as recording:
        assert set(recording.radar_topics) == {"/radar/near", "/radar/far"}
        assert np.median(np.diff(recording.radar_scans().first_return)) == pytest.approx(60, abs=2)


def test_other_frames_are_other_radars_unless_the_user_joins_them(tmp_path):
    near, far = near_and_far(targets(7, 60))
    moved = [replace(message, body=replace(message.body, frame_id="corner")) for message in near]
    path = bag(tmp_path, moved, far)
    with opened(path) as recording:
        assert len(recording.radar_topics) == 1
    with opened(path, "/radar/far,/radar/near") as recording:
        assert recording.radar_topics == ("/radar/far", "/radar/near")
        (warning,) = recording.warnings
        assert warning.code == "radar-frames-differ"
        assert "/radar/near has frame 'corner'" in warning.facts["message"]
        assert recording.radar_choice.endswith("as requested")


def test_one_topic_named_by_the_user_is_used_alone(tmp_path):
    with opened(bag(tmp_path, *near_and_far(targets(7, 60))), "/radar/near") as recording:
        assert recording.radar_topics == ("/radar/near",)
        assert len(recording.radar_times) == 75
        assert recording.radar_choice == ""


def test_a_radar_can_be_asked_for_by_the_name_that_info_prints(tmp_path):
    path = bag(tmp_path, *near_and_far(targets(7, 60)), clouds("/other", targets(9), seed=5))
    with opened(path) as recording:
        names = [sensor.name for sensor in recording.radar_sensors]
        assert sorted(names) == ["/other", "/radar"]
    with opened(path, "/radar") as recording:
        assert set(recording.radar_topics) == {"/radar/near", "/radar/far"}
    with pytest.raises(RecordingError, match=r"no topic /rader; radar topics: .*; radars: "):
        opened(path, "/rader")
    with pytest.raises(RecordingError, match="no topic /radar/mid; radar topics: /other, /radar/far, /radar/near"):
        opened(path, "/radar/near,/radar/mid")


def test_a_topic_with_the_same_returns_is_read_once(tmp_path):
    everything = targets(7)
    path = bag(tmp_path, clouds("/radar", everything, seed=1), clouds("/radar_copy", everything, seed=1))
    with opened(path) as recording:
        assert len(recording.radar_topics) == 1
        (sensor,) = recording.radar_sensors
        assert len(sensor.copies) == 1
        assert "the same returns as" in recording.radar_choice


def spoilt(stream: Iterable[RecordedMessage]) -> Iterable[RecordedMessage]:
    """Add returns to each scan whose numbers are none, infinite or beyond all measure."""
    rows = np.array([[np.nan] * 5, [np.inf] * 5, [3, np.nan, 0, 1, 1], [1e38] * 5, [-np.inf, 1, 2, 9, -np.inf]])
    for message in stream:
        values = np.concatenate([rows[:3], message.body.values, rows[3:]])
        yield replace(message, body=replace(message.body, values=values))


def test_numbers_that_are_none_neither_warn_nor_decide_what_belongs_together(tmp_path):
    everything, other = targets(7), targets(7)
    other[:, 1] = np.arcsin(np.clip(np.sin(other[:, 1]) + OTHER_RAD, -0.99, 0.99))
    for name, streams, topics, repeats in (
        ("near", near_and_far(targets(3, 60)), ("/radar/far", "/radar/near"), (0, 1)),
        ("same", (clouds("/radar", everything, seed=1), clouds("/copy", everything, seed=1)), ("/radar",), (0,)),
        (
            "other",
            (clouds("/radar", everything, seed=1), clouds("/radar_2", other, seed=1)),
            ("/radar", "/radar_2"),
            (0, 0),
        ),
    ):
        (tmp_path / name).mkdir()
        with opened(bag(tmp_path / name, *map(spoilt, streams))) as recording:
            (sensor,) = recording.radar_sensors
            lost = ~np.isfinite(recording.radar_scans().points_radar_m)
        assert (sensor.topics, sensor.repeats) == (topics, repeats)
        assert (lost.any(axis=1) == lost.all(axis=1)).all(), "a position is whole or none"


def test_a_stated_standard_deviation_of_zero_is_no_spread_of_zero():
    scans = replace(scans_of(((5.0, 0.0, 0.0),)), sigma_polar=np.zeros((1, 3)))
    assert (spread_of(scans).step > 0).all()


@pytest.mark.parametrize("lack", ["stamps and frame", "frame", "Doppler"])
def test_a_list_and_a_cloud_of_one_sensor_are_one_radar_and_the_better_one_is_read(tmp_path, lack):
    """Both arrive together, long after they were measured; the list has the better name."""
    everything = targets(7)
    late_ns = 130_000_000
    frame = "radar" if lack == "Doppler" else ""
    stamp = TimeNs(0) if lack == "stamps and frame" else None
    names = (*"xyz", "power") if lack == "Doppler" else NAMES
    lists = [
        replace(
            message,
            receive_time=TimeNs(message.receive_time + late_ns + 1_000_000),
            body=replace(message.body, stamp=message.body.stamp if stamp is None else stamp),
        )
        for message in clouds("/radar/scan", everything, seed=1, frame=frame, names=names)
    ]
    points = [
        replace(message, receive_time=TimeNs(message.receive_time + late_ns))
        for message in clouds("/points", everything, seed=1)
    ]
    with opened(bag(tmp_path, lists, points)) as recording:
        assert recording.radar_topics == ("/points",)
        assert recording.radar_frame == "radar"
        assert recording.radar_clock == "header"
        (sensor,) = recording.radar_sensors
        line = next(line for line in describe(recording).splitlines() if "the same returns as" in line)
        assert recording.warnings == ()
    assert sensor.copies == ("/radar/scan",)
    reason = {"stamps and frame": "no stamps and no frame", "frame": "no frame", "Doppler": "no Doppler"}[lack]
    assert f"because it has {reason}" in line


def test_a_radar_without_a_frame_that_shows_other_returns_stays_apart(tmp_path):
    path = bag(tmp_path, clouds("/a", targets(7), seed=1), clouds("/b", targets(8), seed=2, frame=""))
    with opened(path) as recording:
        assert len(recording.radar_sensors) == 2


def test_other_azimuths_of_the_same_returns_are_alternatives(tmp_path):
    everything = targets(7)
    path = bag(
        tmp_path, clouds("/radar", everything, seed=1), clouds("/radar_2", everything, seed=1, turned_rad=OTHER_RAD)
    )
    with opened(path) as recording:
        assert recording.radar_topics == ("/radar", "/radar_2")
        scans = recording.radar_scans()
    assert scans.alternative_of is not None
    assert (scans.alternative_of >= 0).mean() > 0.98
    assert _turn_between_alternatives(scans) == pytest.approx(OTHER_RAD, abs=1e-3)


def _turn_between_alternatives(scans: RadarScans) -> float:
    scan = scans.scan(5)
    azimuth = np.arctan2(scan.points_radar_m[:, 1], scan.points_radar_m[:, 0])
    turns = [np.diff(azimuth[scan.alternative_of == of])[0] for of in range(scan.alternative_of.max() + 1)]
    return float(np.median(turns))


def test_the_front_radar_is_chosen_over_a_side_radar_with_a_better_name_and_fewer_returns(tmp_path):
    front = clouds("/front/points", targets(7, 52), seed=1, frame="front")
    side = clouds("/radar_left/points", targets(8, 8), seed=2, frame="left")
    with opened(bag(tmp_path, front, side)) as recording:
        assert recording.radar_topics == ("/front/points",)
        assert recording.warnings == ()
        assert "52 returns a scan" in recording.radar_choice
        assert "/radar_left/points, frame 'left': 8" in recording.radar_choice


def test_the_times_of_a_radar_not_in_use_are_by_the_clock_that_is_named_for_it(tmp_path):
    front = clouds("/front/points", targets(7, 52), seed=1, frame="front")
    side = clouds("/radar_left/points", targets(8, 8), seed=2, frame="left")
    late_ns = (15_000_000, 35_000_000)
    messages = [
        replace(message, receive_time=TimeNs(message.receive_time + late_ns[place % 2]))
        for place, message in enumerate((*front, *side))
    ]
    with opened(bag(tmp_path, messages)) as recording:
        used, unused = (
            next(topic for topic in recording_summary(recording).topics if topic.name == name)
            for name in ("/front/points", "/radar_left/points")
        )
    assert unused.clocks.chosen == unused.clock == used.clock == "header"
    assert (unused.jitter_s, unused.start) == (used.jitter_s, used.start)


@pytest.mark.parametrize("speed", ["velocity", "doppler_vel"])
def test_a_cloud_with_doppler_is_no_lidar_whatever_its_topic_and_size(tmp_path, speed):
    names = ("x", "y", "z", "intensity", speed)
    dense = clouds("/lidar_top/points", targets(7, 5200), seed=1, scans=6, names=names)
    with opened(bag(tmp_path, dense)) as recording:
        assert [warning.code for warning in recording.warnings] == []


def test_info_shows_the_radars_with_their_figures(tmp_path):
    path = bag(tmp_path, *near_and_far(targets(7, 60)), clouds("/left", targets(8, 8), seed=2, frame="left"))
    with opened(path) as recording:
        text = describe(recording)
        summary = msgspec.to_builtins(recording_summary(recording))
    assert "radars" in text
    assert "/radar/far, /radar/near" in text
    assert list(summary["radar"]["topics"]) == ["/radar/far", "/radar/near"]
    assert summary["radar"]["choice"]
    assert [sensor["name"] for sensor in summary["sensors"]] == ["/radar", "/left"]
    assert summary["sensors"][1]["figures"]["returns_per_scan"] == 8.0


def test_info_gives_the_figures_of_a_single_radar_too(tmp_path):
    with opened(bag(tmp_path, clouds("/radar", targets(7), seed=1))) as recording:
        (sensor,) = recording_summary(recording).sensors
        assert "radars" not in describe(recording)
    assert sensor.figures.doppler
    assert sensor.figures.static_share == pytest.approx(0.9, abs=0.05)


def test_names_of_radars_are_what_their_topics_have_in_common():
    assert sensor_name(["/radar/near", "/radar/far"]) == "/radar"
    assert sensor_name(["/r_far", "/r_far_2"]) == "/r_far,/r_far_2"
    assert sensor_name(["/a/points", "/b/points"]) == "/a/points,/b/points"
    assert sensor_name(["/alone"]) == "/alone"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("preset", "topics", "alternatives"),
    [("near-far", 2, False), ("near-far-azimuths", 4, True), ("near-far-column", 2, True), ("lidar-name", 1, False)],
)
def test_simulated_radars_are_opened_as_what_they_are(tmp_path, preset, topics, alternatives):
    recording = simulate(replace(PRESETS[preset], placements=2, dwell_s=3.5, seed=5))
    path = write_ros1_bag(tmp_path / "radar.bag", radar_messages(recording, 1))
    with opened(path) as found:
        assert len(found.radar_topics) == topics
        assert [warning.code for warning in found.warnings] == []
        scans = found.radar_scans()
        assert (scans.alternative_of is not None) == alternatives


@pytest.mark.slow
def test_the_simulated_front_radar_is_chosen_over_the_side_radar(tmp_path):
    recording = simulate(replace(PRESETS["two-radars"], placements=2, dwell_s=3.5, seed=5))
    path = write_ros1_bag(tmp_path / "radar.bag", radar_messages(recording, 1))
    with opened(path) as found:
        assert found.radar_topics == ("/front/points",)
        assert SIDE_TOPIC in found.radar_choice
    with opened(path, SIDE_TOPIC) as found:
        assert found.radar_frame == SIDE_FRAME


# Scans of several topics of one radar, merged moment by moment.


SPREAD = Spread(np.array([0.1, 0.02, 0.05]), 0.1)
COARSE = Spread(np.array([0.1, 0.04, 0.05]), 0.1)
Return = tuple[float, float, float]
"""Range [m], azimuth [rad], speed [m/s]."""


def scans_of(*scans: Sequence[Return]) -> RadarScans:
    found = []
    for number, returns in enumerate(scans):
        values = np.array(returns, dtype=float).reshape(-1, 3)
        points = cartesian_from_polar(np.column_stack([values[:, :2], np.zeros(len(values))]))
        found.append(scan_of(number, points, doppler_mps=values[:, 2], snr_db=20.0))
    return RadarScans.from_scans(found)


def times(*seconds: float) -> np.ndarray:
    return np.round(np.array(seconds) * NS_PER_S).astype(np.int64)


def test_scans_within_half_a_cycle_of_the_fastest_topic_are_one_moment():
    moments = moments_of([times(0.0, 0.05, 0.10, 0.15), times(0.0, 0.04, 0.08, 0.12, 0.16)])
    assert moments.times_ns.tolist() == times(0.0, 0.04, 0.08, 0.12, 0.16).tolist()
    assert moments.scan_of.tolist() == [[0, 1, 2, -1, 3], [0, 1, 2, 3, 4]]


def test_a_constant_delay_between_two_topics_makes_no_moments_of_their_own():
    moments = moments_of([times(0.03, 0.13, 0.23), times(0.0, 0.1, 0.2)])
    assert moments.scan_of.tolist() == [[0, 1, 2], [0, 1, 2]]


def test_a_scan_too_far_from_the_others_or_second_in_its_moment_is_a_moment_of_its_own():
    moments = moments_of([times(0.0, 0.1, 0.2, 0.3), times(0.01, 0.02, 0.9)])
    assert moments.times_ns.tolist() == times(0.0, 0.02, 0.1, 0.2, 0.3, 0.9).tolist()
    assert moments.scan_of.tolist() == [[0, -1, 1, 2, 3, -1], [0, 1, -1, -1, -1, 2]]


def test_every_scan_is_in_exactly_one_moment():
    rng = np.random.default_rng(4)
    series = [np.unique(rng.integers(0, 10 * NS_PER_S, size)) for size in (90, 55, 70)]
    moments = moments_of(series)
    assert (np.diff(moments.times_ns) >= 0).all()
    for own, numbers in zip(series, moments.scan_of, strict=True):
        assert sorted(numbers[numbers >= 0].tolist()) == list(range(len(own)))


def test_a_return_that_two_topics_report_counts_once_as_the_finer_one_has_it():
    near = scans_of([(6.02, 0.11, 0.0), (3.0, -0.2, 0.0)])
    far = scans_of([(6.0, 0.10, 0.0), (15.0, 0.0, 0.0)])
    both = merged([near, far], [COARSE, SPREAD], [0, 1])
    ranges = np.linalg.norm(both.points_radar_m, axis=1)
    assert ranges == pytest.approx([6.0, 15.0, 3.0], abs=1e-6)
    assert both.alternative_of is None


@pytest.mark.parametrize("first_is_ambiguous", [False, True])
def test_the_alternatives_of_two_topics_stay_apart(first_is_ambiguous):
    alternatives = replace(scans_of([(15.0, 0.0, 0.0), (15.0, 0.5, 0.0)]), alternative_of=np.array([0, 0]))
    own = [(6.0, 0.1, 0.0), (6.0, -0.5, 0.0)] if first_is_ambiguous else [(6.0, 0.1, 0.0)]
    first = scans_of(own)
    first = replace(first, alternative_of=np.array([0, 0])) if first_is_ambiguous else first
    both = merged([first, alternatives], [SPREAD, COARSE], [0, 1])
    assert both.alternative_of is not None
    assert both.alternative_of.tolist() == ([0, 0, 1, 1] if first_is_ambiguous else [-1, 0, 0])


@pytest.mark.parametrize("other", [(6.2, 0.10, 0.0), (6.0, 0.25, 0.0), (6.0, 0.10, 0.5)])
def test_returns_in_different_bins_stay_two(other):
    both = merged([scans_of([(6.0, 0.10, 0.0)]), scans_of([other])], [SPREAD, SPREAD], [0, 1])
    assert len(both.points_radar_m) == 2


def test_two_returns_near_each_other_are_not_both_taken_for_one():
    one, two = scans_of([(6.0, 0.10, 0.0)]), scans_of([(6.01, 0.10, 0.0), (6.05, 0.11, 0.0)])
    assert len(merged([one, two], [SPREAD, SPREAD], [0, 1]).points_radar_m) == 2


def test_other_azimuths_are_alternatives_of_the_same_return_whatever_their_order():
    first = scans_of([(6.0, 0.1, 0.0), (9.0, 0.3, 0.0)], [(4.0, 0.0, 1.0)])
    second = scans_of([(9.0, -0.4, 0.0), (6.0, -0.6, 0.0)], [(4.0, 0.7, 1.0)])
    both = merged([first, second], [SPREAD, SPREAD], [0, 0])
    assert both.scan(0).alternative_of is not None
    azimuth = np.arctan2(both.points_radar_m[:, 1], both.points_radar_m[:, 0])
    assert both.alternative_of is not None
    labelled = sorted(
        (int(scan), int(of), round(float(angle), 3))
        for scan, of, angle in zip(both.scan_of_return(), both.alternative_of, azimuth, strict=True)
    )
    assert labelled == [(0, 0, -0.6), (0, 0, 0.1), (0, 1, -0.4), (0, 1, 0.3), (1, 0, 0.0), (1, 0, 0.7)]


def test_an_azimuth_given_twice_or_not_at_all_is_no_alternative():
    first = scans_of([(6.0, 0.1, 0.0), (9.0, 0.3, 0.0), (12.0, 0.0, 0.0)])
    second = scans_of([(6.0, 0.105, 0.0), (9.0, np.nan, 0.0), (12.0, 0.5, 0.0)])
    both = merged([first, second], [SPREAD, SPREAD], [0, 0])
    assert len(both.points_radar_m) == 4
    assert sorted(both.alternative_of.tolist()) == [-1, -1, 0, 0]


def test_a_return_reported_near_and_far_takes_its_alternatives_along():
    parts = [scans_of([(6.0, 0.1, 0.0)]), scans_of([(6.0, -0.5, 0.0)])]
    four = merged([*parts, *parts], [SPREAD, SPREAD, COARSE, COARSE], [0, 0, 2, 2])
    assert len(four.points_radar_m) == 2
    assert four.alternative_of.tolist() == [0, 0]


def test_the_spread_is_measured_in_the_data():
    rng = np.random.default_rng(1)
    targets = np.array([(4.0, -0.3, 0.0), (7.0, 0.2, 0.0), (11.0, 0.0, 0.0), (15.0, 0.4, 0.25)])
    noise = [0.01, 0.004, 0.0]
    scans = scans_of(*(targets + noise * rng.standard_normal((4, 3)) for _ in range(40)))
    spread = spread_of(scans)
    assert spread.step[0] == pytest.approx(0.035, rel=0.3)
    assert spread.step[1] == pytest.approx(3.5 * 0.0039, rel=0.3)
    assert spread_of(scans.between(TimeNs(0), TimeNs(0))).step[0] > 0.0
