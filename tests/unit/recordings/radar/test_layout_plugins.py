"""Radar layouts of other installed packages: they decode messages; and are left out in one line where they are broken."""

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calib_core.radar import cartesian_from_polar
from calib_core.recordings import open_recording
from calib_core.recordings.radar.column_plans import GROUP, all_decoders
from calib_core.recordings.radar.registry import DECODERS, Decoder
from tests.fake_distribution import install
from tests.unit.recordings.radar.radar_samples import START_NS

ACME = """
    from calib_core.recordings.radar.registry import Decoder

    ACME = Decoder(
        "ACME echoes", "acme_msgs/EchoArray", "list", ("slant", "squint", "closing", "loudness"),
        polar=("slant", "squint"), doppler="closing", amplitude_field="loudness", degrees=True, azimuth_sign=-1,
        angles="deg, azimuth positive to the right; no elevation",
    )
"""

Install = Callable[..., Path]


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Return what installs a package that adds a layout; afterwards it is as if it had never been there."""
    folder = tmp_path / "site-packages"
    folder.mkdir()
    monkeypatch.syspath_prepend(folder)
    all_decoders.cache_clear()

    def add(module: str = ACME, value: str = "ACME") -> Path:
        return install(folder, "acme-radar", module, GROUP, value)

    yield add
    all_decoders.cache_clear()
    sys.modules.pop("acme_radar", None)


def test_a_layout_of_an_installed_package_decodes_its_messages(installed: Install, ros2: Any, write: Any) -> None:
    installed()
    echo = ros2.define("acme_msgs/msg/Echo", "float32 slant\nfloat32 squint\nfloat32 closing\nfloat32 loudness\n")
    array = ros2.define("acme_msgs/msg/EchoArray", "Header header\nacme_msgs/Echo[] echoes\n")
    echoes = [ros2.new(echo, slant=8.0 + i, squint=10.0 * i, closing=-0.5 * i, loudness=20.0 + i) for i in range(4)]
    message = ros2.new(array, header=ros2.header(START_NS), echoes=echoes)

    with open_recording(write(ros2, [("/radar", START_NS, message)]), require=("radar",)) as recording:
        (topic,), scans = recording.topics, recording.radar_scans()

    assert "ACME echoes" in topic.layout
    polar = np.array([[8.0 + i, np.deg2rad(-10.0 * i), 0.0] for i in range(4)])
    np.testing.assert_allclose(scans.points_radar_m, cartesian_from_polar(polar), atol=1e-6)
    np.testing.assert_allclose(scans.doppler_mps, [0.0, -0.5, -1.0, -1.5])
    np.testing.assert_allclose(scans.snr_db, [20.0, 21.0, 22.0, 23.0])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('"ACME echoes"', '"RIO cloud"'), "the radar layout 'RIO cloud' has the same name as another"),
        (('"list"', '"lists"'), "has the unknown kind 'lists'; known: cloud, channels, list, arrays, point"),
        (('polar=("slant", "squint"), ', ""), "has no position"),
        (('("slant", "squint", "closing", "loudness")', '"slant squint closing loudness"'), "are tuples of names"),
        (('"closing", "loudness")', '"loudness")'), "closing must be among its fields"),
        (
            (
                '("slant", "squint", "closing", "loudness"),\n        polar=("slant", "squint"), doppler="closing", '
                'amplitude_field="loudness"',
                '("Range", "azimuth", "elevation", "doppler_velocity", "amplitude"), doppler=None',
            ),
            "is recognised by the same fields as 'radar_msgs scan'",
        ),
    ],
)
def test_a_broken_layout_is_left_out_in_one_line_that_names_its_package(
    installed: Install, caplog: pytest.LogCaptureFixture, change: tuple[str, str], words: str
) -> None:
    assert change[0] in ACME
    installed(ACME.replace(*change))

    assert all_decoders() == DECODERS
    (record,) = caplog.records
    assert record.getMessage().startswith("cocalib: skipped a plug-in of the package acme-radar 1.2: ")
    assert words in record.getMessage()


def test_a_layout_that_uses_a_field_it_does_not_ask_for_is_refused() -> None:
    with pytest.raises(ValueError, match="rate must be among its fields, or messages without fit it too"):
        Decoder("a", "b", "list", ("range", "azimuth"), doppler="rate")
