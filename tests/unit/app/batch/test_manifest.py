"""Manifests as a person writes them: every mistake is named with its place."""

from pathlib import Path

import pytest

from calib_core.errors import InputError
from cocalib.batch.manifest import ManifestRow, read_manifest

TOML = """
[defaults]
vehicle_type = "van"
options.noise.sigma_px = 1.5

[[session]]
vehicle = "van 7"
session = "spring"
recording = ["a/radar.bag", "a/camera.bag"]
clicks = "a/clicks.json"
radar_serial = "R-1"
camera_position_m = [0.1, 0.0, -0.2]
exports = ["tf2"]
options.gating.max_range_m = 30
topics.radar_topic = "/radar"

[[session]]
vehicle = "van 8"
recording = "b.mcap"
auto = true
vehicle_type = "lorry"
options.noise.sigma_px = 3
"""


ROW = '[[session]]\nvehicle = "a"\nrecording = "b.bag"\n'


def rows_of(text: str, folder: Path, name: str = "sessions.toml") -> tuple[ManifestRow, ...]:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return read_manifest(path).rows


def fault_of(text: str, folder: Path, name: str = "sessions.toml") -> str:
    with pytest.raises(InputError) as error:
        rows_of(text, folder, name)
    assert str(error.value).startswith(f"{folder / name}: ")
    return str(error.value).removeprefix(f"{folder / name}: ")


def test_a_session_has_what_the_file_says_and_what_the_defaults_say(tmp_path):
    first, second = rows_of(TOML, tmp_path)
    assert (first.vehicle, first.session, first.vehicle_type, first.radar_serial) == ("van 7", "spring", "van", "R-1")
    assert first.recording == (tmp_path / "a" / "radar.bag", tmp_path / "a" / "camera.bag")
    assert first.clicks == tmp_path / "a" / "clicks.json"
    assert (first.options.noise.sigma_px, first.options.gating.max_range_m) == (1.5, 30.0)
    assert first.options.solving.camera_position.position_m == (0.1, 0.0, -0.2)
    assert (first.topics.radar_topic, first.exports, first.auto) == ("/radar", ("tf2",), False)
    assert (second.session, second.vehicle_type, second.auto) == ("b", "lorry", True)
    assert (second.options.noise.sigma_px, second.options.gating.max_range_m) == (3.0, 60.0)


def test_an_absolute_path_stays_as_it_is(tmp_path):
    elsewhere = tmp_path / "elsewhere" / "a.bag"
    (row,) = rows_of(f'[[session]]\nvehicle = "a"\nrecording = "{elsewhere.as_posix()}"\n', tmp_path)
    assert row.recording == (elsewhere,)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ('[[session]]\nvehicle = "a"\nrecordin = "b.bag"', "session 1: recordin: unknown key; did you mean recording?"),
        ('[sessions]\nvehicle = "a"', "sessions: unknown key; did you mean session?"),
        ("session = 3", "session: expected array, got int"),
        ("[defaults]\nauto = 3", "defaults.auto: expected bool, got int"),
        ("", "no session in it; add a [[session]]"),
        ("[[session", "not valid TOML: "),
        (ROW.replace('"a"', '"a/b"'), "session 1 (a/b): vehicle: 'a/b' cannot be a name"),
        (ROW.replace("b.bag", ".."), "session 1 (a): session: '..' cannot be a name"),
        (ROW.replace("b.", "b" * 121 + "."), "session 1 (a): session is 'bbbbbbbbbbbbbbbbbbbb…'; give 1 to 120"),
        (f'{ROW}radar_serial = "R\\t1"', "session 1 (a): radar_serial is 'R\\t1'; give 1 to 120 printable characters"),
        (f'{ROW}vehicle_type = " "', "session 1 (a): vehicle_type is ' '; give 1 to 120 printable characters"),
        (f'{ROW}camera_serial = "{"x" * 121}"', "session 1: camera_serial: expected str of length <= 120"),
        (ROW.replace('"b.bag"', "[]"), "session 1 (a): recording: names no file"),
        (
            f"{ROW}options.noise.sigmapx = 1",
            "session 1 (a): unknown option 'noise.sigmapx'; did you mean noise.sigma_px?",
        ),
        (f'{ROW}topics.radar_topc = "x"', "session 1: topics.radar_topc: unknown key; did you mean radar_topic?"),
        (f'{ROW}exports = ["tf3"]', "session 1 (a): exports: unknown format 'tf3'; did you mean tf2?"),
        (
            f"{ROW}camera_position_sigma_m = 0.1",
            "session 1 (a): camera_position_sigma_m: there is no camera_position_m",
        ),
        (f"{ROW}camera_position_m = [0, 0, 5000]", "session 1 (a): camera_position_m: give meters"),
        (f"{ROW}reflector_m = 24", "reflector_m"),
        (
            f'{ROW}[[session]]\nvehicle = "A"\nrecording = "c/B.bag"',
            "session 1 and session 2 are both session 'B' of vehicle 'A'",
        ),
        (
            f'{ROW}[[session]]\nvehicle = "b"\nrecording = "x/../b.bag"',
            "session 1 (a / b) and session 2 (b / b) have the same recording",
        ),
        (ROW[1:].replace("]]", "]"), "write [[session]], with two brackets"),
        (ROW.replace('"a"', "17"), 'vehicle: 17 is no text; write it in quotes: vehicle = "17"'),
        (f"{ROW}session = 2026-09-21", 'session: 2026-09-21 is no text; write it in quotes: session = "2026-09-21"'),
        (ROW.replace('"a"', '"a "'), "leave out the spaces around it"),
    ],
)
def test_a_mistake_is_named_with_its_place(text, fault, tmp_path):
    assert fault in fault_of(text, tmp_path)


def test_a_file_of_another_kind_is_refused(tmp_path):
    for name in ("sessions.yaml", "sessions.csv"):
        assert "[[session]]" in fault_of("a: 1", tmp_path, name)
    with pytest.raises(InputError, match=r"no such file or folder; .*\[\[session\]\]"):
        read_manifest(tmp_path / "absent.toml")
    for data, words in ((b"\xff\xfe\x00", "not a text file"), (ROW.encode() + b"# K\xe4fer", "save it as UTF-8")):
        (tmp_path / "binary.toml").write_bytes(data)
        with pytest.raises(InputError, match=words):
            read_manifest(tmp_path / "binary.toml")


def test_the_size_of_the_reflector_and_resized_images(tmp_path):
    (row,) = rows_of(f"[defaults]\nreflector_m = 0.3\n{ROW}rescale_camera = true\n", tmp_path)
    assert (row.reflector_m, row.rescale_camera) == (0.3, True)
