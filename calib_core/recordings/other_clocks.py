"""Clocks of usable topics that are not in use: other radars and cameras."""

from dataclasses import replace

import numpy as np

from calib_core.errors import RecordingError
from calib_core.measurements import Stamp, TimeNs
from calib_core.recordings.radar.message_layouts.single_returns import PointLayout, first_of_scans
from calib_core.recordings.recording import Recording
from calib_core.recordings.stamping import StampedTopic, read_stamps
from calib_core.recordings.time.clock_choice import choose_clock
from calib_core.recordings.time.clock_diagnosis import diagnose
from calib_core.recordings.topics import Rhythm, TopicSummary, join_topics
from calib_core.recordings.usages import usage_of

_STAMP_BYTES = 12
_KINDS = ("radar", "image")


def with_other_clocks(recording: Recording) -> tuple[TopicSummary, ...]:
    """Return all topics; the times of usable ones that are not in use are by the clock that would be chosen for them.

    Their stamps are read in one pass. Topics whose messages cannot be read are left as they are.
    """
    spare = {
        topic.name: topic
        for topic in recording.topics
        if topic.clocks is None and topic.kind in _KINDS and topic.problem is None and topic.count
    }
    topics = [topic for topic in join_topics(recording.sources)[0] if topic.name in spare] if spare else []
    try:
        stamped = read_stamps([(topic, _STAMP_BYTES) for topic in topics])
    except RecordingError:
        return recording.topics
    timed = {both.topic.name: _timed(spare[both.topic.name], both) for both in stamped if len(both.topic)}
    return tuple(timed.get(topic.name, topic) for topic in recording.topics)


def _timed(topic: TopicSummary, both: StampedTopic) -> TopicSummary:
    usage = usage_of(both.topic)
    one_per_return = isinstance(usage.radar, PointLayout)
    stamps = both.clocks(usage.distinct_times)
    clock = choose_clock(stamps).clocks[0]
    times = both.header_ns if clock == "header" and both.header_ns is not None else both.topic.receive_ns
    scans = np.sort(times[first_of_scans(times)] if one_per_return else times)
    rhythm = Rhythm.of(times)
    return replace(
        topic,
        start=Stamp.of(TimeNs(int(times.min()))),
        end=Stamp.of(TimeNs(int(times.max()))),
        clock=clock,
        rate_hz=rhythm.rate_hz,
        longest_gap_s=rhythm.longest_gap_s,
        jitter_s=rhythm.jitter_s,
        clocks=diagnose(stamps, times_ns=scans, chosen=clock, requested="auto", one_per_return=one_per_return),
    )
