"""The angle scale of a radar: told where its sessions determine it, and only then."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.fleet.simulated_poses import NOMINAL
from calib_core.fleet import SessionPose, radar_scales
from calib_core.results.shared_errors import SystematicErrorResult

PRIOR = 0.02


def session(
    *values: float, sigma: float = 0.005, serial: str | None = "R1", name: str = "azimuth_scale"
) -> SessionPose:
    scales = tuple(SystematicErrorResult(name, value, sigma, PRIOR, True, 0.1, 0.1) for value in values)
    return SessionPose("van", "s", NOMINAL, np.eye(6) * 1e-4, radar_serial=serial, angle_scales=scales)


def estimated(truth: float, alone: float, rng: np.random.Generator) -> SessionPose:
    """Draw what a session with this standard deviation of the pairs alone states, its prior included."""
    information, prior = alone**-2.0, PRIOR**-2.0
    value = information * (truth + alone * rng.standard_normal()) / (information + prior)
    return session(value, sigma=(information + prior) ** -0.5)


def test_the_prior_counts_once_however_many_sessions() -> None:
    alone = 0.01
    rows = [session(0.03 * 0.8, sigma=(alone**-2 + PRIOR**-2) ** -0.5) for _ in range(8)]
    scale = radar_scales(rows)[0].azimuth
    assert scale is not None
    information = 8 * alone**-2
    assert scale.value == pytest.approx(0.03 * information / (information + PRIOR**-2))
    assert scale.sigma == pytest.approx((information + PRIOR**-2) ** -0.5)
    assert scale.sessions == 8


def test_a_scale_that_the_sessions_do_not_determine_is_not_told() -> None:
    (row,) = radar_scales([session(0.001, sigma=0.019)])
    assert (row.azimuth, row.elevation) == (None, None)


def test_elevation_is_told_apart_from_azimuth() -> None:
    (row,) = radar_scales([session(0.01, name="elevation_scale")])
    assert row.azimuth is None
    assert row.elevation is not None


def test_sessions_that_contradict_each_other_tell_nothing() -> None:
    assert radar_scales([session(0.03), session(-0.03)])[0].azimuth is None


def test_each_serial_has_its_own_and_a_radar_without_one_none() -> None:
    rows = [session(0.02, serial="B"), session(-0.02, serial="A"), session(0.0, serial=None)]
    found = radar_scales(rows)
    assert [one.serial for one in found] == ["A", "B"]
    assert [one.azimuth is not None and one.azimuth.value < 0 for one in found] == [True, False]


def test_a_noise_level_from_few_pairs_counts_for_less() -> None:
    sure, unsure = (radar_scales([replace(session(0.01), quantile=q)])[0].azimuth for q in (12.6, 25.0))
    assert sure is not None
    assert unsure is not None
    assert unsure.sigma > sure.sigma


def test_scales_over_sessions_are_as_good_as_they_say() -> None:
    rng, squared = np.random.default_rng(1), []
    for _ in range(2000):
        truth = PRIOR * rng.standard_normal()
        scale = radar_scales([estimated(truth, 0.012, rng) for _ in range(4)])[0].azimuth
        assert scale is not None
        squared.append(((scale.value - truth) / scale.sigma) ** 2)
    assert np.mean(squared) == pytest.approx(1.0, abs=0.12)
