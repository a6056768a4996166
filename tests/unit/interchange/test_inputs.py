"""clicks-1, pairs-1 and calibration-1: their content reads back, and invalid content is refused with a clear error."""

import dataclasses
import io
import json
import math
import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulated_pairs import simulate_pairs
from calib_core.calibration import calibrate_pairs, solve_again
from calib_core.errors import InputError
from calib_core.interchange.calibration_file import FrameNames, Provenance, choose_check_point
from calib_core.interchange.own.calibration_json import calibration_text, read_calibration, write_calibration
from calib_core.interchange.own.clicks_json import read_clicks, read_clicks_file, write_clicks
from calib_core.interchange.own.pairs_files import read_pairs, write_pairs
from calib_core.interchange.pair_tables import read_pair_table
from calib_core.measurements import Candidate, Pair, ReflectorClick, TimeNs, time_from_parts
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration, UnconfirmedClicks

CAMERA = {"model": "pinhole", "width_px": 640, "height_px": 480, "matrix_px": [[500, 0, 320], [0, 500, 240], [0, 0, 1]]}


def pairs_text(pair: object = None, **changes: object) -> str:
    pair = pair or {"id": "p1", "radar_m": [5, 1, -0.5], "pixel_px": [212.9, 239.4]}
    content = {"schema": "cocalib/pairs-1", "camera": CAMERA, "pairs": [pair], **changes}
    return json.dumps({key: value for key, value in content.items() if value is not None})


def test_clicks_come_back_in_order_of_time_with_every_nanosecond():
    late = ReflectorClick(time_from_parts(1_700_000_001, 999_999_999), "c1", 10.25, 20.5)
    early = ReflectorClick(time_from_parts(1_700_000_001, 999_999_998), "c2", -0.4, 1e-7, sigma_px=0.5, excluded=True)

    text = write_clicks([late, early])

    assert read_clicks(text) == (early, late)
    assert write_clicks([early, late]) == text
    assert json.loads(text)["clicks"][1] == {
        "id": "c1",
        "image_time": {"sec": 1_700_000_001, "nanosec": 999_999_999},
        "pixel_px": [10.25, 20.5],
    }


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"radar_mm": [5, 1, 0]}, "pairs[0].radar_mm: unknown key; did you mean radar_m?"),
        ({"radar_m": [5, 1]}, "pairs[0].radar_m: expected array of length 3, got 2"),
        ({"radar_m": [5, 1, None]}, "pairs[0].radar_m[2]: is null, expected float; give its value or remove the entry"),
        ({"radar_m": [5, 1, math.nan]}, "pairs[0].radar_m[2]: nan is not a valid number"),
        ({"pixel_px": [math.inf, 1]}, "pairs[0].pixel_px[0]: inf is not a valid number"),
        ({"radar_m": [0, 0, 0]}, "pairs[0].radar_m: is at the radar's origin"),
        ({"alternatives_radar_m": [[0, 0, 0]]}, "pairs[0].alternatives_radar_m[0]: is at the radar's origin"),
        ({"radar_m": [0.001, 0, 0]}, "pairs[0].radar_m: is 1 mm from the radar's origin"),
        ({"sigma_px": 0}, "pairs[0].sigma_px: expected float >= 1e-12"),
        ({"sigma_px": "2"}, "pairs[0].sigma_px: expected float | null, got str"),
        ({"id": ""}, "pairs[0].id: expected str of length >= 1"),
        ({"pixel_px": [True, 1]}, "pairs[0].pixel_px[0]: expected float, got bool"),
    ],
)
def test_a_fault_in_a_pair_is_named_with_its_place_and_what_to_do(change, words):
    pair = {"id": "p1", "radar_m": [5, 1, -0.5], "pixel_px": [212.9, 239.4], **change}

    with pytest.raises(InputError) as refusal:
        read_pairs(pairs_text(pair), "my_pairs.json")

    assert str(refusal.value).startswith(f"my_pairs.json: {words}")
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "the file is empty"),
        ("[1]", "expected an object in braces, found a list"),
        ('{"schema": "cocalib/pairs-1",}', "line 1, column 30: not JSON"),
        ('{"schema": "cocalib/pairs-1", "a": 1, "a": 2}', "the key 'a' appears twice in one object"),
        ("[" * 100_000, "nested too deeply"),
        (
            '{"schema": "cocalib/clicks-1"}',
            "this is a cocalib/clicks-1 file, not cocalib/pairs-1; give them with their recording: cocalib solve",
        ),
        ('{"pairs": []}', "schema: expected 'cocalib/pairs-1', found none"),
        (pairs_text(camera=None), "camera: missing; add it"),
        (
            pairs_text(camera={**CAMERA, "model": "pinhle"}),
            "camera.model: unknown value 'pinhle'; did you mean pinhole?",
        ),
        (pairs_text(camera={**CAMERA, "distortions": []}), "camera.distortions: unknown key; did you mean distortion?"),
        (pairs_text(camera={**CAMERA, "distortion": [1, 2]}), "camera: pinhole takes 0 distortion coefficients, got 2"),
        (pairs_text(radar={"sigma_range": 1}), "radar.sigma_range: unknown key; did you mean sigma_range_m?"),
        (pairs_text(zebra=1), "zebra: unknown key; known keys: schema, camera, pairs, radar,"),
        (pairs_text().replace("212.9", "1e999"), "pairs[0].pixel_px[0]: inf is not a valid number"),
    ],
)
def test_a_fault_in_a_file_is_named_with_its_place(text, words):
    with pytest.raises(InputError) as refusal:
        read_pairs(text, "p.json")

    assert str(refusal.value).startswith(f"p.json: {words}")


def test_two_entries_with_the_same_id_are_refused():
    pair = {"id": "p1", "radar_m": [5, 1, -0.5], "pixel_px": [212.9, 239.4]}
    with pytest.raises(InputError, match=r"pairs\[0\] and pairs\[2\]: both have the id 'p1'; give each its own"):
        read_pairs(pairs_text(pairs=[pair, {**pair, "id": "p2"}, pair]))

    click = {"id": "c1", "image_time": {"sec": 1, "nanosec": 0}, "pixel_px": [1, 2]}
    with pytest.raises(InputError, match=r"clicks\[0\] and clicks\[1\]"):
        read_clicks(json.dumps({"schema": "cocalib/clicks-1", "clicks": [click, click]}))


@pytest.mark.parametrize("stamp", [{"sec": 1, "nanosec": 1_000_000_000}, {"sec": -1, "nanosec": 0}, {"sec": 1}, 1.5])
def test_an_invalid_stamp_is_refused(stamp):
    click = {"id": "c1", "image_time": stamp, "pixel_px": [1, 2]}

    with pytest.raises(InputError, match=r"clicks\[0\]\.image_time"):
        read_clicks(json.dumps({"schema": "cocalib/clicks-1", "clicks": [click]}))


def test_what_a_pairs_file_states_overrides_the_options():
    position = {"position_m": [0.1, 0.2, 0.3], "sigma_m": 0.02}
    text = pairs_text(radar={"sigma_range_m": 0.1, "sigma_azimuth_rad": 0.02}, camera_position_in_radar=position)

    pairs_file = read_pairs(text)
    options = pairs_file.options(CalibrationOptions())

    assert options.noise.sigma_range_m == 0.1
    assert options.noise.sigma_azimuth_deg == pytest.approx(math.degrees(0.02))
    assert options.noise.sigma_elevation_deg == CalibrationOptions().noise.sigma_elevation_deg
    assert options.solving.camera_position.position_m == (0.1, 0.2, 0.3)
    candidate = pairs_file.pairs[0].candidates[0]
    np.testing.assert_allclose(candidate.sigma_polar, [0.1, 0.02, math.radians(1.0)])
    range_m = np.linalg.norm(candidate.position_radar_m)
    along = candidate.position_radar_m / range_m
    assert along @ candidate.covariance_m2 @ along == pytest.approx(0.1**2)


def test_pairs_come_back_with_their_alternatives_and_give_the_same_bytes():
    pair = {"id": "p1", "radar_m": [5, 1, 0], "pixel_px": [1, 2], "alternatives_radar_m": [[6, 1, 0]], "sigma_px": 0.5}
    pairs_file = read_pairs(pairs_text(pair, radar={"sigma_range_m": 0.1}))

    text = write_pairs(pairs_file)

    assert write_pairs(read_pairs(text)) == text
    assert [candidate.score for candidate in pairs_file.pairs[0].candidates] == [0.5, 0.5]
    assert json.loads(text)["pairs"][0]["alternatives_radar_m"] == [[6.0, 1.0, 0.0]]


def test_a_calibration_reads_back_and_writes_the_same_bytes(golden_text):
    file = read_calibration(golden_text)

    assert write_calibration(file) == golden_text
    assert [pair.id for pair in file.calibration.pairs if pair.excluded] == ["c4"]
    assert file.calibration.pairs[1].image_time == 1_700_000_010_123_456_789
    assert file.provenance.inputs[0].sha256 == "ab" * 32
    assert file.frames == FrameNames("radar", "camera_optical")


def test_what_another_processor_derived_keeps_its_last_digit(golden_text):
    content = json.loads(golden_text)
    for numbers in (
        *(content["camera_from_radar"]["quaternion_wxyz"], content["radar_from_camera"]["translation_m"]),
        *(content["radar_from_camera"]["quaternion_wxyz"], content["pairs"][0]["residual_px"]),
    ):
        numbers[:] = [math.nextafter(number, 9.0) for number in numbers]
    content["pairs"][0]["distance_px"] = math.nextafter(content["pairs"][0]["distance_px"], 9.0)
    content["sigma"] = {key: math.nextafter(sigma, 9.0) for key, sigma in content["sigma"].items()}

    assert json.loads(write_calibration(read_calibration(json.dumps(content)))) == content


def test_what_is_derived_follows_a_pose_that_was_changed(golden_text):
    file = read_calibration(golden_text)
    moved = file.calibration.camera_from_radar.perturbed(np.array([1e-6, 0.0, 0.0, 0.0, 0.0, 1e-6]))
    changed = dataclasses.replace(file, calibration=dataclasses.replace(file.calibration, camera_from_radar=moved))

    again = read_calibration(write_calibration(changed)).calibration.camera_from_radar

    assert np.array_equal(again.as_matrix(), moved.as_matrix())
    stated = json.loads(write_calibration(changed))["radar_from_camera"]["translation_m"]
    np.testing.assert_allclose(stated, moved.inverse().translation_m, rtol=0, atol=1e-15)


def test_what_is_unknown_is_null_and_never_nan(golden_text):
    content = json.loads(golden_text)
    content["covariance"] = None
    content["metrics"]["cdsd_px"] = None
    content["pairs"][0]["projected_px"] = None
    file = read_calibration(json.dumps(content))

    written = write_calibration(file)

    assert "NaN" not in written
    assert math.isnan(file.calibration.metrics.cdsd_px)
    again = json.loads(written)
    assert again["sigma"]["x_m"] is None
    assert again["pairs"][0]["projected_px"] is None
    assert again["pairs"][0]["distance_px"] is None


def test_transforms_that_disagree_are_refused(golden_text):
    content = json.loads(golden_text)
    content["camera_from_radar"]["quaternion_wxyz"].reverse()
    with pytest.raises(InputError, match=r"quaternion_wxyz and camera_from_radar.rotation are different rotations"):
        read_calibration(json.dumps(content))

    content = json.loads(golden_text)
    content["radar_from_camera"] = content["camera_from_radar"]
    with pytest.raises(InputError, match="radar_from_camera is not the inverse of camera_from_radar"):
        read_calibration(json.dumps(content))


@pytest.mark.parametrize(
    "name",
    [
        "",
        " ",
        "/",
        "a\nb",
        "$(command ls)",
        "${x}",
        'a"b',
        "a\u2028b",
        "x" * 201,
        "<a>",
        "../../etc/passwd",
        "radar/..",
    ],
)
def test_a_frame_name_that_could_do_harm_is_refused(name):
    with pytest.raises(InputError, match="the radar frame"):
        FrameNames(name, "camera")


def test_frame_names_lose_their_leading_slash_and_must_differ():
    assert FrameNames("/ti_mmwave_0", "camera_optical").radar == "ti_mmwave_0"
    assert FrameNames("front/radar..1").radar == "front/radar..1"
    with pytest.raises(InputError, match="both frames are called"):
        FrameNames("sensor", "/sensor")


@pytest.mark.parametrize(
    ("camera", "link"),
    [
        ("camera_optical", "camera_link"),
        ("camera0/camera_optical_link", "camera0/camera_link"),
        ("cam_color_optical_frame", "cam_color_link"),
        ("usb_cam", "usb_cam_body_link"),
        ("camera_link", "camera_body_link"),
    ],
)
def test_the_body_frame_is_named_after_the_optical_one(camera, link):
    assert FrameNames("radar", camera).camera_link == link


def test_the_check_point_is_the_inlier_nearest_to_the_image_centre(golden_text):
    calibration = read_calibration(golden_text).calibration
    check = choose_check_point(calibration)

    centre = np.array([319.5, 239.5])
    distances = {tuple(p.point_radar_m): np.linalg.norm(p.projected_px - centre) for p in calibration.pairs if p.inlier}
    assert tuple(check.radar_m) == min(distances, key=distances.__getitem__)
    np.testing.assert_allclose(check.pixel_px, calibration.reproject(check.radar_m[None])[0], atol=1e-9)


# What a clicks-1 file says of clicks that nobody confirmed.


CLICKS = tuple(ReflectorClick(TimeNs(time), name, 3.0, 4.0) for time, name in ((1, "a"), (2, "b"), (3, "c")))


def test_it_is_read_back():
    unconfirmed = UnconfirmedClicks(("a", "c"), 0.875)
    file = read_clicks_file(write_clicks(CLICKS, unconfirmed=unconfirmed))
    assert (file.clicks, file.unconfirmed) == (CLICKS, unconfirmed)


def test_a_file_whose_clicks_a_person_placed_says_nothing():
    text = write_clicks(CLICKS)
    assert "unconfirmed" not in text
    assert read_clicks_file(text).unconfirmed is None


def test_clicks_that_were_taken_out_of_the_file_no_longer_count():
    text = write_clicks(CLICKS[1:], unconfirmed=UnconfirmedClicks(("a", "c"), 0.875))
    assert read_clicks_file(text).unconfirmed == UnconfirmedClicks(("c",), 0.875)
    assert read_clicks_file(write_clicks(CLICKS[1:2], unconfirmed=UnconfirmedClicks(("a",), 0.9))).unconfirmed is None


@pytest.mark.parametrize("confidence", ["1.5", "-0.1", "null"])
def test_a_confidence_that_is_no_probability_is_refused(confidence):
    text = write_clicks(CLICKS, unconfirmed=UnconfirmedClicks(("a",), 0.875)).replace("0.875", confidence)
    with pytest.raises(InputError, match=r"unconfirmed\.confidence"):
        read_clicks(text)


# What the files say about a radar with several topics.


CLICK = ReflectorClick(TimeNs(1_700_000_000_000_000_000), "c1", 10.0, 20.0)


@pytest.fixture(scope="module")
def solved() -> Calibration:
    simulated = simulate_pairs(rng=np.random.default_rng(3))
    pairs = [replace(pair, candidates=_with_alternative(pair)) for pair in simulated.pairs]
    return calibrate_pairs(pairs, simulated.camera).unwrap()


def _with_alternative(pair: Pair) -> tuple[Candidate, Candidate]:
    best = replace(pair.candidates[0], score=0.5, alternative_of=0)
    elsewhere = best.position_radar_m * [1.0, -1.0, 1.0] + [0.0, 3.0, 0.0]
    return best, replace(best, position_radar_m=elsewhere)


def test_a_calibration_keeps_which_candidates_are_alternatives(solved):
    text = calibration_text(solved)
    read = read_calibration(text).calibration
    for pair in read.pairs:
        assert [one.alternative_of for one in pair.measured.candidates] == [0, 0]
    again = solve_again(read).unwrap()
    assert calibration_text(again) == text


def test_the_provenance_names_all_topics_of_the_radar_and_why_it_was_used(solved):
    provenance = Provenance(radar_topic="/far", radar_topics=("/far", "/near"), radar_choice="/far + /near")
    text = calibration_text(solved, provenance=provenance)
    assert json.loads(text)["provenance"]["topics"] == {
        "radar": "/far",
        "image": None,
        "camera_info": None,
        "radar_all": ["/far", "/near"],
        "radar_choice": "/far + /near",
    }
    assert read_calibration(text).provenance == provenance
    single = Provenance(radar_topic="/radar", radar_topics=("/radar",))
    text = calibration_text(solved, provenance=single)
    assert set(json.loads(text)["provenance"]["topics"]) == {"radar", "image", "camera_info"}
    assert read_calibration(text).provenance == single


def test_clicks_say_which_topics_they_were_made_with_if_there_are_several():
    text = write_clicks([CLICK], radar_topics=("/far", "/near"))
    assert json.loads(text)["radar_topics"] == ["/far", "/near"]
    assert read_clicks(text) == (CLICK,)
    assert write_clicks([CLICK], radar_topics=("/radar",)) == write_clicks([CLICK])
    with pytest.raises(InputError, match="radar_topics"):
        read_clicks(text.replace('"/far"', "7"))


PINHOLE = read_pairs(pairs_text({"id": "p1", "radar_m": [5, 1, 0], "pixel_px": [1, 2]})).camera
TABLE = ((5.0, 1.0, -0.5, 212.9, 239.4), (7.1, 0.2, -0.4, 340.0, 251.5))


@pytest.mark.parametrize("delimiter", [",", ";", "\t", " "])
@pytest.mark.parametrize("head", ["", "x_m y_m z_m u_px v_px", "X Y Z U V"])
def test_a_table_of_pairs_is_read_whatever_stands_between_its_columns(delimiter, head):
    rows = [head.replace(" ", delimiter)] if head else []
    text = "\n".join([*rows, *(delimiter.join(map(str, row)) for row in TABLE), ""])

    table = read_pair_table(text.encode(), source="p.csv")

    assert np.column_stack([table.points_radar_m, table.pixels_px]).tolist() == [list(row) for row in TABLE]
    assert table.ids == ("pair-1", "pair-2")
    assert [one.key for one in table.assumptions] == (["length-unit"] if head.startswith("X") else [])


def test_the_columns_of_a_table_may_have_any_order_and_ids():
    text = b"v_px,u_px,id,z_m,y_m,x_m,note\n239.4,212.9,p7,-0.5,1,5,far\n"
    (pair,) = read_pair_table(text, source="p.csv").pairs(PINHOLE, None, source="p.csv").pairs

    assert (pair.id, *pair.candidates[0].position_radar_m, *pair.pixel_px) == ("p7", *TABLE[0])


def test_a_table_of_pairs_may_have_times():
    text = b"stamp_ms,x_m,y_m,z_m,u,v\n1500,5,1,-0.5,212.9,239.4\n4000,7.1,0.2,-0.4,340,251.5\n"
    pairs = read_pair_table(text, source="p.csv").pairs(PINHOLE, None, source="p.csv").pairs
    assert [pair.image_time for pair in pairs] == [1_500_000_000, 4_000_000_000]
    assert np.array([pair.pixel_px for pair in pairs]).tolist() == [list(row[3:]) for row in TABLE]


SPELLINGS = {
    "mm, commas": b"id;X [mm];Y [mm];Z [mm];u;v\np;5000,0;1000,0;-500,0;212,9;239,4\nq;7100;200;-400;340;251,5\n",
    "units below": b"x y z u v\n[m] [m] [m] [px] [px]\n5.0 1.0 -0.5 212.9 239.4\n7.1 0.2 -0.4 340.0 251.5\n",
    "in a comment": b"# pixel_u, pixel_v, radar_x_m, radar_y_m, z_m\n212.9,239.4,5,1,-0.5\n340,251.5,7.1,0.2,-0.4\n",
    "pixels named x and y": b"x_m,y_m,z_m,img_x,img_y\n5,1,-0.5,212.9,239.4\n7.1,0.2,-0.4,340,251.5\n",
}


@pytest.mark.parametrize("kind", SPELLINGS)
def test_a_table_of_pairs_has_the_spellings_of_a_radar_table(kind):
    table = read_pair_table(SPELLINGS[kind], source="p.csv")
    assert np.allclose(np.column_stack([table.points_radar_m, table.pixels_px]), TABLE)


def saved(save: Callable[..., None], *arrays: np.ndarray, **named: np.ndarray) -> bytes:
    file = io.BytesIO()
    save(file, *arrays, **named)
    return file.getvalue()


def test_pairs_are_read_from_arrays_and_a_radar_without_elevation_has_height_0():
    whole = np.array(TABLE)
    flat = whole[:, [0, 1, 3, 4]]
    for data in (
        saved(np.save, whole),
        saved(np.savez, pcl=whole[:, :3], img=whole[:, 3:]),
        saved(np.savez, pairs=whole),
    ):
        table = read_pair_table(data, source="p.npz")
        assert np.column_stack([table.points_radar_m, table.pixels_px]).tolist() == whole.tolist()
    text = "x_m,y_m,u_px,v_px\n" + "\n".join(",".join(map(str, row)) for row in flat.tolist())
    for data in (saved(np.save, flat), saved(np.savez, img=flat[:, 2:], radar=flat[:, :2]), text.encode()):
        table = read_pair_table(data, source="p.npz")
        assert table.points_radar_m.tolist() == np.column_stack([flat[:, :2], [0.0, 0.0]]).tolist()
        assert table.pixels_px.tolist() == flat[:, 2:].tolist()
    with pytest.raises(InputError, match="savez"):
        read_pair_table(saved(np.save, whole[:, :3]), source="p.npy")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"),
        ("x_m,y_m,z_m,u_px,v_px\n", "no rows"),
        ("a,b\n1,2\n", "the columns are a, b"),
        ("x_m,z_m,u,v\n1,2,3,4\n", "no position columns"),
        ("5,1,-0.5,212.9,239.4\n5,1,-0.5,212.9\n", "line 2: too few columns"),
        ("5,1,-0.5,212.9,239.4\n5,1,-0.5,2", "last row"),
        ("5,1,-0.5,212.9,239.4\n5,1,nan,212.9,239.4\n", "[1]"),
        ("5,1,-0.5,212.9,239.4,p1,6\n", "7 columns"),
        ("0,0,0,212.9,239.4\n", "at the radar's origin"),
    ],
)
def test_a_table_that_is_not_one_of_pairs_is_refused(text, words):
    with pytest.raises(InputError, match=re.escape(words)) as refusal:
        read_pair_table(text.encode(), source="p.csv").pairs(PINHOLE, None, source="p.csv")
    assert str(refusal.value).startswith("p.csv: ")
