"""The commands on good input."""

import hashlib
import json
import os
import re
import tomllib
from functools import partial
from pathlib import Path

import cv2
import numpy as np
import pytest

import calib_core as cc
from benchmarks.simulated_pairs import SystematicErrors, simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.geometry import rotation_angle_rad
from calib_core.interchange.exporting import export_all
from calib_core.interchange.formats.registry import written_formats
from calib_core.interchange.importing import read_any
from calib_core.interchange.own.calibration_json import read_calibration
from calib_core.interchange.statement import POSE_ONLY
from cocalib.cli import demo
from cocalib.cli.serving_flags import ServingFlags
from cocalib.opening import Choice, Serving
from tests.cli.conftest import Made
from tests.corpus_calibrations.data_sets import DATA_SETS
from tests.corpus_calibrations.tools import TOOLS
from tests.corpus_calibrations.truth import CAMERA_FROM_RADAR, SIZE


def test_solve_finds_the_pose_the_recording_was_made_with(solved):
    document = json.loads(solved.read_text())
    truth = Made().camera_from_radar
    turned = np.array(document["camera_from_radar"]["rotation"]) @ truth.rotation.T
    assert np.rad2deg(rotation_angle_rad(turned)) < 0.1
    assert document["camera_from_radar"]["translation_m"] == pytest.approx(truth.translation_m, abs=0.01)


def test_clicks_with_rounded_stamps_are_solved_at_their_frames_and_told(cocalib, made, clicks_file, tmp_path):
    recording = made()
    exact = cocalib("solve", recording, "--clicks", clicks_file)
    document = json.loads(clicks_file.read_text())
    for click in document["clicks"][:3]:
        click["image_time"]["nanosec"] += 1_000_000
    (tmp_path / "rounded.json").write_text(json.dumps(document))
    rounded = cocalib("solve", recording, "--clicks", tmp_path / "rounded.json")
    assert rounded.code == 0
    assert rounded.out == exact.out
    assert rounded.err.endswith(exact.err)
    notes = rounded.err.removesuffix(exact.err).splitlines()
    assert len(notes) == 3
    assert re.search("c0 at 1700000002.001000000 s.*frame 5", notes[0])


def test_nan_returns_do_not_shift_the_clicks(solved, cocalib, made, clicks_file, tmp_path):
    """The authors' script drops NaN rows from the radar list only; here each click keeps its returns."""
    holed = tmp_path / "holed.json"
    assert cocalib("solve", made("holed", nan_scans=3), "--clicks", clicks_file, "--out", holed).code == 0
    pairs, holed_pairs = (json.loads(path.read_text())["pairs"] for path in (solved, holed))
    assert [pair["id"] for pair in pairs] == [pair["id"] for pair in holed_pairs]
    for pair, holed_pair in zip(pairs, holed_pairs, strict=True):
        assert holed_pair["radar_m"] == pytest.approx(pair["radar_m"], abs=0.01)


def test_solve_prints_the_same_bytes_for_shuffled_clicks(cocalib, clicks_file, solved, tmp_path):
    document = json.loads(clicks_file.read_text())
    document["clicks"].reverse()
    clicks_file.write_text(json.dumps(document))
    answer = cocalib("solve", tmp_path / "made.mcap", "--clicks", clicks_file)
    assert (answer.code, answer.out) == (0, solved.read_text())


@pytest.mark.slow
def test_solve_refines_the_intrinsics_and_solves_its_file_again(cocalib, pairs_file, tmp_path):
    out, again, plain = (tmp_path / name for name in ("refined.json", "again.json", "plain.json"))
    answer = cocalib("solve", "--pairs", pairs_file, "--out", out, "--refine-intrinsics")
    assert answer.code == 0, answer.err
    assert "intrinsics were refined" in answer.out
    document = json.loads(out.read_text())
    assert document["options"]["refining"]["intrinsics"] is True
    assert document["given_camera"]["matrix_px"] != document["camera"]["matrix_px"]
    assert document["camera"]["covariance"]["order"][:2] == ["fx_px", "fy_px"]
    assert cocalib("solve", "--pairs", out, "--out", again).code == 0
    assert json.loads(again.read_text()) | {"provenance": 0} == document | {"provenance": 0}
    assert cocalib("solve", "--pairs", out, "--out", plain, "--set", "refining.intrinsics=false").code == 0
    assert json.loads(plain.read_text())["camera"] == document["given_camera"]
    assert cocalib("check", again, "--of", out).code == 0


def test_info_names_the_topics_as_text_and_as_json(cocalib, made):
    names = {"/radar/points", "/camera/image/compressed", "/camera/camera_info"}
    text, data = cocalib("info", made()), cocalib("info", made("again"), "--json")
    assert [name for name in names if name not in text.out] == []
    assert {topic["name"] for topic in json.loads(data.out)["topics"]} == names


def test_info_counts_the_placements(cocalib, sample):
    last = cocalib("info", sample / "radar.bag", sample / "camera.bag").out.splitlines()[-1]
    assert last.startswith("placements  20 ")


def test_info_writes_each_warning_with_its_code_message_and_hint(cocalib, made):
    recording = made("cut")
    recording.write_bytes(recording.read_bytes()[:-9])
    for key, flags in (("cautions", ()), ("warnings", ("--verify",))):
        warnings = json.loads(cocalib("info", recording, *flags, "--json").out)[key]
        assert [set(warning) for warning in warnings] == [{"code", "message", "hint"}]
        assert all(warning["message"] and warning["hint"] for warning in warnings)


@pytest.mark.parametrize(
    ("command", "source"),
    [
        ("export {} --to urdf", "calibration.json"),
        ("import {}", "calibration.json"),
        ("solve --pairs {}", "calibration.json"),
        ("solve --pairs {}", "pairs.json"),
    ],
)
def test_a_file_is_read_once_and_may_be_a_pipe(cocalib, solved, pairs_file, tmp_path, command, source):
    reading, writing = os.pipe()
    os.write(writing, (tmp_path / source).read_bytes())
    os.close(writing)
    try:
        answer = cocalib(*command.format(f"/dev/fd/{reading}").split(), "--out", tmp_path / "out")
    finally:
        os.close(reading)
    assert answer.code == 0, answer.err
    assert cocalib("check", tmp_path / "out", "--against", solved, "--max-deg", 1, "--max-px", 20).code == 0


def test_export_without_out_prints_and_into_a_folder_names_itself(cocalib, solved, tmp_path):
    printed = cocalib("export", solved, "--to", "urdf").out
    folder = tmp_path / "exports"
    folder.mkdir()
    assert cocalib("export", solved, "--to", "urdf", "--out", folder).code == 0
    (written,) = folder.iterdir()
    assert written.read_text() == printed


def test_import_takes_the_image_size_for_a_lens_without_one_and_the_file_beside_a_kitti_calibration(cocalib, tmp_path):
    files = {file.name: file for file in (*TOOLS, *DATA_SETS)}
    for name in ("koide3", "KITTI odometry", "KITTI raw"):
        folder, file = tmp_path / name, files[name]
        folder.mkdir()
        for path, content in {**file.beside, file.file_name: file.content}.items():
            (folder / path).write_text(str(content), encoding="utf-8")
        out = folder / "calibration.json"
        has_size = "size" in file.holds_camera
        if not has_size:
            refused = cocalib("import", folder / file.file_name, "--out", out)
            assert "--image-size WIDTH HEIGHT" in refused.err
        size = [] if has_size else ["--image-size", *map(str, SIZE)]
        assert cocalib("import", folder / file.file_name, "--out", out, *size).code == 3
        written = read_calibration(out.read_text(encoding="utf-8")).calibration
        np.testing.assert_allclose(written.camera_from_radar.as_matrix(), CAMERA_FROM_RADAR, atol=1e-6)
        assert (written.camera.width_px, written.camera.height_px) == SIZE
        assert len(written.camera.distortion) == (5 if "lens" in file.holds_camera else 0)


def test_the_format_decides_which_returns_a_pose_is_for_unless_the_user_does(cocalib, tmp_path):
    errors = SystematicErrors(azimuth_scale=0.04, range_bias_m=0.05)
    drawn = simulate_pairs(14, rng=np.random.default_rng(12), noise="imaging", systematic=errors)
    calibration = tmp_path / "calibration.json"
    cc.write_calibration(calibration, calibrate_pairs(drawn.pairs, drawn.camera).unwrap())
    for name, wanted, raw in (("opencv", (), True), ("tf2", (), False), ("tf2", ("--for", "raw"), True)):
        out = tmp_path / name
        answer = cocalib("export", calibration, "--to", name, *wanted, "--out", out)
        assert (answer.code, read_any(out.read_bytes()).for_raw) == (0, raw)
        assert f"--for {'corrected' if raw else 'raw'} (the camera moves " in answer.err
        assert cocalib("check", out, "--of", calibration).code == 0
    every = tmp_path / "all"
    assert cocalib("export", calibration, "--to", "all", "--for", "corrected", "--out", every).code == 0
    assert not read_any((every / "radar_camera.yml").read_bytes()).for_raw
    urdf = every / "radar_camera.urdf"
    changed = cocalib("export", calibration, "--into", urdf, "--for", "raw")
    assert changed.code == 0
    assert "--for corrected" in changed.err
    assert changed.out


def test_all_formats_are_written_and_those_that_cannot_hold_the_calibration_say_why(cocalib, golden, tmp_path):
    folder = tmp_path / "exports"
    answer = cocalib("export", golden, "--to", "all", "--out", folder)
    assert answer.code == 0
    lines = dict(line.split(": ", 1) for line in answer.out.splitlines())
    assert set(lines) == {known.name for known in written_formats()}
    written, refused = export_all(read_calibration(golden.read_bytes()))
    for name, made in written.items():
        assert lines[name] == f"written to {folder / made.file_name}"
        assert (folder / made.file_name).read_bytes() == made.data
    for one in refused:
        assert lines[one.name] == f"not written: {one.reason}"
    beside = {extra.file_name for made in written.values() for extra in made.extra_files}
    assert beside == {"rectification.npz"}
    assert {path.name for path in folder.iterdir()} == {made.file_name for made in written.values()} | beside
    (note,) = (line for line in answer.err.splitlines() if line.endswith(POSE_ONLY))
    assert note.startswith("note: tf2, tf2-launch-py, ")
    assert "5 m to 15" in answer.err


def test_all_formats_take_the_parent_and_the_rectified_images_where_they_apply(cocalib, golden, tmp_path):
    parent = ["--parent-from-radar", "1.5", "0", "0.25", "0", "0", "0", "1"]
    answer = cocalib("export", golden, "--to", "all", "--out", tmp_path / "a", "--rectified", *parent)
    assert answer.code == 0
    assert "kitti: written to" in answer.out
    assert "x: 1.5" in (tmp_path / "a" / "sensor_kit_calibration.yaml").read_text()


def test_camera_info_is_exported_and_read_by_the_camera_option(cocalib, solved, tmp_path):
    info, back = tmp_path / "camera_info.yaml", tmp_path / "back.json"
    written = cocalib("export", solved, "--to", "camera-info", "--out", info)
    assert written.code == 0
    assert "the camera only" in written.err
    assert "no pose" in cocalib("check", info).err
    tf2 = tmp_path / "tf.sh"
    assert cocalib("export", solved, "--to", "tf2", "--out", tf2).code == 0
    assert cocalib("import", tf2, "--camera", info, "--out", back).code == 0
    cameras = [read_calibration(path.read_text()).calibration.camera for path in (solved, back)]
    assert np.array_equal(cameras[0].matrix_px, cameras[1].matrix_px)


@pytest.mark.slow
def test_import_takes_the_camera_matrix_of_a_kitti_calibration(cocalib, solved, tmp_path):
    kitti, back = tmp_path / "calib" / "00000.txt", tmp_path / "back.json"
    kitti.parent.mkdir()
    assert cocalib("export", solved, "--to", "kitti", "--rectified", "--out", kitti).code == 0
    refused = cocalib("import", kitti, "--out", back)
    assert refused.code == 2
    assert "--image-size WIDTH HEIGHT" in refused.err
    assert cocalib("import", kitti, "--out", back, "--image-size", "320", "240").code == 0
    (tmp_path / "image_2").mkdir()
    cv2.imwrite(str(tmp_path / "image_2" / "00000.png"), np.zeros((240, 320, 3), np.uint8))
    beside = tmp_path / "beside.json"
    answer = cocalib("import", kitti, "--out", beside)
    assert "size 320 x 240" in answer.err
    cameras = [json.loads(path.read_text())["camera"] for path in (back, beside)]
    assert cameras[0] == cameras[1]
    assert (cameras[0]["model"], cameras[0]["width_px"], cameras[0]["height_px"]) == ("pinhole", 320, 240)
    written = next(line for line in kitti.read_text().splitlines() if line.startswith("P2")).split()[1:]
    np.testing.assert_allclose(np.ravel(cameras[0]["matrix_px"])[[0, 2]], [float(written[0]), float(written[2])])


@pytest.mark.slow
def test_a_format_without_a_place_for_distortion_is_written_for_rectified_images_with_the_maps_beside_it(
    cocalib, solved, tmp_path
):
    out = tmp_path / "calib.txt"
    refused = cocalib("export", solved, "--to", "kitti")
    assert refused.code == 2
    assert "or folder: --out" in refused.err
    written = cocalib("export", solved, "--to", "kitti", "--out", out)
    assert written.code == 0
    assert f"written to {tmp_path / 'rectification.npz'}" in written.out
    assert "maps in rectification.npz" in written.err
    assert "say so with --rectified" in written.err
    assert cocalib("check", out, "--against", solved).code == 0
    with np.load(tmp_path / "rectification.npz") as maps:
        matrix_px = maps["K_new"]
        assert maps["map_x"].shape == tuple(maps["image_size_px"][::-1])
    assert f"P2: {float(matrix_px[0, 0])!r} " in out.read_text()

    written = cocalib("export", solved, "--to", "kitti", "--rectified", "--out", out)
    assert written.code == 0
    assert "for rectified images" in written.err
    assert cocalib("check", out, "--against", solved).code == 0
    assert cocalib("export", solved, "--to", "opencv", "--rectified").code == 2


def test_the_demo_of_another_version_has_a_session_of_its_own(tmp_path, monkeypatch):
    sessions: list[Path] = []

    def serve(choice: Choice, _serving: Serving) -> int:
        assert choice.session is not None
        sessions.append(choice.session)
        return 0

    monkeypatch.setattr("cocalib.opening.serve", serve)
    for sample in ("first", "first", "second"):
        (tmp_path / sample / "rooftop").mkdir(parents=True, exist_ok=True)
        for bag in ("radar.bag", "camera.bag"):
            (tmp_path / sample / "rooftop" / bag).write_text(f"{bag} of the {sample} version")
        monkeypatch.setattr(demo, "sample_folder", partial(tmp_path.__truediv__, sample))
        assert demo.Demo(serving=ServingFlags(no_browser=True, port=0)).run() == 0
    assert sessions[0] == sessions[1]
    assert sessions[2] != sessions[0]


def test_a_calibration_is_solved_again_and_only_typed_options_change(cocalib, pairs_file, tmp_path):
    first, again, turned = (tmp_path / f"{name}.json" for name in ("first", "again", "turned"))
    position = ("--camera-position-m", "0.1", "0", "0.05", "--camera-position-sigma-m", "0.02")
    assert cocalib("solve", "--pairs", pairs_file, "--method", "paper", *position, "--out", first).code == 0
    assert cocalib("solve", "--pairs", first, "--out", again).code == 0
    assert (
        cocalib(
            "solve", "--pairs", first, "--method", "default", "--camera-position-by", "antenna", "--out", turned
        ).code
        == 0
    )  # both are the defaults: typed, they replace what the file says
    texts = [json.loads(path.read_text()) for path in (first, again, turned)]
    assert {key: value for key, value in texts[0].items() if key != "provenance"} == {
        key: value for key, value in texts[1].items() if key != "provenance"
    }
    assert texts[2]["options"]["method"] == "default"
    assert texts[2]["options"]["solving"]["camera_position"] == {"position_m": [0.1, 0.0, 0.05], "sigma_m": 0.02}


def test_a_table_of_pairs_is_solved_with_a_camera(cocalib, pairs_file, tmp_path):
    pairs, table = pairs_file, tmp_path / "pairs.csv"
    rows = [(*pair["radar_m"], *pair["pixel_px"]) for pair in json.loads(pairs.read_text())["pairs"]]
    table.write_text("x_m,y_m,z_m,u_px,v_px\n" + "".join(f"{','.join(map(str, row))}\n" for row in rows))
    assert cocalib("solve", "--pairs", table, "--camera", pairs, "--out", tmp_path / "a.json").code == 0
    names = [one["name"] for one in json.loads((tmp_path / "a.json").read_text())["provenance"]["inputs"]]
    assert names == ["pairs.csv", pairs.name]


def test_a_recording_toml_beside_the_recording_is_written_read_told_and_kept(cocalib, made, clicks_file, tmp_path):
    recording, out = made(), tmp_path / "out.json"
    assert cocalib("info", recording, "--write").code == 0
    (file,) = tmp_path.rglob("recording.toml")
    assert tomllib.loads(file.read_text()) == {
        "radar_topic": "/radar/points",
        "image_topic": "/camera/image/compressed",
        "camera_info_topic": "/camera/camera_info",
    }
    assert cocalib("info", recording, "--write").code == 2, "never over another one"
    file.write_text('clock = "receive"\nimage_topic = "/camera/image/compressed"\n')
    told = cocalib("solve", recording, "--clicks", clicks_file, "--out", out)
    assert 'clock = "receive", image_topic' in told.err
    (kept,) = (one for one in json.loads(out.read_text())["provenance"]["inputs"] if one["name"] == "recording.toml")
    assert kept["sha256"] == hashlib.sha256(file.read_bytes()).hexdigest()
    typed = cocalib("info", recording, "--clock", "header")
    assert "clock" not in typed.err
    assert "using" not in cocalib("info", recording, "--no-recording-file").err


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x = 1", "unknown key 'x'; it may have radar_topic"),
        ("clock = 'wall'", "recording.toml: Invalid enum value 'wall'"),
        ("clock =", "recording.toml: not valid TOML"),
        ("map = " + "[" * 5000, "recording.toml: nested too deeply"),
        ("clock = '\udcff'", "recording.toml: 'utf-8' codec can't decode byte 0xff"),
        ("radar_axes = 'forward,left,up'", "unknown key 'radar_axes'"),
        ("image_topic = '/none'", "no topic /none"),
    ],
)
def test_a_recording_toml_that_states_nothing_known_is_refused(cocalib, made, clicks_file, text, words):
    recording = made()
    (recording.parent / "recording.toml").write_bytes(text.encode(errors="surrogateescape"))
    answer = cocalib("solve", recording, "--clicks", clicks_file)
    assert answer.code == 2
    assert words in answer.err


def test_a_recording_toml_of_two_recordings_serves_one_of_them(cocalib, made):
    alone = made("alone", with_images=False, with_camera_info=False)
    (alone.parent / "recording.toml").write_text(
        'image_topic = "/camera/image/compressed"\nradar_topic = "/radar/points"\n'
    )
    answer = cocalib("info", alone)
    assert answer.code == 0
    assert answer.err.endswith('radar_topic = "/radar/points"\n')
