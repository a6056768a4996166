"""A corpus of tables with known truth: each is read right, or right under an assumption that is stated."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S
from calib_core.radar import polar_from_cartesian
from calib_core.recordings import RecordingOptions, describe, open_recording

START_NS = 1_715_938_951_208_764_000
STEP_NS = 100_000_000


@dataclass(frozen=True)
class Truth:
    """Three scans of twelve returns."""

    times_ns: np.ndarray
    points_m: np.ndarray
    doppler_mps: np.ndarray
    snr_db: np.ndarray

    @property
    def rows(self) -> list[tuple[int, float, float, float, float, float]]:
        columns = zip(self.times_ns, *self.points_m.T, self.doppler_mps, self.snr_db, strict=True)
        return [(int(t), *map(float, rest)) for t, *rest in columns]

    @property
    def polar(self) -> list[tuple[int, float, float, float, float]]:
        """Time, range, azimuth [deg], elevation [deg], speed."""
        polar = polar_from_cartesian(self.points_m)
        angles = np.degrees(polar[:, 1:])
        columns = zip(self.times_ns, polar[:, 0], *angles.T, self.doppler_mps, strict=True)
        return [(int(t), *map(float, rest)) for t, *rest in columns]


def truth() -> Truth:
    rng = np.random.default_rng(11)
    n = 36
    points = np.stack([rng.uniform(4, 40, n), rng.uniform(-12, 12, n), rng.uniform(-1, 2, n)], axis=1)
    times = START_NS + STEP_NS * (np.arange(n) // 12)
    return Truth(times, points, rng.uniform(-2, 2, n), rng.uniform(5, 30, n))


T = truth()
NAMES = ("x_m", "y_m", "z_m", "doppler_mps", "snr_db")


def commas(*values: float) -> str:
    return ",".join(map(str, values))


def spaced(*values: float) -> str:
    return ", ".join(map(str, values))


def iso(time_ns: int, pattern: str = "%Y-%m-%dT%H:%M:%S") -> str:
    second, nanosec = divmod(time_ns, NS_PER_S)
    return f"{datetime.fromtimestamp(second, UTC):{pattern}}.{nanosec // 1000:06d}"


def table(header: str, row: Callable[[int, float, float, float, float, float], str]) -> str:
    return "\n".join([header, *(row(*values) for values in T.rows)]) + "\n"


def polar_table(header: str, row: Callable[[int, float, float, float, float], str]) -> str:
    return "\n".join([header, *(row(*values) for values in T.polar)]) + "\n"


def scans() -> list[tuple[int, list[tuple[float, ...]]]]:
    return [(int(t), [row[1:] for row in T.rows if row[0] == t]) for t in np.unique(T.times_ns)]


def listed(values: list[float]) -> str:
    return ", ".join(f"{value:.9f}" for value in values)


DIALECTS: dict[str, tuple[str, str, set[str]]] = {
    "ours": ("a.csv", table("time_ns,x_m,y_m,z_m,doppler_mps,snr_db", commas), set()),
    "unknown columns": (
        "a.csv",
        table("seq,time_ns,track_id,x_m,y_m,z_m,label,doppler_mps,snr_db",
              lambda t, x, y, z, v, s: f"1,{t},7,{x},{y},{z},car,{v},{s}"),
        set(),
    ),
    "no units": ("a.csv", table("timestamp,x,y,z,v,snr", commas), {"length-unit", "speed-unit"}),
    "vendor words": (
        "a.csv",
        table("Timestamp_us,f_PosX [m],f_PosY [m],f_PosZ [m],f_VRad [m/s],f_RCS [dBsm]",
              lambda t, x, y, z, v, s: f"{t // 1000},{x},{y},{z},{v},{s}"),
        {"axes"},
    ),
    "lateral and longitudinal": (
        "a.csv",
        table("time_s,longitudinal_m,lateral_m,vertical_m,range_rate_mps,snr_db",
              lambda t, x, y, z, v, s: f"{t // NS_PER_S}.{t % NS_PER_S:09d},{x},{y},{z},{v},{s}"),
        {"axes"},
    ),
    "centimetres": (
        "a.csv",
        table("time_ms;x [cm];y [cm];z [cm];doppler [km/h];snr [dB]",
              lambda t, x, y, z, v, s: f"{t // 10**6}.{t % 10**6:06d};{x * 100};{y * 100};{z * 100};{v * 3.6};{s}"),
        set(),
    ),
    "decimal commas": (
        "a.csv",
        table("Zeit;time_s;x_m;y_m;z_m;doppler_mps;snr_db",
              lambda t, x, y, z, v, s: f"a;{t // NS_PER_S},{t % NS_PER_S:09d};{x};{y};{z};{v};{s}".replace(".", ",")),
        set(),
    ),
    "comments, a line of units": (
        "a.csv",
        table("# radar log 3, front bumper\n% firmware 1.2\n\ntime,x,y,z,doppler,snr\n[ns],[m],[m],[m],[m/s],[dB]",
              commas),
        set(),
    ),
    "header in a comment": ("a.csv", table("#time_ns, x_m, y_m, z_m, doppler_mps, snr_db", spaced), set()),
    "rostopic echo": (
        "a.csv",
        table("%time,field.header.seq,field.header.stamp,field.header.frame_id,field.x,field.y,field.z,field.velocity,field.intensity",
              lambda t, x, y, z, v, s: f"{t + 5_000_000},1,{t},radar,{x},{y},{z},{v},{s}"),
        {"length-unit", "speed-unit"},
    ),
    "a message a return, 9 us apart": (
        "a.csv",
        "time_ns,point_id,x_m,y_m,z_m,doppler_mps,snr_db\n" + "".join(
            f"{t + 9000 * (n % 12)},{n % 12},{commas(*rest)}\n" for n, (t, *rest) in enumerate(T.rows)),
        set(),
    ),
    "a message a return, unnumbered": (
        "a.csv",
        "time_ns,x_m,y_m,z_m,doppler_mps,snr_db\n" + "".join(
            f"{t + 9000 * (n % 12)},{commas(*rest)}\n" for n, (t, *rest) in enumerate(T.rows)),
        set(),
    ),
    "ros2 topic echo": (
        "a.txt",
        "".join(
            f"header:\n  stamp:\n    sec: {t // NS_PER_S}\n    nanosec: {t % NS_PER_S}\n  frame_id: 'radar'\ndetections:\n"
            + "".join("- " + "\n  ".join(
                f"{name}: {value}" for name, value in zip((*NAMES, "cov"), (*row, [0.1, 0.2]), strict=True)
            ) + "\n" for row in rows) + "---\n" for t, rows in scans()),
        set(),
    ),
    "spaces": ("a.txt", table("time_ns x_m y_m z_m doppler_mps snr_db", lambda *v: "  ".join(map(str, v))), set()),
    "tabs and quotes": ("a.csv", table('"time_ns"\t"x_m"\t"y_m"\t"z_m"\t"doppler_mps"\t"snr_db"',
                                       lambda *v: "\t".join(f'"{one}"' for one in v)), set()),
    "seconds and nanoseconds": (
        "a.csv",
        table("header.stamp.sec,header.stamp.nanosec,position.x_m,position.y_m,position.z_m,doppler_mps,snr_db",
              lambda t, x, y, z, v, s: f"{t // NS_PER_S},{t % NS_PER_S},{x},{y},{z},{v},{s}"),
        {"axes"},
    ),
    "date and time": (
        "a.csv",
        table("date,time,x_m,y_m,z_m,doppler_mps,snr_db",
              lambda t, x, y, z, v, s: f"{iso(t, '%Y-%m-%d')[:10]},{iso(t, '%H:%M:%S')},{x},{y},{z},{v},{s}"),
        set(),
    ),
    "dates with slashes": (
        "a.csv", table("time,x_m,y_m,z_m,doppler_mps,snr_db",
                       lambda t, x, y, z, v, s: f"{iso(t, '%Y/%m/%d/%H:%M:%S')},{x},{y},{z},{v},{s}"), set(),
    ),
    "dates with a zone": (
        "a.csv", table("utc,x_m,y_m,z_m,doppler_mps,snr_db",
                       lambda t, x, y, z, v, s: f"{iso(t + 7200 * NS_PER_S)}+02:00,{x},{y},{z},{v},{s}"), set(),
    ),
    "polar, degrees by their size": (
        "a.csv",
        polar_table("timestamp_ns,range_m,azimuth,elevation_deg,doppler_mps", commas),
        {"azimuth-sign"},
    ),
    "polar, our words": ("a.csv", polar_table("time_ns,range_m,azimuth_deg,elevation_deg,doppler_mps", commas), set()),
    "polar, other words": (
        "a.csv",
        polar_table("ts_ns,Range [m],Az [deg],El [deg],Vr [m/s]", commas),
        {"azimuth-sign"},
    ),
    "polar and Cartesian": (
        "a.csv",
        "time_ns,range_m,azimuth,elevation,x,y,z,doppler_mps,snr_db\n" + "".join(
            f"{t},{p[1]},{np.radians(p[2])},{np.radians(p[3])},{x * 1000},{y * 1000},{z * 1000},{v},{s}\n"
            for (t, x, y, z, v, s), p in zip(T.rows, T.polar, strict=True)
        ),
        set(),
    ),
    "x to the right": (
        "a.csv", table("time_ns,x_m,y_m,z_m,doppler_mps,snr_db", lambda t, x, y, z, v, s: f"{t},{-y},{x},{z},{v},{s}"), {"axes"},
    ),
    "floats of pandas": (
        "a.csv", table(",time_s,x_m,y_m,z_m,doppler_mps,snr_db",
                       lambda t, x, y, z, v, s: f"0,{t / 1e9!r},{x:.12e},{y:.12e},{z:.12e},{v:.12e},{s:.12e}"), set(),
    ),
    "UTF-16": ("a.csv", table("time_ns,x_m,y_m,z_m,doppler_mps,snr_db", commas), set()),
    "Latin-1": ("a.csv", polar_table("time_ns,range_m,azimuth [°],elevation [°],doppler_mps", commas), {"azimuth-sign"}),
    "lists in cells": (
        "a.csv",
        "time_ns,x_m,y_m,z_m,doppler_mps,snr_db\n" + "".join(
            f"{t}," + ",".join(f'"[{listed(list(column))}]"' for column in zip(*rows, strict=True)) + "\n" for t, rows in scans()
        ),
        set(),
    ),
    "lists in cells without quotes": (
        "a.csv",
        "time_ns,x_m,y_m,z_m,doppler_mps,snr_db\n" + "".join(
            f"{t}," + ",".join(f"[{listed(list(column))}]" for column in zip(*rows, strict=True)) + "\n" for t, rows in scans()
        ),
        set(),
    ),
    "JSON lines, a return each": (
        "a.jsonl",
        "".join(json.dumps({"time_ns": t, "x_m": x, "y_m": y, "z_m": z, "doppler_mps": v, "snr_db": s, "id": None}) + "\n"
                for t, x, y, z, v, s in T.rows),
        set(),
    ),
    "JSON lines, a scan each": (
        "a.ndjson",
        "".join(json.dumps({
            "header": {"stamp": {"sec": t // NS_PER_S, "nanosec": t % NS_PER_S}, "frame_id": "radar"},
            "detections": [{"position": {"x": r[0], "y": r[1], "z": r[2]}, "doppler_mps": r[3], "snr_db": r[4]} for r in rows],
        }) + "\n" for t, rows in scans()),
        {"length-unit", "axes"},
    ),
    "JSON array of lists": (
        "a.json",
        json.dumps([{"timestamp_us": t // 1000, **{
            name: list(column) for name, column in zip(NAMES, zip(*rows, strict=True), strict=True)
        }} for t, rows in scans()], indent=1),
        set(),
    ),
}  # fmt: skip


def written(folder: Path, kind: str) -> Path:
    name, text, _ = DIALECTS[kind]
    path = folder / name
    path.write_bytes(text.encode({"UTF-16": "utf-16", "Latin-1": "latin-1"}.get(kind, "utf-8")))
    return path


@pytest.mark.parametrize("kind", DIALECTS)
def test_a_table_is_read_right_or_under_a_stated_assumption(tmp_path, kind):
    with open_recording(written(tmp_path, kind), require=("radar",)) as recording:
        found = recording.radar_scans()
        assumed = {assumption.key for assumption in recording.assumptions}
    assert assumed == DIALECTS[kind][2]
    tolerance_ns = {"floats of pandas": 500}.get(kind, 0)
    np.testing.assert_allclose(found.times_ns, np.unique(T.times_ns), rtol=0, atol=tolerance_ns)
    np.testing.assert_allclose(found.points_radar_m, T.points_m, atol=2e-6)
    np.testing.assert_allclose(found.doppler_mps, T.doppler_mps, atol=2e-6)
    if "snr" in DIALECTS[kind][1][:200].lower() or kind == "vendor words":
        np.testing.assert_allclose(found.snr_db, T.snr_db, atol=2e-6)


@pytest.mark.parametrize("kind", [kind for kind, (_, _, assumed) in DIALECTS.items() if assumed])
def test_the_words_of_an_assumption_confirm_it(tmp_path, kind):
    path = written(tmp_path, kind)
    with open_recording(path, require=("radar",)) as recording:
        words = [word for one in recording.assumptions for word in one.confirm.replace("'", "").split("--")[1:]]
        before = recording.radar_scans().points_radar_m
    mapped = tuple(word.removeprefix("map ").strip() for word in words if word.startswith("map "))
    axes = next((word.removeprefix("radar-axes ") for word in words if word.startswith("radar-axes")), None)
    with open_recording(path, RecordingOptions(map=mapped, radar_axes=axes), require=("radar",)) as recording:
        assert recording.assumptions == ()
        np.testing.assert_allclose(recording.radar_scans().points_radar_m, before, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1715938951.2,3,4,5\n1715938951.3,3,4,5\n", "no header; the first line is '1715938951.2,3,4,5'"),
        ("when,left,ahead\n1,2,3\n", "the columns are when, left, ahead"),
        ("time_ns,x_m,y_m\n1,[1;2],[1;2;3]\n", "lists of 2 and 3 numbers in one row"),
    ],
)
def test_a_table_that_does_not_say_what_it_holds_is_refused_with_what_to_write(tmp_path, text, words):
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(RecordingError, match=r"a\.csv") as caught:
        open_recording(tmp_path / "a.csv", require=("radar",))
    assert words in str(caught.value)


@pytest.mark.parametrize("empty", ["0,0,0,0,0,true", "0,0,0,0,0,false", "9,2,1,0,0,false"])
def test_an_empty_slot_of_a_table_is_no_return(tmp_path, empty):
    rows = "".join(f"{commas(*row)},true\n{row[0]},{empty}\n" for row in T.rows)
    (tmp_path / "a.csv").write_text(f"time_ns,x_m,y_m,z_m,doppler_mps,snr_db,measured\n{rows}")
    with open_recording(tmp_path / "a.csv", require=("radar",)) as recording:
        points = recording.radar_scans().points_radar_m
    np.testing.assert_allclose(points[np.isfinite(points).all(axis=1)], T.points_m)


def test_the_columns_of_a_table_without_a_header_can_be_counted(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("".join(f"{t} {-y} {x} {z}\n" for t, x, y, z, _, _ in T.rows))
    options = RecordingOptions(map=("time=1:ns", "x=3:m", "y=-2:m", "z=4:m"))
    with open_recording(path, options, require=("radar",)) as recording:
        np.testing.assert_allclose(recording.radar_scans().points_radar_m, T.points_m)
        assert recording.assumptions == ()


def test_a_mapped_column_that_does_not_exist_is_refused_with_the_nearest(tmp_path):
    path = written(tmp_path, "vendor words")
    with pytest.raises(RecordingError, match=r"--map x=f_PosXX:m: no column 'f_PosXX'; did you mean 'f_PosX \[m\]'\?"):
        open_recording(path, RecordingOptions(map=("x=f_PosXX:m",)), require=("radar",))


def test_a_stated_unit_does_not_hide_that_x_points_to_the_right(tmp_path):
    (tmp_path / "a.csv").write_text(table("time_ns,x,y,z", lambda t, x, y, z, *_: f"{t},{-y},{x},{z}"))
    options = RecordingOptions(map=("x=x:m", "y=y:m", "z=z:m"))
    with open_recording(tmp_path / "a.csv", options, require=("radar",)) as recording:
        np.testing.assert_allclose(recording.radar_scans().points_radar_m, T.points_m)
        assert [one.key for one in recording.assumptions] == ["axes"]
    options = RecordingOptions(map=("x=y:m", "y=-x:m", "z=z:m"))
    with open_recording(tmp_path / "a.csv", options, require=("radar",)) as recording:
        np.testing.assert_allclose(recording.radar_scans().points_radar_m, T.points_m)
        assert recording.assumptions == ()


def test_a_mapped_range_is_used_although_there_are_positions(tmp_path):
    rows = "".join(f"{t},{r},{-a},{e},0,0\n" for t, r, a, e, _ in T.polar)
    (tmp_path / "a.csv").write_text(f"time_ns,range_m,azimuth_deg,elevation_deg,x_m,y_m\n{rows}")
    options = RecordingOptions(map=("range=range_m:m", "azimuth=-azimuth_deg:deg"))
    with open_recording(tmp_path / "a.csv", options, require=("radar",)) as recording:
        np.testing.assert_allclose(recording.radar_scans().points_radar_m, T.points_m, atol=1e-9)
        assert recording.assumptions == ()


def test_scans_nested_in_one_object_are_read(tmp_path):
    frames = [
        {"time": t, "points": dict(zip(NAMES, map(list, zip(*rows, strict=True)), strict=True))} for t, rows in scans()
    ]
    (tmp_path / "a.json").write_text(json.dumps({"meta": {"sensor": "front"}, "frames": frames}))
    with open_recording(tmp_path / "a.json", require=("radar",)) as recording:
        np.testing.assert_allclose(recording.radar_scans().points_radar_m, T.points_m)
        np.testing.assert_array_equal(recording.radar_times, np.unique(T.times_ns))


@pytest.mark.parametrize("kind", ["ours", "lists in cells", "JSON lines, a return each"])
def test_a_table_that_ends_within_a_row_is_read_up_to_there(tmp_path, kind):
    path = written(tmp_path, kind)
    whole = path.read_bytes()
    last = whole.rstrip(b"\n").rfind(b"\n")
    path.write_bytes(whole[: last + 25])
    with open_recording(path, require=("radar",)) as recording:
        kept = len(recording.radar_scans().points_radar_m)
        (warning,) = recording.warnings
    assert kept == (24 if kind == "lists in cells" else 35)
    assert warning.code == "cut-off-row"
    path.write_bytes(whole[: last + 25] + b"\n" + whole[last + 1 :])
    with pytest.raises(RecordingError, match="fix or remove the line"):
        open_recording(path, require=("radar",))


def test_gps_time_is_an_assumption(tmp_path):
    gps_s = START_NS // NS_PER_S - 315_964_800 + 18
    (tmp_path / "a.csv").write_text(f"gps_time,x_m,y_m\n{gps_s}.208764,1,2\n")
    with open_recording(tmp_path / "a.csv", require=("radar",)) as recording:
        assert recording.radar_times.tolist() == [START_NS]
        assert [one.key for one in recording.assumptions] == ["time-scale"]


def test_the_angle_unit_of_the_axes_option_is_followed(tmp_path):
    rows = "".join(f"{t},{r},{a / 50},{e / 50}\n" for t, r, a, e, _ in T.polar)
    (tmp_path / "a.csv").write_text(f"time_ns,range_m,azimuth,elevation\n{rows}")
    angles = {}
    for unit in ("degrees", "radians"):
        with open_recording(tmp_path / "a.csv", RecordingOptions(radar_axes=unit), require=("radar",)) as recording:
            assert {one.key for one in recording.assumptions} == {"azimuth-sign"}
            angles[unit] = polar_from_cartesian(recording.radar_scans().points_radar_m)[:, 1]
    np.testing.assert_allclose(angles["degrees"], np.radians(angles["radians"]))


def test_what_was_taken_for_what_and_what_was_left_out_is_shown(tmp_path):
    with open_recording(written(tmp_path, "unknown columns"), require=("radar",)) as recording:
        assert "without seq, track_id, label" in describe(recording)
    with open_recording(written(tmp_path, "vendor words"), require=("radar",)) as recording:
        assert "from f_PosX [m], y" in describe(recording)
    with open_recording(written(tmp_path, "polar and Cartesian"), require=("radar",)) as recording:
        text = describe(recording)
    assert "z in mm: " in text
    assert "azimuth in rad: " in text
    assert "computed" not in text
    (tmp_path / "polar.csv").write_text("Timestamp,Range [m],Azimuth (deg)\n2024/05/17 09:42:31.2,5,10\n")
    with open_recording(tmp_path / "polar.csv", require=("radar",)) as recording:
        assert "Range [m], Azimuth (deg)\n" in describe(recording)


def test_two_columns_of_one_quantity_are_an_assumption(tmp_path):
    (tmp_path / "a.csv").write_text("time_ns,range_m,r_m,azimuth_deg\n1,2,3,40\n")
    with open_recording(tmp_path / "a.csv", require=("radar",)) as recording:
        (assumption,) = recording.assumptions
    assert (assumption.key, assumption.text.split()[0]) == ("field-meaning", "range_m")
    assert assumption.confirm == "--map range=range_m:m"


# -- one file per scan


def per_scan(folder: Path, names: list[str]) -> Path:
    folder.mkdir()
    for name, (_, rows) in zip(names, scans(), strict=True):
        text = "x_m,y_m,z_m,doppler_mps,snr_db\n" + "".join(",".join(map(str, row)) + "\n" for row in rows)
        (folder / name).write_text(text)
    return folder


def test_tables_with_one_scan_each_are_stamped_by_their_names(tmp_path):
    names = [f"{iso(t).replace(':', '-').replace('.', '-')}.csv" for t, _ in scans()]
    with open_recording(per_scan(tmp_path / "radar", names), require=("radar",)) as recording:
        found = recording.radar_scans()
        assert "radar .csv, 3 files" in describe(recording)
    np.testing.assert_array_equal(found.times_ns, np.unique(T.times_ns))
    np.testing.assert_allclose(found.points_radar_m, T.points_m)


@pytest.mark.parametrize("word", ["objects", "clusters", "hits", "dets"])
def test_a_list_of_json_may_have_any_common_word_for_returns(tmp_path, word):
    lines = [
        json.dumps({"ts": START_NS / 1e9 + 0.1 * number, word: [{"id": 3, "pos": {"x": 9.25, "y": 1.5, "z": 0.5}}]})
        for number in range(4)
    ]
    (tmp_path / "a.jsonl").write_text("\n".join(lines) + "\n")
    with open_recording(tmp_path / "a.jsonl", require=("radar",)) as recording:
        np.testing.assert_allclose(recording.radar_scans().points_radar_m, [[9.25, 1.5, 0.5]] * 4)


def test_json_files_with_one_scan_each_are_a_radar(tmp_path):
    folder = tmp_path / "radar"
    folder.mkdir()
    for number, (time, rows) in enumerate(scans()):
        points = [{"range_m": float(np.linalg.norm(r[:3])), "x_m": r[0], "y_m": r[1], "z_m": r[2]} for r in rows]
        (folder / f"scan_{number}.json").write_text(json.dumps({"timestamp": time, "points": points}))
    with open_recording(folder, require=("radar",)) as recording:
        found = recording.radar_scans()
        assert recording.assumptions == ()
    np.testing.assert_array_equal(found.times_ns, np.unique(T.times_ns))
    np.testing.assert_allclose(found.points_radar_m, T.points_m)


def test_tables_of_several_drives_are_not_taken_for_scans(tmp_path):
    for number in (1, 2):
        text = table("time_ns,x_m,y_m,z_m,doppler_mps,snr_db", commas)
        (tmp_path / f"drive_{number}.csv").write_text(text)
    with open_recording(tmp_path, require=("radar",)) as recording:
        assert [topic.name for topic in recording.topics] == ["/drive_1/radar", "/drive_2/radar"]


# -- time zones


def test_a_missing_zone_is_an_assumption_only_where_it_matters(tmp_path):
    import cv2

    path = written(tmp_path, "dates with slashes")
    local, epoch = tmp_path / "local", tmp_path / "epoch"
    for folder, names in (
        (local, [f"{iso(t, '%Y%m%d_%H%M%S')}.png" for t, _ in scans()]),
        (epoch, [f"{t}.png" for t, _ in scans()]),
    ):
        folder.mkdir()
        for name in names:
            cv2.imwrite(str(folder / name), np.zeros((8, 8, 3), np.uint8))
    with open_recording([path, local]) as recording:
        assert recording.assumptions == ()
    with open_recording([path, epoch]) as recording:
        assert recording.assumptions == (), "radar and camera meet in no other time zone"
    late = max(t for t, _ in scans()) + 1_000 * NS_PER_S
    cv2.imwrite(str(epoch / f"{late}.png"), np.zeros((8, 8, 3), np.uint8))
    with open_recording([path, epoch]) as recording:
        (assumption,) = recording.assumptions
        assert (assumption.key, assumption.confirm) == ("time-zone", "--time-zone UTC")
    with open_recording([path, epoch], RecordingOptions(time_zone="UTC")) as recording:
        assert recording.assumptions == ()
    with pytest.raises(RecordingError, match="do not overlap"):
        open_recording([path, epoch], RecordingOptions(time_zone="+02:00"))
    with pytest.raises(RecordingError, match="give an offset from UTC such as"):
        open_recording([path, epoch], RecordingOptions(time_zone="Paris"))


@pytest.mark.parametrize(("zone", "hours"), [("+02:00", 2), ("-07:00", -7), ("+05:30", 5.5)])
def test_times_that_are_a_time_zone_apart_are_explained(tmp_path, zone, hours):
    import cv2

    shift_ns = int(hours * 3600) * NS_PER_S
    text = table("time,x_m,y_m,z_m", lambda t, x, y, z, *_: f"{iso(t + shift_ns, '%Y-%m-%d %H:%M:%S')},{x},{y},{z}")
    (tmp_path / "radar.csv").write_text(text)
    (tmp_path / "camera").mkdir()
    for time, _ in scans():
        cv2.imwrite(str(tmp_path / "camera" / f"{time}.png"), np.zeros((8, 8, 3), np.uint8))
    with pytest.raises(RecordingError) as caught:
        open_recording(tmp_path)
    assert f"with --time-zone {zone} they" in str(caught.value)
    with open_recording(tmp_path, RecordingOptions(time_zone=zone)) as recording:
        np.testing.assert_array_equal(recording.radar_times, recording.image_times)
