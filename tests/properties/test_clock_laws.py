"""Laws of the choice between stamps and receive times, for clocks with every kind of fault."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from calib_core.measurements import NS_PER_S
from calib_core.recordings.time.clock_choice import (
    Stamps,
    choose_clock,
    choose_clocks,
    distinct_times,
    header_fault,
    receive_fault,
)

START_NS = 1_700_000_000 * NS_PER_S
PERIOD_NS = 50_000_000
KINDS = (
    "sound", "zero", "constant", "boot", "far-future", "backwards", "set-back", "some-zero", "coarse", "pairs", "slow",
)  # fmt: skip
SHARES = {"receive": 0.9, "header": 0.5}
"""Least share of the other clock's times: stamps may repeat, because an image that is sent twice is one image."""


def clock(kind: str, count: int, shift_ns: int) -> np.ndarray:
    """Return (count,) times of a clock with one fault, in the order written."""
    sound = START_NS + shift_ns + PERIOD_NS * np.arange(count)
    ticks = PERIOD_NS * np.arange(count)
    return {
        "sound": sound,
        "zero": np.zeros(count, dtype=np.int64),
        "constant": np.full(count, START_NS + shift_ns),
        "boot": 12 * NS_PER_S + ticks,
        "far-future": 4_200_000_000 * NS_PER_S + ticks,
        "backwards": sound[::-1],
        "set-back": np.where(np.arange(count) < count // 2, sound, sound - 30 * NS_PER_S),
        "some-zero": np.where(np.arange(count) % 5 == 2, 0, sound),
        "coarse": sound // NS_PER_S * NS_PER_S,
        "pairs": sound[np.arange(count) // 2 * 2],
        "slow": START_NS + shift_ns + ticks // 3,
    }[kind].astype(np.int64)


def topic(name: str, header: str | None, receive: str, count: int, shift_ns: int) -> Stamps:
    """Return both clocks in the order received, as a reader gives them."""
    received = clock(receive, count, 0)
    order = np.argsort(received, kind="stable")
    stamps = None if header is None else clock(header, count, shift_ns)[order]
    return Stamps(name, received[order], stamps, written=np.argsort(order))


TOPICS = st.tuples(
    st.one_of(st.none(), st.sampled_from(KINDS)),
    st.sampled_from(KINDS),
    st.integers(2, 120),
    st.sampled_from([0, -20_000_000, 3 * NS_PER_S, -3600 * NS_PER_S]),
)


def never_worse(stamps: Stamps, chosen: str) -> None:
    times = {"header": stamps.header_ns, "receive": stamps.receive_ns}
    used = times.pop(chosen)
    (other,) = times.values()
    assert used is not None
    faults = {"header": header_fault(stamps), "receive": receive_fault(stamps)}
    (unused,) = faults.keys() - {chosen}
    if other is not None and faults[unused] is None:
        assert distinct_times(used) >= SHARES[chosen] * distinct_times(other)


@given(TOPICS)
def test_the_clock_of_one_topic_never_has_fewer_times_than_the_other_if_that_is_sound(drawn):
    stamps = topic("/radar", *drawn)
    never_worse(stamps, choose_clock(stamps).clocks[0])


@given(TOPICS, TOPICS)
def test_the_clocks_of_both_topics_never_have_fewer_times_than_the_others_if_those_are_sound(radar, camera):
    both = (topic("/radar", *radar), topic("/camera", *camera))
    for stamps, chosen in zip(both, choose_clocks(*both).clocks, strict=True):
        never_worse(stamps, chosen)


@given(st.sampled_from(KINDS), st.sampled_from(KINDS), st.integers(40, 200))
def test_sound_stamps_are_used_whatever_the_recorder_wrote(radar_receive, camera_receive, count):
    radar = topic("/radar", "sound", radar_receive, count, -10_000_000)
    camera = topic("/camera", "sound", camera_receive, count, -25_000_000)
    if receive_fault(radar) or receive_fault(camera):
        choice = choose_clocks(radar, camera)
        assert (choice.clocks, choice.warnings) == (("header", "header"), ())


@given(st.sampled_from(["zero", "constant", "far-future", "some-zero", "coarse"]), st.integers(60, 200))
def test_sound_receive_times_replace_stamps_that_cannot_be_right_with_a_warning(kind, count):
    stamps = topic("/camera", kind, "sound", count, 0)
    choice = choose_clock(stamps)
    assert choice.clocks == ("receive",)
    assert [warning.code for warning in choice.warnings] == ["stamps-unusable"]
