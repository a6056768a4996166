"""The code of a pack that takes a radar's errors out gives what the library gives, in Python and in C++."""

import importlib.util
import io
import subprocess
import sys
from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

from calib_core.radar import RadarErrors

DRIVER = """
#include "radar_correction.hpp"
#include <cstdio>
#include <iostream>

int main(int, char** arguments) {
  const auto correction = cocalib::RadarCorrection::read(arguments[1]);
  cocalib::Point p;
  while (std::cin >> p.x >> p.y >> p.z) {
    const auto true_m = correction.corrected(p);
    std::printf("%.17g %.17g %.17g\\n", true_m.x, true_m.y, true_m.z);
  }
}
"""
KINDS = {
    "errors and map": (RadarErrors(0.02, -0.03, 0.12, 0.6), True),
    "errors": (RadarErrors(0.02, -0.03, 0.12, 0.0), False),
    "map": (RadarErrors(), True),
    "height above the radar": (RadarErrors(squared_height_m2=1e3), True),
    "nothing": (RadarErrors(), False),
}


@pytest.fixture(params=KINDS)
def file(request, golden, angle_map):
    errors, has_map = KINDS[request.param]
    return replace(
        golden,
        calibration=replace(golden.calibration, radar_errors=errors, angle_map=angle_map if has_map else None),
    )


@pytest.fixture
def reported_m(angle_map) -> np.ndarray:
    """Return positions in, on and beyond the grid of the map, in all directions."""
    rng = np.random.default_rng(5)
    azimuth = np.concatenate([rng.uniform(-0.7, 0.7, 300), angle_map.azimuth_rad, rng.uniform(-np.pi, np.pi, 50)])
    elevation = np.concatenate([rng.uniform(-0.4, 0.3, 300), np.resize(angle_map.elevation_rad, 56)])
    across = np.cos(elevation)
    directions = np.stack([across * np.cos(azimuth), across * np.sin(azimuth), np.sin(elevation)], axis=1)
    return np.vstack(
        [rng.uniform(0.5, 60.0, (356, 1)) * directions, [[0.0, 0.0, 0.0], [0.0, 0.0, 5.0], [-8.0, 0.0, 0.0]]]
    )


@pytest.fixture
def true_m(file, reported_m) -> np.ndarray:
    points = file.calibration.radar_errors.corrected(reported_m)
    return points if file.calibration.angle_map is None else file.calibration.angle_map.corrected(points)


def loaded(folder, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    spec = importlib.util.spec_from_file_location("radar_correction", folder / "radar_correction.py")
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "radar_correction", module)
    spec.loader.exec_module(module)
    return module


def test_python_corrects_one_position_and_many(file, reported_m, true_m, unpacked, monkeypatch):
    folder = unpacked(file)
    correction = loaded(folder, monkeypatch).RadarCorrection.read(folder)

    one_by_one = [correction.corrected(point) for point in reported_m.tolist()]

    np.testing.assert_allclose(one_by_one, true_m, rtol=0, atol=1e-9)
    np.testing.assert_allclose(correction.corrected_array(reported_m), true_m, rtol=0, atol=1e-9)
    assert correction.corrected_array(np.zeros((0, 3))).shape == (0, 3)
    assert np.isnan(correction.corrected((np.nan, 1.0, 0.0))).all()
    assert np.isnan(correction.corrected_array([[np.nan, 1.0, 0.0]])).all()


def test_cpp_corrects_the_same(file, reported_m, true_m, unpacked, compiled):
    program = compiled("driver", DRIVER)
    text = "\n".join(" ".join(map(repr, row)) for row in reported_m.tolist())

    done = subprocess.run([program, unpacked(file)], input=text, capture_output=True, text=True, check=True)

    np.testing.assert_allclose(np.loadtxt(io.StringIO(done.stdout)), true_m, rtol=0, atol=1e-9)


def test_a_map_that_is_named_and_missing_is_an_error(corrected, unpacked, monkeypatch):
    folder = unpacked(corrected)
    (folder / "radar_angle_map.csv").unlink()

    with pytest.raises(OSError, match=r"radar_angle_map\.csv"):
        loaded(folder, monkeypatch).RadarCorrection.read(folder)


def test_the_npz_holds_the_same_tables(corrected, angle_map, unpacked):
    arrays = np.load(unpacked(corrected) / "radar_angle_map.npz", allow_pickle=False)

    np.testing.assert_array_equal(arrays["azimuth_rad"], angle_map.azimuth_rad)
    np.testing.assert_array_equal(arrays["elevation_rad"], angle_map.elevation_rad)
    np.testing.assert_array_equal(arrays["add_azimuth_rad"], angle_map.correction_rad[:, :, 0])
    np.testing.assert_array_equal(arrays["add_elevation_rad"], angle_map.correction_rad[:, :, 1])
    np.testing.assert_array_equal(arrays["sigma_azimuth_rad"], angle_map.sigma_rad[:, :, 0])
    np.testing.assert_array_equal(arrays["sigma_elevation_rad"], angle_map.sigma_rad[:, :, 1])
    assert (arrays["aed_px"], arrays["corrected_aed_px"]) == (22.9, 2.04)
