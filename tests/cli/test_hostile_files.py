"""Files that are not what they seem: pipes, devices, deep nesting, halves of characters, names that are not UTF-8."""

import json
import os
import re
import socket
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from calib_core import input_files
from calib_core.recordings.containers.writing import RecordedMessage, write_ros2
from tests.cli.conftest import Made

POSIX = pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX files")
INPUTS = {
    "info": ["info", "{}"],
    "open": ["open", "{}", "--no-browser"],
    "video": ["show", "{}", "--out", "v.mp4"],
    "overlay": ["show", "{}", "--calibration", "absent.json", "--out", "v.mp4"],
    "clicks": ["solve", "absent.bag", "--clicks", "{}"],
    "pairs": ["solve", "--pairs", "{}"],
    "check": ["check", "{}"],
    "import": ["import", "{}", "--out", "c.json"],
    "export": ["export", "{}", "--to", "tf2"],
}


def one_line(answer: Any) -> str:
    assert answer.code == 2, answer
    (line,) = answer.err.splitlines()
    assert line.startswith("cocalib: ")
    assert "internal error" not in line
    return str(line)


@POSIX
@pytest.mark.parametrize("arguments", INPUTS.values(), ids=INPUTS)
@pytest.mark.parametrize("kind", ["pipe", "device", "socket"])
def test_what_could_never_end_is_refused_at_once(cocalib, tmp_path, monkeypatch, arguments, kind):
    monkeypatch.setattr(input_files, "_WRITER_TIMEOUT_S", 0.02)
    path = Path("/dev/zero") if kind == "device" else tmp_path / "input"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "socket":
        with socket.socket(socket.AF_UNIX) as bound:
            bound.bind(str(path))
    line = one_line(cocalib(*(argument.format(path) for argument in arguments)))
    assert kind in line
    assert str(path) in line


@pytest.mark.parametrize(
    "text", ["a: " + "[" * 1000, "- " * 1000 + "x", "a: 2001-99-99", "!!int x", "? [a]\n: b"], ids=str.__len__
)
def test_a_metadata_file_of_another_kind_does_no_harm(cocalib, made, tmp_path, text):
    folder = tmp_path / "bag"
    folder.mkdir()
    made().rename(folder / "bag_0.mcap")
    (folder / "metadata.yaml").write_text(text)
    answer = cocalib("info", folder)
    assert answer.code == 0
    assert "bag_0.mcap" in answer.out


@pytest.mark.parametrize("word", ["abc", "1e400x", "--"])
def test_letters_in_an_ascii_scan_are_reported_by_file(cocalib, tmp_path, word):
    folder = tmp_path / "radar"
    folder.mkdir()
    head = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n"
    for second in range(3):
        (folder / f"{1_700_000_000 + second}.000000000.pcd").write_text(f"{head}1 {word} 3\n")
    answer = cocalib("info", folder)
    assert (answer.code, answer.err) == (0, "")
    assert "not numbers" in answer.out


@pytest.mark.parametrize("half", ["\\ud800", "\\uDC00x", "x\\ud83d"])
def test_half_a_character_in_our_files_is_refused(cocalib, clicks_file, made, half):
    document = json.loads(clicks_file.read_text())
    document["clicks"][0]["id"] = "HALF"
    clicks_file.write_text(json.dumps(document).replace("HALF", half))
    assert "half of a character" in one_line(cocalib("solve", made(), "--clicks", clicks_file))


NESTED = {"toml": "a = {}", "json": '{{"a": {}}}', "yaml": "a: {}"}
PARSED = {
    "check.json": ["check", "{}"],
    "check.yaml": ["check", "{}"],
    "check.xml": ["check", "{}"],
    "import.json": ["import", "{}", "--out", "c.json"],
    "import.yaml": ["import", "{}", "--out", "c.json"],
    "import.xml": ["import", "{}", "--out", "c.json"],
    "export.yaml": ["export", "{}", "--to", "tf2"],
    "camera.yaml": ["check", "calibration.json", "--camera", "{}"],
    "clicks.json": ["solve", "made.mcap", "--clicks", "{}"],
    "pairs.json": ["solve", "--pairs", "{}"],
    "boxes.json": ["evaluate", "calibration.json", "made.mcap", "--boxes", "{}"],
    "options.toml": ["simulate", "--out", "simulated", "--options", "{}"],
    "manifest.toml": ["batch", "{}"],
    "recording.toml": ["info", "made.mcap"],
}


@pytest.mark.parametrize("name", PARSED)
def test_deep_nesting_is_refused(cocalib, solved, monkeypatch, name):
    monkeypatch.chdir(solved.parent)
    xml = '<?xml version="1.0"?><opencv_storage>{}</opencv_storage>'
    opening, closing = ("<a>", "</a>") if name.endswith("xml") else ("[", "]")
    few = 1_200 if name == "check.yaml" else 300  # YAML is split into words in Python, whose own limit is 1,000
    count = few if name.endswith("yaml") else 30_000
    Path(name).write_text(NESTED.get(Path(name).suffix[1:], xml).format(opening * count + closing * count))
    assert re.search("deep|larger than 64 kB", one_line(cocalib(*(word.format(name) for word in PARSED[name]))))


@pytest.mark.parametrize("digits", ["9" * 5000, "0x" + "f" * 5000])
@pytest.mark.parametrize("name", [name for name in PARSED if not name.endswith("xml")])
def test_an_integer_of_thousands_of_digits_is_refused(cocalib, solved, monkeypatch, name, digits):
    monkeypatch.chdir(solved.parent)
    Path(name).write_text(NESTED[Path(name).suffix[1:]].format(digits))
    line = one_line(cocalib(*(word.format(name) for word in PARSED[name])))
    assert "more than 100 digits" in line or "not JSON" in line


@pytest.mark.parametrize("name", [name for name in PARSED if name.endswith("yaml")])
def test_keys_that_yaml_merges_are_refused(cocalib, solved, monkeypatch, name):
    monkeypatch.chdir(solved.parent)
    merges = "".join(f"a{n + 1}: &a{n + 1} {{<<: [*a{n}, *a{n}]}}\n" for n in range(40))
    Path(name).write_text(f"a0: &a0 {{x: 1}}\n{merges}")
    assert "line 2: " in one_line(cocalib(*(word.format(name) for word in PARSED[name])))


@pytest.mark.parametrize("folder", ["/", ".", "./", "..", ""])
@pytest.mark.parametrize("command", [["session", "list"], ["session", "repair"], ["batch"], ["solve", "--pairs"]])
def test_a_folder_without_a_name_is_a_folder_like_any_other(cocalib, tmp_path, monkeypatch, command, folder):
    monkeypatch.chdir(tmp_path)
    answer = cocalib(*command, folder)
    assert (answer.code, answer.out) == (0, "no sessions here or in your user folder\n") or one_line(answer)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows words it otherwise")
def test_a_session_in_the_current_folder_is_not_moved_out_of_it(cocalib, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert ".: cannot be moved" in one_line(cocalib("demo", "--no-browser", "--session", ".", "--fresh"))


@pytest.mark.parametrize("folder", [".", "./", "../images", "../images/."])
def test_the_current_folder_is_read_like_a_named_one(cocalib, tmp_path, monkeypatch, folder):
    images = tmp_path / "images"
    images.mkdir()
    for number in range(3):
        cv2.imwrite(str(images / f"{number}.png"), np.zeros((48, 64, 3), np.uint8))
    (tmp_path / "images.csv").write_text("file,time_ns\n0.png,1\n1.png,2\n2.png,3\n")
    monkeypatch.chdir(images)
    answer = cocalib("info", folder, "--json")
    assert (answer.code, answer.err) == (0, "")
    assert json.loads(answer.out)["topics"][0]["name"] == "/images/image"
    assert "images.csv" in answer.out


@POSIX
def test_a_pipe_that_nobody_reads_is_no_output(cocalib, pairs_file, tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    assert "nobody reads" in one_line(cocalib("solve", "--pairs", pairs_file, "--out", pipe))
    reading = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        assert cocalib("solve", "--pairs", pairs_file, "--out", pipe).code == 0
        assert os.read(reading, 20).startswith(b"{")
    finally:
        os.close(reading)


@pytest.mark.parametrize(
    "cell", ["[" * 100_000, "(" * 100_000 + "m", " " * 100_000 + "x", "_" * 100_000, "f_" * 50_000]
)
def test_a_table_with_a_long_cell_is_read_in_time(cocalib, tmp_path, cell):
    """A pattern that tries every place took minutes here: this test would not end."""
    path = tmp_path / "radar.csv"
    path.write_text(f'time_ns,points,x\n1,"{cell}",2\n')
    one_line(cocalib("info", path))


@pytest.mark.parametrize("value", ["1e308", "-1e308", "1e200", "1e400"])
def test_a_quaternion_of_huge_numbers_is_refused(cocalib, tmp_path, value):
    path, turn = tmp_path / "static.txt", f"--qx {value} --qy {value} --qz {value} --qw 1"
    frames = "--frame-id camera --child-frame-id radar"
    path.write_text(f"ros2 run tf2_ros static_transform_publisher --x 0 --y 0 --z 0 {turn} {frames}\n")
    one_line(cocalib("check", path))


@pytest.mark.parametrize("sigma", [1e308, 1e200, 5e-324, 1e-200])
def test_a_standard_deviation_beyond_any_measurement_is_refused(cocalib, pairs_file, tmp_path, sigma):
    path = tmp_path / "calibration.json"
    assert cocalib("solve", "--pairs", pairs_file, "--out", path).code == 0
    document = json.loads(path.read_text())
    document["pairs"][1]["candidates"][0]["sigma_polar"][1] = sigma
    path.write_text(json.dumps(document))
    assert "pairs[1].candidates[0].sigma_polar[1]" in one_line(cocalib("solve", "--pairs", path))


@pytest.mark.parametrize("sigma", ["0", "5e-324", "1e-200", "1e-20"])
def test_an_error_of_next_to_no_standard_deviation_counts_as_exact(cocalib, pairs_file, sigma):
    priors = ("radar.range_scale_sigma", "radar.range_bias_sigma_m", "radar.height_sigma_m", "lens.distortion_sigma",
              "lens.focal_length_sigma", "radar.azimuth_scale_sigma", "reflector.offset_sigma_m")  # fmt: skip
    typed = [word for prior in priors for word in ("--set", f"{prior}={sigma}")]
    assert cocalib("solve", "--pairs", pairs_file, *typed).code == 0


@POSIX
def test_a_file_name_that_is_not_utf8_is_shown(cocalib, made, clicks_file):
    plain = made()
    odd = plain.rename(Path(os.fsdecode(os.fsencode(plain.parent) + b"/odd-\xff\xfe.mcap")))
    assert "odd-\\xff\\xfe.mcap" in cocalib("info", odd).out
    assert json.loads(cocalib("info", "--json", odd).out)["files"][0]["name"] == "odd-\\xff\\xfe.mcap"
    solved = cocalib("solve", odd, "--clicks", clicks_file)
    assert solved.code == 0
    assert json.loads(solved.out)["provenance"]["inputs"][0]["name"] == "odd-\\xff\\xfe.mcap"
    assert "odd-" in one_line(cocalib("solve", odd, "--clicks", odd))


def test_names_from_a_recording_do_not_reach_the_terminal(cocalib, tmp_path):
    topic = "/radar\nwarning   forged\x1b[2J\x1b]0;owned\x07\x9b31m\u202egab"
    messages = [replace(message, topic=topic) if "radar" in message.topic else message for message in Made().messages()]
    assert all(isinstance(message, RecordedMessage) for message in messages)
    path = write_ros2(tmp_path / "hostile.mcap", messages, container="mcap")
    text, data = cocalib("info", path), cocalib("info", "--json", path)
    refused = cocalib("solve", path, "--clicks", "x", "--radar-topic", "\x1b[31mnone")
    for printed in (text.out, data.out, refused.err):
        assert all(character.isprintable() or character == "\n" for character in printed)
    assert "\\u001b[2J" in text.out
    assert not any(line.startswith("warning   forged") for line in text.out.splitlines())
    assert any(row["name"] == topic for row in json.loads(data.out)["topics"])
