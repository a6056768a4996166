"""No damaged recording loses a message that can be read, by brute force or by rosbags, without a word."""

import random

import pytest

from tests.unit.recordings.containers.damage import KINDS, outcomes


@pytest.mark.parametrize("kind", KINDS)
def test_messages_that_can_be_read_are_given_or_their_loss_is_told(kind, tmp_path):
    found = list(outcomes(kind, tmp_path, random.Random(kind), 80))
    assert len(found) > 70
    assert [one for one in found if one.silent] == []
    assert any(not one.told for one in found) or "no-summary" in kind
    assert sum(one.lost == 0 for one in found) > 0.4 * len(found)


def test_the_oracles_find_what_is_there(tmp_path):
    """An oracle that finds nothing would agree with everything."""
    from tests.unit.recordings.containers.damage import read_by_rosbags, read_by_us, sound

    for kind in KINDS:
        file = sound(kind, tmp_path)
        path = tmp_path / f"copy.{kind.partition('-')[0]}"
        path.write_bytes(file.data)
        assert file.readable(file.data) == file.messages.keys()
        found, told = read_by_us(path)
        assert (found, told) == (file.messages.keys(), [])
        if kind in ("bag", "bag-bz2", "mcap", "mcap-lz4"):
            assert read_by_rosbags(path) == file.messages.keys(), kind
