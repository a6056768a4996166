"""Every malformed recording: how much is recovered, and the exact messages about the rest."""

import json
import os
import random
import sys
from pathlib import Path
from typing import Any

import pytest

from calib_core.errors import RecordingError
from calib_core.recordings import describe, first_image, inspect_recording
from calib_core.words.warnings import warning_remark
from tests.unit.recordings.containers.malformed import CASES, FRAMES, Kit

LOSSLESS = {
    "bag_with_a_bad_md5_elsewhere",
    "mcap_without_summary",
    "mcap_without_message_index",
    "mcap_without_chunk_index",
    "mcap_without_repeated_channels",
    "mcap_without_chunks",
    "mcap_lz4_without_message_index",
    "mcap_lz4_without_summary",
    "mcap_without_chunks_and_summary",
    "mcap_of_ros1",
    "mcap_of_no_profile",
    "mcap_without_definitions",
    "db3_without_metadata",
    "db3_without_definitions",
    "db3_with_a_log_left_over",
    "db3_with_metadata_that_is_no_yaml",
}
"""Unusual recordings that are read without losses and without warnings."""

EXPECTED: dict[str, list[Any]] = json.loads(Path(__file__).with_name("malformed_expected.json").read_text())
"""Number of scans, number of images, and all messages: warnings, topic problems, or the error."""


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_complete_messages_are_recovered_losses_are_reported_and_a_first_image_is_complete_or_none(
    name, tmp_path, jpeg
):
    path = CASES[name](Kit(tmp_path, jpeg))
    scans = images = 0
    first = first_image([path])
    assert first is None or first.data == jpeg
    try:
        with inspect_recording(path) as recording:
            scans = len(recording.radar_scans())
            images = sum(_image(recording, index) == jpeg for index in range(len(recording.image_times)))
            said = [f"{warning.code}: {warning_remark(warning).message}" for warning in recording.warnings]
            said += [t.problem for t in recording.topics if t.problem and t.problem != "no messages"]
    except RecordingError as error:
        said = [str(error)]
    assert [scans, images, [text.replace(str(tmp_path), "FOLDER") for text in said]] == EXPECTED[name]


def _image(recording, index):
    try:
        return recording.image_bytes(index).data
    except RecordingError:
        return b""


def test_there_is_no_silent_loss():
    assert len(CASES) >= 45
    assert CASES.keys() == EXPECTED.keys()
    for name, (scans, images, said) in EXPECTED.items():
        if (scans, images) != (FRAMES, FRAMES):
            assert said, name
        assert bool(said) != (name in LOSSLESS), name


FUZZED = (
    "bag_never_closed",
    "bag_lz4_never_closed",
    "mcap_without_summary",
    "mcap_without_message_index",
    "db3_without_metadata",
)
NUMBERS = (b"\xff\xff\xff\x7f", b"\xff\xff\xff\xff", b"\0\0\0\0", b"\x01\0\0\x40", b"\0\0\0\x10")


@pytest.mark.slow
@pytest.mark.parametrize("name", FUZZED)
def test_hostile_heads_lengths_and_offsets_never_crash_hang_or_eat_memory(name, tmp_path, jpeg):
    raw = CASES[name](Kit(tmp_path, jpeg)).read_bytes()
    rng = random.Random(name)
    before_kib = _peak_kib()
    for number in range(60):
        data = bytearray(raw)
        for _ in range(rng.choice((1, 1, 2, 5))):
            place = rng.choice((rng.randrange(200), rng.randrange(len(data)), len(data) - rng.randrange(1, 500)))
            data[place : place + 4] = rng.choice((*NUMBERS, rng.randbytes(4)))
        if number % 5 == 0:
            del data[rng.randrange(len(data)) :]
        elif number % 7 == 0:
            place = rng.randrange(len(data))
            data[place:place] = data[: rng.randrange(3000)]
        path = tmp_path / f"fuzzed{number}"
        path.write_bytes(data)
        _read_everything(path)
    assert _peak_kib() - before_kib < 300 * 1024


def _read_everything(path):
    """Read everything; only RecordingError may be raised."""
    try:
        with inspect_recording(path) as recording:
            recording.radar_scans()
            describe(recording)
            for index in range(len(recording.image_times)):
                _image(recording, index)
    except RecordingError as error:
        assert len(str(error)) > 40  # noqa: PT017


def _peak_kib() -> int:
    """Return the peak memory use of this process [KiB]; 0 if unknown."""
    if sys.platform == "win32":
        return 0
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak // 1024 if os.uname().sysname == "Darwin" else peak
