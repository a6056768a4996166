"""Real recordings without a reflector: no placement is invented, and what lacks a radar or a camera says so."""

import pytest

from benchmarks.proposing.without_reflector import measure_real

pytestmark = pytest.mark.real


@pytest.mark.parametrize("name", ["pjlab_radar_camera.bag", "pjlab_radar_camera_mcap", "pjlab_radar_camera_db3"])
def test_nothing_is_proposed_on_the_road(shared_data, name):
    figures = measure_real(shared_data / "real_radar_camera_road" / name)
    assert isinstance(figures, dict)
    assert (figures["placements"], figures["proposed"], figures["accepted"]) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("name", "lacks"),
    [
        ("real_pointcloud2/test.bag", "no readable camera image topic"),
        ("real_camera_formats/raw.bag", "no readable radar"),
    ],
)
def test_a_recording_without_radar_or_camera_says_so(shared_data, name, lacks):
    answer = measure_real(shared_data / name)
    assert isinstance(answer, str)
    assert lacks in answer
