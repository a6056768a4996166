"""The report's HTML: deterministic, self-contained, well-formed, escaped, honest about what is not known."""

import re
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from calib_core.errors import InputError
from calib_core.evaluation.figures import Evaluation
from calib_core.geometry import quaternion_wxyz_from_matrix
from calib_core.interchange.calibration_file import AssumptionNote, Provenance, VehicleNote
from calib_core.interchange.exporting import export
from calib_core.interchange.importing import read_any
from calib_core.results import DataWarning
from calib_core.results.verdict import stated_error
from cocalib.report.making import known_calibration, subject_of
from cocalib.report.page import report_html
from cocalib.report.sections.acceptance import limits_met
from cocalib.report.subject import RecordingEvidence, ReportSubject
from cocalib.view.wording import plain
from tests.unit.app.report.planted import FILE, box_figures, golden, subject_for, watched_recording

_HTML = "{http://www.w3.org/1999/xhtml}"
_SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture
def subject(project_root: Path) -> ReportSubject:
    return subject_for(project_root)


@pytest.fixture
def full(subject: ReportSubject) -> ReportSubject:
    """A calibration judged on a recording."""
    return replace(subject, recording=watched_recording(), judged=RecordingEvidence(Evaluation(None, box_figures())))


def _parsed(subject: ReportSubject) -> ElementTree.Element:
    return ElementTree.fromstring(report_html(subject).removeprefix("<!DOCTYPE html>\n"))


def _words(subject: ReportSubject) -> str:
    return " ".join("".join(_parsed(subject).find(f"{_HTML}body").itertext()).split())


def test_the_same_inputs_give_the_same_bytes(full, project_root):
    assert report_html(full) == report_html(
        replace(subject_for(project_root), recording=full.recording, judged=full.judged)
    )


def test_it_is_small_and_needs_nothing_from_elsewhere(subject):
    html = report_html(replace(subject, recording=watched_recording()))
    assert len(html.encode()) < 3_000_000
    addresses = re.findall(r'(?:href|src|url\(|action)="?([^"\s)]+)', html)
    assert addresses
    assert all(one.startswith(("data:", "#")) for one in addresses)
    assert not re.search("<script|@import", html)


def test_the_numbers_are_those_of_the_calibration(subject, project_root):
    page, calibration, words = _parsed(subject), golden(project_root), _words(subject)
    pose, metrics = calibration.camera_from_radar, calibration.metrics
    for name, expected in (("camera_from_radar", pose), ("radar_from_camera", pose.inverse())):
        (part,) = (one for one in page.iter(f"{_HTML}div") if one.get("id") == name)
        values = np.array([float(one.attrib["value"]) for one in part.iter(f"{_HTML}data")])
        assert np.array_equal(values[:12].reshape(3, 4)[:, :3], expected.rotation)
        assert np.array_equal(values[:12].reshape(3, 4)[:, 3], expected.translation_m)
        assert np.array_equal(values[12:], quaternion_wxyz_from_matrix(expected.rotation))
    assert f"mean reprojection error (AED){plain(metrics.aed_px)} px" in words
    assert f"freedom{plain(metrics.chi2)} / {metrics.degrees_of_freedom}" in words


def test_every_drawing_and_table_can_be_heard(full):
    page = _parsed(full)
    drawings = [one for one in page.iter(f"{_SVG}svg") if one.get("aria-hidden") != "true"]
    assert len(drawings) >= 14
    assert all(one.get("role") == "img" and one.findtext(f"{_SVG}title") for one in drawings)
    for table in page.iter(f"{_HTML}table"):
        assert all(cell.get("scope") for cell in table.iter(f"{_HTML}th"))
        assert table.find(f".//{_HTML}th") is not None
    levels = [one.tag.removeprefix(_HTML) for one in page.iter() if re.fullmatch(rf"{_HTML}h\d", one.tag)]
    assert levels[:2] == ["h1", "h2"]
    assert levels.count("h1") == 1


def test_text_of_a_recording_or_a_file_stays_text(project_root):
    evil = "<img src=x onerror=alert(1)>"
    warning, calibration = DataWarning.reported("odd", evil, evil), golden(project_root)
    pairs = tuple(replace(one, id=evil) for one in calibration.pairs)
    subject = subject_for(project_root, replace(calibration, pairs=pairs, warnings=(warning,)))
    topics, inputs = (("radar", evil),), (replace(FILE, name=evil),)
    seen = watched_recording(name=evil, topics=topics, warnings=(warning,), inputs=inputs)
    subject = replace(subject, name=evil, recording=seen)
    html = report_html(subject)
    assert "<img" not in html
    assert "&lt;img src=x onerror=alert(1)&gt;" in html
    assert not list(_parsed(subject).iter(f"{_HTML}img"))


def test_what_is_said_of_the_vehicle_hides_nothing_else(subject):
    plain = replace(subject, recording=watched_recording(topics=(("radar", "/r"), ("images", "/i"))))
    topics = {"radar_topic": "/r", "image_topic": "/i", "camera_info_topic": "/c", "radar_axes": "forward,left,up"}
    assumptions = (AssumptionNote("metres", True), AssumptionNote("m/s", True))
    made = Provenance(version="1", **topics, video_start="0", column_map=("x=a:m",), assumptions=assumptions)
    file = replace(plain.found.file, provenance=made)
    note = VehicleNote("V017", "van", "2026-09-21", "R-1", "<img src=x>")

    def facts(vehicle: VehicleNote) -> list[str]:
        subject = replace(plain, found=replace(plain.found, file=replace(file, vehicle=vehicle)))
        assert "<img" not in report_html(subject)
        (section,) = (one for one in _parsed(subject).iter(f"{_HTML}section") if one.get("id") == "provenance")
        rows = ("".join(one.itertext()) for one in section.iter() if one.tag in (f"{_HTML}dt", f"{_HTML}dd"))
        return [f"{name}: {text}" for name, text in zip(rows, rows, strict=True)]

    stated = ["vehicle: V017, of type van", "session: 2026-09-21", "serials: radar R-1, camera <img src=x>"]
    assert facts(VehicleNote())[-1] == "recording, images: /i"
    assert [one for one in facts(note) if one not in stated] == facts(VehicleNote())
    assert [one for one in facts(note) if one in stated] == stated


def test_a_method_without_a_noise_model_gets_no_error_bars_and_no_map(project_root):
    calibration = golden(project_root)
    options = replace(calibration.options, method="paper")
    unknown = np.full((6, 6), np.nan)
    words = _words(subject_for(project_root, replace(calibration, covariance=unknown, options=options)))
    assert "coarse" in words
    assert "states no error" in words
    assert "No error bars" in words
    assert "nothing to draw" in words
    assert " ± " not in words.split("Warnings")[0].replace("Bars: ± two", "")


def test_an_imported_calibration_is_not_judged(subject, project_root):
    found = read_any(str(export(subject.found.file, "tf2").content).encode(), "tf.txt")
    for camera, said in (
        (
            None,
            (
                "so nothing in it says how good the pose is",
                "The file contains no camera, so nothing is said in pixels.",
            ),
        ),
        (
            golden(project_root).camera,
            ("This calibration states no uncertainty, so there is no map of it.", "Imported from tf.txt"),
        ),
    ):
        bare = subject_of(found, known_calibration(found, "tf.txt", camera=camera), "tf.txt")
        words = _words(bare)
        assert (bare.calibration is None) == (camera is None)
        assert [one for one in ("not judged", *said) if one not in words] == []
    assert "Residuals" not in words


def test_acc_comes_with_the_sentence_that_it_is_not_accuracy(full):
    words = _words(full)
    for said in (
        "Acc 58.0 ± 10.0 % over 9 frames (without the frames of 0 %: 87.0 %; turned by 10 deg, which is about chance: 2.0 %)",
        "Acc is not accuracy",
        "Of 9 frames 3 have all returns inside and 3 have none; frames of 0 % are kept.",
        "Best at 5.00 to 10.0 m (95.0 % of 40 returns inside), worst at 0 to 5.00 m (33.3 % of 30 returns inside).",
        "roll 0.1 points; pitch 10.0 points, highest at +1 deg; yaw 38.0 points",
    ):
        assert said in words
    none = replace(box_figures(), acc=None, acc_without_zero_frames=None, chance=None, frames=(), classes=(), ranges=())
    words = _words(replace(full, judged=RecordingEvidence(Evaluation(None, none))))
    assert "Acc is unknown" in words


def test_a_recording_without_clicks_and_boxes_judges_nothing_and_each_file_is_named_once(full):
    idle = replace(full, judged=None, inputs=(FILE,))
    words = _words(idle)
    assert "with radar.bag: without further clicks or boxes, judged by its own pairs" in words
    assert words.count(FILE.sha256) == 1
    assert "this calibration, recording" in words
    assert "judged on radar.bag" in _words(full)


def test_many_pairs_are_cut_to_those_with_the_largest_residuals_and_few_or_none_reported_too(project_root):
    calibration = golden(project_root)
    one = calibration.pairs[0]
    many = tuple(replace(one, id=f"n{k}", projected_px=np.add(one.pixel_px, (k, 0.0))) for k in range(100))
    words = _words(subject_for(project_root, replace(calibration, pairs=many)))
    assert "30 of 100 clicks" in words
    assert [name for name in ("n99", "n70", "n69 ") if name in words] == ["n99", "n70"]
    for size in (0, 1, 2):
        assert "Answer" in _words(subject_for(project_root, replace(calibration, pairs=calibration.pairs[:size])))
    lost = tuple(replace(one, projected_px=np.full(2, np.nan)) for one in calibration.pairs)
    words = _words(subject_for(project_root, replace(calibration, pairs=lost)))
    assert "There are no residuals" in words


def test_limits_are_met_or_not_by_the_stated_error_and_there_is_room_to_sign(subject, project_root):
    stated = stated_error(golden(project_root))
    required = (f"max-deg={stated.rotation_deg}", f"max-cm={stated.position_cm * 0.99}")
    assert [one.met for one in limits_met(required, golden(project_root))] == [True, False]
    assert [one.met for one in limits_met(required, None)] == [False, False]
    words = _words(replace(subject, required=required))
    assert [word for word in ("pass", "FAIL") if word not in words] == []
    assert words.index("Signature") > words.index("Provenance")
    assert "FAIL" not in _words(subject)


@pytest.mark.parametrize("text", ["max-deg", "max-deg=0", "max-deg=nan", "deg=1", "max-cm=few"])
def test_what_is_no_limit_is_refused(text):
    with pytest.raises(InputError, match=f"--require {text}: give max-deg=NUMBER"):
        limits_met((text,), None)


def test_the_returns_are_drawn_where_the_calibration_puts_them(subject, project_root):
    camera, seen = golden(project_root).camera, watched_recording()
    image = replace(seen.image, returns_px=((-0.5, -0.5), (camera.width_px - 0.5, 9.5)))
    page = _parsed(replace(subject, recording=replace(seen, image=image)))
    rings = [one for one in page.iter(f"{_SVG}circle") if one.get("class") == "return"]
    assert [one.get("cx") for one in rings] == ["0", "320"]
    assert rings[0].get("cy") == "0"
