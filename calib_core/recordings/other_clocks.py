"""Clock diagnoses of usable topics that are not in use: other radars and cameras."""

from collections.abc import Mapping

import numpy as np

from calib_core.errors import RecordingError
from calib_core.recordings.radar.single_returns import PointLayout, first_of_scans
from calib_core.recordings.recording import Recording
from calib_core.recordings.stamping import StampedTopic, read_stamps
from calib_core.recordings.time.clock_choice import choose_clock
from calib_core.recordings.time.clock_diagnosis import ClockDiagnosis, diagnose
from calib_core.recordings.topics import join_topics
from calib_core.recordings.usages import usage_of

__all__ = ["other_clocks"]

_STAMP_BYTES = 12
_KINDS = ("radar", "image")


def other_clocks(recording: Recording) -> Mapping[str, ClockDiagnosis]:
    """Diagnose the clocks of all other usable topics, reading their stamps in one pass.

    Topics whose messages cannot be read are skipped.
    """
    spare = {
        topic.name
        for topic in recording.topics
        if topic.clocks is None and topic.kind in _KINDS and topic.problem is None and topic.count
    }
    topics = [topic for topic in join_topics(recording.sources)[0] if topic.name in spare] if spare else []
    try:
        stamped = read_stamps([(topic, _STAMP_BYTES) for topic in topics])
    except RecordingError:
        return {}
    return {both.topic.name: _diagnosis(both) for both in stamped if len(both.topic)}


def _diagnosis(both: StampedTopic) -> ClockDiagnosis:
    usage = usage_of(both.topic)
    one_per_return = isinstance(usage.radar, PointLayout)
    stamps = both.clocks(usage.distinct_times)
    clock = choose_clock(stamps).clocks[0]
    times = both.header_ns if clock == "header" and both.header_ns is not None else both.topic.receive_ns
    times = np.sort(times[first_of_scans(times)] if one_per_return else times)
    return diagnose(stamps, times_ns=times, chosen=clock, requested="auto", one_per_return=one_per_return)
