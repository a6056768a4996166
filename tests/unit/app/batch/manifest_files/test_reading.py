"""Manifests as a person writes them: TOML and CSV say the same, and every mistake is named with its place."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from calib_core.errors import InputError
from cocalib.batch.manifest import ManifestRow
from cocalib.batch.manifest_files.reading import read_manifest

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
CSV = """\
vehicle,session,recording,clicks,auto,vehicle_type,radar_serial,camera_position_m,exports,\
options.noise.sigma_px,options.gating.max_range_m,topics.radar_topic
van 7,spring,a/radar.bag;a/camera.bag,a/clicks.json,,van,R-1,0.1;0;-0.2,tf2,1.5,30,/radar
van 8,,b.mcap,,yes,lorry,,,,3,,
"""


def rows_of(text: str, folder: Path, name: str = "fleet.toml") -> tuple[ManifestRow, ...]:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return read_manifest(path).rows


def fault_of(text: str, folder: Path, name: str = "fleet.toml") -> str:
    with pytest.raises(InputError) as error:
        rows_of(text, folder, name)
    assert str(error.value).startswith(f"{folder / name}: ")
    return str(error.value).removeprefix(f"{folder / name}: ")


def test_a_session_has_what_the_file_says_and_what_the_defaults_say(tmp_path: Path) -> None:
    first, second = rows_of(TOML, tmp_path)
    assert (first.vehicle, first.session, first.vehicle_type, first.radar_serial) == ("van 7", "spring", "van", "R-1")
    assert first.recording == (tmp_path / "a" / "radar.bag", tmp_path / "a" / "camera.bag")
    assert first.clicks == tmp_path / "a" / "clicks.json"
    assert (first.options.noise.sigma_px, first.options.gating.max_range_m) == (1.5, 30.0)
    assert first.options.solving.camera_position is not None
    assert first.options.solving.camera_position.position_m == (0.1, 0.0, -0.2)
    assert (first.topics.radar_topic, first.exports, first.auto) == ("/radar", ("tf2",), False)
    assert (second.session, second.vehicle_type, second.auto) == ("b", "lorry", True)
    assert (second.options.noise.sigma_px, second.options.gating.max_range_m) == (3.0, 60.0)


def test_toml_and_csv_say_the_same(tmp_path: Path) -> None:
    def said(rows: tuple[ManifestRow, ...]) -> list[tuple[object, ...]]:
        return [tuple(getattr(row, name) for name in ManifestRow.__slots__ if name != "place") for row in rows]

    assert said(rows_of(TOML, tmp_path)) == said(rows_of(CSV, tmp_path, "fleet.csv"))


def test_a_table_saved_by_a_spreadsheet_is_read(tmp_path: Path) -> None:
    (row,) = rows_of('\ufeffvehicle,recording\r\n"van, old",a.bag\r\n,\r\n', tmp_path, "fleet.csv")
    assert (row.vehicle, row.session) == ("van, old", "a")


def test_an_absolute_path_stays_as_it_is(tmp_path: Path) -> None:
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
        ("", "no session in it; add one, or let cocalib batch"),
        ("[[session", "not valid TOML: "),
        ('[[session]]\nvehicle = "a/b"\nrecording = "b.bag"', "session 1 (a/b): vehicle: 'a/b' cannot be a name"),
        ('[[session]]\nvehicle = "a"\nrecording = ".."', "session 1 (a): session: '..' cannot be a name"),
        (
            f'[[session]]\nvehicle = "a"\nrecording = "{"b" * 121}.bag"',
            "session 1 (a): session is 'bbbbbbbbbbbbbbbbbbbb…'; give 1 to 120 printable characters",
        ),
        (
            '[[session]]\nvehicle = "a"\nrecording = "b.bag"\nradar_serial = "R\\t1"',
            "session 1 (a): radar_serial is 'R\\t1'; give 1 to 120 printable characters",
        ),
        (
            '[[session]]\nvehicle = "a"\nrecording = "b.bag"\nvehicle_type = " "',
            "session 1 (a): vehicle_type is ' '; give 1 to 120 printable characters",
        ),
        (
            f'[[session]]\nvehicle = "a"\nrecording = "b.bag"\ncamera_serial = "{"x" * 121}"',
            "session 1: camera_serial: expected str of length <= 120",
        ),
        ('[[session]]\nvehicle = "a"\nrecording = []', "session 1 (a): recording: names no file"),
        (
            '[[session]]\nvehicle = "a"\nrecording = "b.bag"\noptions.noise.sigmapx = 1',
            "session 1 (a): unknown option 'noise.sigmapx'; did you mean 'noise.sigma_px'?",
        ),
        (
            '[[session]]\nvehicle = "a"\nrecording = "b.bag"\ntopics.radar_topc = "x"',
            "session 1: topics.radar_topc: unknown key; did you mean radar_topic?",
        ),
        (
            '[[session]]\nvehicle = "a"\nrecording = "b.bag"\nexports = ["tf3"]',
            "session 1 (a): exports: unknown format 'tf3'; did you mean tf2?",
        ),
        (
            '[[session]]\nvehicle = "a"\nrecording = "b.bag"\ncamera_position_sigma_m = 0.1',
            "session 1 (a): camera_position_sigma_m: there is no camera_position_m",
        ),
        (
            '[[session]]\nvehicle = "a"\nrecording = "b.bag"\ncamera_position_m = [0, 0, 5000]',
            "session 1 (a): camera_position_m: give metres",
        ),
        (
            '[[session]]\nvehicle = "a"\nrecording = "b.bag"\n[[session]]\nvehicle = "A"\nrecording = "c/B.bag"',
            "session 1 and session 2 are both session 'B' of vehicle 'A'",
        ),
    ],
)
def test_a_mistake_is_named_with_its_place(text: str, fault: str, tmp_path: Path) -> None:
    assert fault_of(text, tmp_path).startswith(fault)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("vehicle,recording\na,b.bag,c", "line 2: 3 cells, but 2 columns"),
        ("vehicle,vehicle\na,b", "line 1: the column 'vehicle' stands twice"),
        ("vehicle,recording,auto\na,b.bag,maybe", "line 2: auto: 'maybe'; write yes or no"),
        ("vehicle,recording,camera_position_m\na,b.bag,0;x;1", "line 2: camera_position_m: 'x' is not a number"),
        (
            "vehicle,recording,options,options.method\na,b.bag,1,paper",
            "line 2: the column 'options.method' contradicts",
        ),
        ('vehicle,recording\na,"b.bag', "not valid CSV: "),
        ("vehicle,recording", "no session in it"),
        ("", "no session in it"),
    ],
)
def test_a_mistake_in_a_table_is_named_with_its_line(text: str, fault: str, tmp_path: Path) -> None:
    assert fault_of(text, tmp_path, "fleet.csv").startswith(fault)


def test_a_file_of_another_kind_is_refused(tmp_path: Path) -> None:
    assert fault_of("a: 1", tmp_path, "fleet.yaml").startswith("a manifest is a .toml or .csv file")
    with pytest.raises(InputError, match=r"no such file; cocalib batch .*absent\.toml --init FOLDER writes one"):
        read_manifest(tmp_path / "absent.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not a text file"):
        read_manifest(tmp_path / "binary.toml")


def test_the_size_of_the_reflector_and_resized_pictures(tmp_path: Path) -> None:
    toml, table = tmp_path / "fleet.toml", tmp_path / "fleet.csv"
    toml.write_text(
        '[defaults]\nreflector_m = 0.3\n[[session]]\nvehicle = "a"\nrecording = "a.bag"\nrescale_camera = true\n'
    )
    table.write_text("vehicle,recording,reflector_m,rescale_camera\na,a.bag,0.3,yes\n")
    for path in (toml, table):
        (row,) = read_manifest(path).rows
        assert (row.reflector_m, row.rescale_camera) == (0.3, True)
    toml.write_text('[[session]]\nvehicle = "a"\nrecording = "a.bag"\nreflector_m = 24\n')
    with pytest.raises(InputError, match="reflector_m"):
        read_manifest(toml)


@pytest.mark.parametrize("delimiter", [";", "\t"])
def test_what_excel_writes_is_read(tmp_path: Path, delimiter: str) -> None:
    head, *rows = CSV.splitlines()
    cells = [delimiter.join(f'"{cell}"' if ";" in cell else cell for cell in row.split(",")) for row in rows]
    text = "\ufeff" + "\r\n".join([head.replace(",", delimiter).replace("vehicle,", "Vehicle,"), *cells, ""])
    text = text.replace("vehicle" + delimiter, "Vehicle" + delimiter, 1)
    path = tmp_path / "fleet.csv"
    path.write_bytes(text.encode())
    (tmp_path / "plain").mkdir()
    assert read_manifest(path).rows == tuple(
        replace(
            row,
            recording=tuple(tmp_path / one.relative_to(tmp_path / "plain") for one in row.recording),
            clicks=row.clicks and tmp_path / row.clicks.relative_to(tmp_path / "plain"),
        )
        for row in rows_of(CSV, tmp_path / "plain", "fleet.csv")
    )


def test_what_excel_writes_in_another_encoding_is_named_with_what_to_do(tmp_path: Path) -> None:
    path = tmp_path / "fleet.csv"
    path.write_bytes("vehicle,recording\nK\xe4fer,a.bag\n".encode("latin-1"))
    with pytest.raises(InputError, match="save it as UTF-8"):
        read_manifest(path)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[session]\nvehicle = "a"\nrecording = "a.bag"\n', r"write \[\[session\]\], with two brackets"),
        (
            '[[session]]\nvehicle = 17\nrecording = "a.bag"\n',
            r'vehicle: 17 is no text; write it in quotes: vehicle = "17"',
        ),
        (
            '[[session]]\nvehicle = "a"\nsession = 2026-09-21\nrecording = "a.bag"\n',
            r'session: 2026-09-21 is no text; write it in quotes: session = "2026-09-21"',
        ),
        ('[[session]]\nvehicle = "a "\nrecording = "a.bag"\n', r"leave out the spaces around it"),
        (
            '[[session]]\nvehicle = "a"\nrecording = "a.bag"\n[[session]]\nvehicle = "b"\nrecording = "x/../a.bag"\n',
            r"session 1 \(a / a\) and session 2 \(b / a\) have the same recording",
        ),
    ],
)
def test_slips_of_the_pen_are_told_with_what_to_write(tmp_path: Path, text: str, words: str) -> None:
    assert re.search(words, fault_of(text, tmp_path))
