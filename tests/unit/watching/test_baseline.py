"""A baseline comes back as it was written, is small, and is refused where its parts do not fit."""

import json

import numpy as np
import pytest

from calib_core.errors import InputError
from calib_core.measurements import TimeNs
from calib_core.watching.baseline import BASELINE_SCHEMA, Baseline, encoded, read_baseline, write_baseline
from calib_core.watching.still_returns import StillPlaces
from calib_core.watching.traffic import learned
from tests.unit.watching.test_still_image import scene
from tests.unit.watching.test_traffic import traffic


@pytest.fixture(scope="module")
def baseline() -> Baseline:
    rng = np.random.default_rng(1)
    places = StillPlaces(rng.uniform(1.0, 20.0, (7, 3)).tolist(), [(0.01, 0.01)] * 7)
    model = learned(traffic(rng, passages=6))
    images = [encoded(scene(seed)) for seed in range(4)]
    return Baseline(
        BASELINE_SCHEMA, "a" * 64, "drive.mcap", TimeNs(5), TimeNs(6 * 10**11), (480, 300), images, places, model
    )


def test_it_comes_back_and_is_small(baseline):
    text = write_baseline(baseline)
    again = read_baseline(text, source="b.json")

    assert len(text) < 300_000
    assert (again.calibration_sha256, again.start, again.end, again.image_size_px) == (
        "a" * 64,
        5,
        6 * 10**11,
        (480, 300),
    )
    assert [image.shape for image in again.images()] == [(300, 480)] * 4
    assert again.traffic is not None
    np.testing.assert_array_equal(again.still_returns.polar, baseline.still_returns.polar)
    np.testing.assert_array_equal(again.traffic.information, baseline.traffic.information)
    assert again.traffic.labels == ["person"]


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("traffic", "information"), [[1.0]]),
        (("traffic", "factors"), [[[1.0, -1.0], [1.0, 1.0]]]),
        (("traffic", "labels"), ["person", "person"]),
        (("still_returns", "spreads_rad"), []),
        (("backgrounds",), ["not base64!"]),
        (("backgrounds",), ["AAAA"]),
        (("backgrounds",), ["/9j/AAAA"]),
        (("calibration_sha256",), "b"),
        (("schema",), "cocalib/pairs-1"),
        (("other",), 1),
    ],
)
def test_what_does_not_fit_is_refused_with_the_files_name(baseline, place, value):
    content = json.loads(write_baseline(baseline))
    owner = content
    for key in place[:-1]:
        owner = owner[key]
    owner[place[-1]] = value

    with pytest.raises(InputError, match=r"^b\.json: "):
        read_baseline(json.dumps(content), source="b.json")
