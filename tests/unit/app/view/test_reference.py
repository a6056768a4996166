"""A calibration given for review: shown until the clicks give a new one, then compared with it."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from calib_core.association.placements import Placement
from calib_core.errors import InputError
from calib_core.interchange.exporting import export
from calib_core.interchange.formats.registry import FORMATS, format_named
from calib_core.interchange.importing import adoption, read_any
from calib_core.interchange.own.calibration_json import read_calibration, write_calibration
from calib_core.measurements import (
    RadarScan,
    RadarScans,
    ReflectorClick,
    TimeNs,
    Unsolvable,
)
from calib_core.radar import RadarErrors
from cocalib.evaluation.evaluating import check_clicks
from cocalib.opening.opened import GivenCalibration
from cocalib.session.applying import History
from cocalib.session.state import RecordingFacts, Session
from cocalib.view.build import view
from cocalib.view.reference import Reference, shown_calibration
from cocalib.web.radar_sight import overlay_of

FEW = Unsolvable.reported("too-few-pairs", "1 of 4 pairs", "click more placements")


@pytest.fixture
def facts(file) -> RecordingFacts:
    camera = file.calibration.camera
    return RecordingFacts("drive", np.arange(5, dtype=np.int64) * 10**8, camera.width_px, camera.height_px)


@pytest.fixture
def reference(file) -> Reference:
    return Reference("other.yaml", file.calibration)


def clicked(count: int) -> tuple[ReflectorClick, ...]:
    return tuple(ReflectorClick(TimeNs(index * 10**8), f"c{index + 1}", 100.0, 120.0) for index in range(count))


def test_without_clicks_the_screen_shows_the_file_and_says_so(facts, reference):
    seen = view(History(), facts, reference)
    assert "from other.yaml; " in seen.status
    assert [figure.key for figure in seen.pose][:3] == ["camera_x", "camera_y", "camera_z"]
    assert (seen.has_calibration, seen.comparison) == (False, ())
    assert overlay_of(0, Session(), None, (), reference).returns == ()
    assert overlay_of(0, Session(), None, ()).returns is None


def test_a_pose_that_is_hardly_known_expects_the_reflector_nowhere(file):
    ahead = Placement(TimeNs(0), TimeNs(0), np.array([6.0, 0.5, -0.4]), 0.0)
    for covariance, count in ((1e-6, 1), (1.0, 0)):
        pose = Reference("other.yaml", dataclasses.replace(file.calibration, covariance=covariance * np.eye(6)))
        assert len(overlay_of(0, Session(), None, (ahead,), pose).guesses) == count


def test_the_first_click_already_has_a_residual_against_it(facts, reference):
    point, stamps = np.array([6.0, 0.5, -0.4]), [TimeNs(10**8 + step * 5 * 10**7) for step in range(-4, 5)]
    pixel = reference.calibration.reproject(point[None])[0] + [3.0, 4.0]
    click = ReflectorClick(TimeNs(10**8), "c1", float(pixel[0]), float(pixel[1]))
    one = [RadarScan(time, point[None], np.zeros(1), np.full(1, 20.0), np.full((1, 3), np.nan)) for time in stamps]
    radar = SimpleNamespace(radar_scans_around=lambda times, half_window_s: RadarScans.from_scans(one))

    (checked,) = check_clicks(radar, (click,), reference.calibration, Session().options)
    assert checked.excluded
    assert checked.distance_px == pytest.approx(5.0, abs=1e-6)
    session = Session((click,), revision=1, outcome=FEW, outcome_revision=1, checked=(checked,))
    seen = view(History(session), facts, reference)
    assert seen.status.endswith(" 1 click: 5.00 px")
    (row,) = seen.clicks
    assert row.state == "pending"
    assert row.residual_px == pytest.approx(5.0, abs=1e-6)
    assert row.range_m == pytest.approx(np.linalg.norm(point), abs=1e-4)


def test_once_solved_the_new_calibration_is_drawn_and_compared(facts, file):
    moved = file.calibration.camera_from_radar.perturbed(np.array([0, 0, 0.05, 0, np.deg2rad(0.5), 0]))
    other = Reference("other.yaml", dataclasses.replace(file.calibration, camera_from_radar=moved))
    session = Session(clicked(4), revision=1, outcome=file.calibration, outcome_revision=1)
    assert shown_calibration(session, other) is file.calibration
    figures = {figure.key: figure for figure in view(History(session), facts, other).comparison}
    assert figures["rotation_apart"].value.startswith("0.5")
    assert {"apart_5_m", "apart_20_m", "apart_60_m"} <= set(figures)
    assert float(figures["apart_60_m"].value) > 1.0
    assert "other.yaml" in figures["rotation_apart"].hint


def test_returns_and_placements_are_drawn_where_the_calibration_reprojects_them(facts, file):
    errors = RadarErrors(azimuth_scale=0.03, elevation_scale=-0.02, range_bias_m=0.1)
    other = Reference("other.json", dataclasses.replace(file.calibration, radar_errors=errors))
    points = np.array([[6.0, 1.5, -0.4], [9.0, -2.0, 0.2]])
    scan = RadarScan(TimeNs(0), points, np.zeros(2), np.full(2, 20.0), np.full((2, 3), np.nan))
    placements = [SimpleNamespace(position_radar_m=point) for point in points]
    overlay = overlay_of(0, Session(), scan, placements, other)
    expected_px = other.calibration.reproject(points)
    assert [(one.u_px, one.v_px) for one in overlay.returns] == [
        pytest.approx(pixel, abs=0.01) for pixel in expected_px
    ]
    assert [one.range_m for one in overlay.returns] == pytest.approx(np.linalg.norm(points, axis=1), abs=1e-3)
    assert [one.pixel_px for one in overlay.guesses] == [pytest.approx(pixel) for pixel in expected_px]
    assert [one.range_m for one in overlay.guesses] == pytest.approx(np.linalg.norm(points, axis=1))
    assert np.abs(expected_px - file.calibration.reproject(points)).max() > 2.0


@pytest.mark.parametrize("name", [form.name for form in FORMATS])
def test_every_format_becomes_calibration_1_and_stays_the_same_calibration(file, name):
    found = read_any(export(file, name, rectified=format_named(name).is_for_rectified).data, name)
    camera = None if found.camera else file.calibration.camera
    text = write_calibration(adoption(found, name, camera=camera).file)
    again = read_calibration(text)
    poses = [one.calibration.camera_from_radar.as_matrix() for one in (again, file)]
    np.testing.assert_allclose(*poses, rtol=0, atol=1e-9)
    assert "NaN" not in text
    assert again.check_point is not None
    if name != "json":
        assert "imported" in {warning.code for warning in again.calibration.warnings}


def test_what_cannot_be_adopted_is_refused_with_a_clear_error(file, tmp_path):
    text, path, calibration = export(file, "tf2").data.decode(), tmp_path / "wrong.sh", file.calibration
    with pytest.raises(InputError, match="tf2 contains no camera"):
        adoption(read_any(text), "x.sh")
    with pytest.raises(InputError, match="omit the other camera"):
        adoption(read_any(write_calibration(file)), "x.json", camera=calibration.camera)
    inverse = dataclasses.replace(calibration, camera_from_radar=calibration.camera_from_radar.inverse())
    swapped = export(dataclasses.replace(file, calibration=inverse), "tf2").data.decode()
    path.write_text("\n".join(text.splitlines()[:-3] + swapped.splitlines()[-3:]))
    with pytest.raises(InputError, match="swapped"):
        GivenCalibration.read(path).shown(calibration.camera)
    path.write_text(text)
    assert GivenCalibration.read(path).shown(calibration.camera).reference.name == "wrong.sh"


def test_a_calibration_brings_its_camera_where_it_fits_the_frames(file, tmp_path):
    path = tmp_path / "c.json"
    path.write_text(write_calibration(file))
    camera = file.calibration.camera
    given = GivenCalibration.read(path)
    assert given.camera((camera.width_px, camera.height_px)) is not None
    assert given.camera((camera.width_px + 1, camera.height_px)) is None
