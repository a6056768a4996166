"""A slice of the benchmark of lenses: the draws are what they say, and a calibration of drawn corners keeps its sigma."""

import numpy as np
import pytest

from benchmarks.intrinsics.bad_views import planted
from benchmarks.intrinsics.coverage import CASES, CornerErrors, drawn_search
from benchmarks.intrinsics.draws import CHECKERBOARD, FILMS, LENSES, changed_light, drawn_camera, drawn_series, moved
from benchmarks.intrinsics.rendered import measured, scaled_errors
from benchmarks.intrinsics.tables import Table
from calib_core.intrinsics.calibrated_lens import CalibratedLens
from calib_core.intrinsics.calibrating import calibrate_lens

_DRAWS = 6


def test_drawn_corners_give_the_focal_length_and_a_sigma_that_holds():
    scaled, focal = [], []
    for draw in range(_DRAWS):
        series, search = drawn_search([draw, 1], "plumb_bob", CASES["independent 0.1 px"])
        lens = calibrate_lens(search, "plumb_bob")
        assert isinstance(lens, CalibratedLens)
        scaled.append(scaled_errors(lens, series))
        focal.append(lens.camera.matrix_px[0, 0] / series.camera.matrix_px[0, 0] - 1.0)
    assert np.median(np.abs(focal)) < 1e-3
    assert 0.7 < np.sqrt(np.mean(np.square(scaled))) < 1.3  # 1.00 with a standard error of 0.10


def test_rendered_images_give_the_focal_length():
    series = drawn_series([3, 1], "plumb_bob", FILMS["blur and noise"], views=7)
    result = measured(series)
    assert result.views >= 6
    assert abs(result.focal_error) < 2e-3
    assert np.sqrt(np.mean(np.square(result.errors_px))) < 0.1
    assert 0.3 < result.covered < 0.8


@pytest.mark.parametrize("lens", LENSES)
def test_cameras_differ_from_draw_to_draw(lens):
    first, second = (drawn_camera(np.random.default_rng(seed), lens) for seed in (1, 2))
    assert first.model == lens
    assert abs(first.matrix_px[0, 0] - second.matrix_px[0, 0]) > 1.0


def test_light_changes_and_boards_drift_only_where_they_should():
    rng = np.random.default_rng(1)
    for name, film in FILMS.items():
        assert (moved(rng, film) == film) == (name != "rolling shutter")
        assert (changed_light(rng, film) == film) == (name != "changing light")


def test_bad_views_come_after_the_good_ones():
    images, bad = planted([5, 1], views=3)
    assert sorted(bad) == list(range(3, len(images)))
    assert list(bad.values()).count("blurred") == 3
    assert {"mirrored", "another board"} < set(bad.values())
    sharp, blurred = (float(np.abs(np.diff(images.image(i)[..., 0].astype(float))).max()) for i in (0, 3))
    assert blurred < 0.5 * sharp


def test_a_table_is_written_in_markdown():
    text = Table("Speed", ("frames", "time"), (("300", "9 s"),), "On one machine.").text
    assert text == "## Speed\n\nOn one machine.\n\n| frames | time |\n|---|---|\n| 300 | 9 s |\n"
    assert CHECKERBOARD.columns == 9


def test_corner_errors_are_as_large_as_asked_for():
    rng, grid = np.random.default_rng(2), np.stack(np.meshgrid(np.arange(9) * 40.0, np.arange(6) * 40.0), axis=-1)
    true = grid.reshape(-1, 2)

    def errors(asked: CornerErrors) -> np.ndarray:
        return np.array([asked.drawn(rng, true) for _ in range(60)])

    independent = errors(CornerErrors())
    assert independent.std() == pytest.approx(0.1, rel=0.05)
    assert abs(np.mean(independent[:, 1:] * independent[:, :-1])) < 0.001
    shared = errors(CornerErrors(0.0, shared_px=0.1))
    assert shared.std() == pytest.approx(0.1, rel=0.2)
    assert np.mean(shared[:, 1:9] * shared[:, :8]) > 0.85 * np.mean(np.square(shared))
    gross = errors(CornerErrors(0.0, gross_share=0.05))
    assert np.mean(np.linalg.norm(gross, axis=2) > 0.5) == pytest.approx(0.05, abs=0.015)
