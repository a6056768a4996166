"""`cocalib info --verify`: every message of a recording is read, and every loss is told."""

import gzip
import json
import random

import cv2
import numpy as np
import pytest

from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S
from calib_core.recordings import inspect_recording, verification_text, verify_recording
from cocalib.cli import run
from tests.unit.recordings.conftest import altered
from tests.unit.recordings.containers.damage import KINDS, damaged, read_by_us, records, sound

START_NS = 1_700_000_000 * NS_PER_S


def verified(path):
    with inspect_recording(path) as recording:
        return verify_recording(recording)


def counts(found, topic):
    (one,) = [one for one in found.topics if one.topic == topic]
    return one.read, one.unread, one.damaged, one.undecodable


@pytest.mark.parametrize("kind", KINDS)
def test_a_sound_file_is_read_whole(kind, tmp_path):
    file = sound(kind, tmp_path)
    path = tmp_path / f"copy.{kind.partition('-')[0]}"
    path.write_bytes(file.data)
    found = verified(path)
    assert found.sound
    assert [counts(found, topic) for topic in ("/radar/points", "/rear/points")] == [(15, 0, 0, 0)] * 2
    (one,) = found.files
    assert one.size_bytes == len(file.data)
    assert "result    sound" in verification_text(found)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_no_file_that_lost_a_message_is_called_sound(kind, tmp_path):
    file = sound(kind, tmp_path)
    path = tmp_path / f"damaged.{kind.partition('-')[0]}"
    opened = unsound = 0
    for way, data in damaged(file, random.Random("verify " + kind), 24):
        path.write_bytes(data)
        try:
            found = verified(path)
        except RecordingError:
            continue
        opened += 1
        given, _ = read_by_us(path)
        if file.readable(data) - given:
            assert not found.sound, way
        unsound += not found.sound
    assert opened > 8
    assert unsound > 4


def test_a_chunk_that_no_index_names_is_found(tmp_path):
    """Its messages are recovered by opening, and the file is not called sound."""
    file = sound("mcap", tmp_path)
    begin, end = next(place for place in records("mcap", file.data) if file.data[place[0]] == 8)
    data = file.data[:begin] + file.data[end:]
    path = tmp_path / "copy.mcap"
    path.write_bytes(data)
    found = verified(path)
    assert counts(found, "/radar/points")[0] + counts(found, "/rear/points")[0] == 30
    assert [warning.code for warning in found.warnings if warning.code == "not-closed"]
    assert not found.sound


def test_rows_that_are_absent_are_told(tmp_path):
    file = sound("db3", tmp_path)
    path = tmp_path / "copy.db3"
    path.write_bytes(file.data)
    found = verified(altered(path, "DELETE FROM messages WHERE id BETWEEN 11 AND 13"))
    assert not found.sound
    assert any("(11 to 13)" in warning.message for warning in found.warnings)


def images(ros, jpeg, others):
    rows = [("/camera/image", START_NS + i * 10**8, ros.compressed(START_NS + i * 10**8, jpeg)) for i in range(8)]
    return rows + [
        ("/camera/image", START_NS + i * 10**8, ros.compressed(START_NS + i * 10**8, other))
        for i, other in enumerate(others, start=8)
    ]


def big_jpeg() -> bytes:
    pixels = np.random.default_rng(5).integers(0, 255, (240, 320, 3), dtype=np.uint8)
    return bytes(cv2.imencode(".jpg", cv2.GaussianBlur(pixels, (5, 5), 0))[1].tobytes())


def test_images_that_are_cut_or_none_are_undecodable(ros, write):
    jpeg = big_jpeg()
    path = write(ros, images(ros, jpeg, [jpeg[: len(jpeg) // 2], b"not an image at all", b""]))
    found = verified(path)
    assert counts(found, "/camera/image") == (8, 0, 0, 3)
    assert not found.sound


def test_a_png_with_a_wrong_checksum_is_found_without_decoding_it(ros, write):
    png = bytes(cv2.imencode(".png", np.full((24, 32, 3), 90, np.uint8))[1])
    path = write(ros, images(ros, png, [png[:50] + b"?" + png[51:], png[:60] + png[63:]]))
    found = verified(path)
    assert counts(found, "/camera/image") == (8, 0, 0, 2)
    assert "damaged after byte 33" in found.topics[0].fault


def test_a_driver_that_writes_no_end_markers_is_not_blamed(ros, write, jpeg):
    found = verified(write(ros, images(ros, jpeg[:-2], [jpeg[:-2]])))
    assert counts(found, "/camera/image") == (9, 0, 0, 0)
    assert found.sound


def test_types_that_are_not_supported_are_unread(ros1, write, jpeg):
    path = write(ros1, [("/camera/qoi", START_NS, ros1.compressed(START_NS, b"qoif" + bytes(30), "qoi"))])
    found = verified(path)
    assert counts(found, "/camera/qoi") == (0, 1, 0, 0)
    assert found.sound


def test_a_folder_names_the_images_that_cannot_be_read(tmp_path, jpeg):
    folder = tmp_path / "front"
    folder.mkdir()
    for number in range(4):
        (folder / f"{START_NS + number * 10**8}.jpg").write_bytes(jpeg if number != 2 else b"nothing of the kind")
    (folder / "notes.md").write_text("a test")
    found = verified(folder)
    assert counts(found, "/front/image") == (3, 0, 1, 0)
    assert not found.sound


def test_a_compressed_file_is_verified_as_decompressed(tmp_path):
    file = sound("bag", tmp_path)
    path = tmp_path / "copy.bag.gz"
    packed = gzip.compress(file.data)
    path.write_bytes(packed)
    found = verified(path)
    assert (found.sound, found.files[0].size_bytes) == (True, len(file.data))
    path.write_bytes(packed[: len(packed) * 2 // 3])
    assert not verified(path).sound


def test_the_command_exits_with_1_for_damage_and_2_for_what_cannot_be_read(tmp_path, capsys):
    file = sound("bag", tmp_path)
    path = tmp_path / "copy.bag"
    path.write_bytes(file.data)
    assert run(["info", "--verify", str(path)]) == 0
    assert "result    sound" in capsys.readouterr().out
    path.write_bytes(file.data[: len(file.data) // 2])
    assert run(["info", "--verify", "--json", str(path)]) == 1
    found = json.loads(capsys.readouterr().out)
    assert found["sound"] is False
    assert found["files"][0]["size_bytes"] == len(file.data) // 2
    path.write_bytes(b"")
    assert run(["info", "--verify", str(path)]) == 2
