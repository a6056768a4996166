"""`cocalib simulate`: presets fill the options that are not set by name."""

import json
from pathlib import Path

import numpy as np
import pytest

_TINY = ("placements=3", "dwell_s=3.5", "radar_rate_hz=5", "camera_rate_hz=3", "person=false", "clutter=none")
TINY = tuple(word for one in (*_TINY, "width_px=64", "height_px=64") for word in ("--set", one))


def _spans(folder: Path) -> list[tuple[float, float]]:
    placements = json.loads((folder / "truth.json").read_text())["placements"]
    return [(p["start"]["sec"], p["end"]["sec"]) for p in placements]


@pytest.mark.slow
def test_a_preset_fills_what_is_not_set_and_what_is_set_wins(cocalib, tmp_path):
    both, one = tmp_path / "both", tmp_path / "one"
    assert cocalib("simulate", "--out", both, "--preset", "two-reflectors", *TINY).code == 0
    assert cocalib("simulate", "--out", one, *TINY, "--preset", "two-reflectors", "--set", "reflectors=1").code == 0
    assert _spans(both)[1][0] < _spans(both)[0][1]
    assert _spans(one)[1][0] >= _spans(one)[0][1]
    assert {path.name for path in both.iterdir()} == {"radar.bag", "camera.bag", "truth.json", "clicks.json"}


@pytest.mark.parametrize(
    "setting",
    ["seed=-1", "width_px=1000000", "height_px=0", "field_of_view_deg=-5", "field_of_view_deg=1e300", "sensor_noise_grey=-1",
     "click_sigma_px=-1", "surroundings.passers_by=1000000000", "surroundings.strong_target_dbsm=-1e308",
     "intrinsics.principal_point_px=nan,inf", "rig.camera_offset_m=0,0,1e308", "rig.camera_angles_deg=-1e308,0,0",
     "rig.radar_height_m=-1", "rig.radar_tilt_deg=1e308", "rig.radar_roll_deg=-1e308", "rig.camera_angle_sigma_deg=-1",
     "camera_rate_hz=1e400", "dwell_s=nan", f"seed={'9' * 5000}"],
)  # fmt: skip
def test_an_absurd_setting_is_refused_by_name_before_anything_is_written(cocalib, tmp_path, setting):
    answer = cocalib("simulate", "--out", tmp_path / "out", *TINY, "--set", setting)
    assert answer.code == 2
    assert f"option {setting.partition('=')[0]}" in answer.err
    assert not any(tmp_path.iterdir())


def test_options_come_from_a_file_and_by_name(cocalib, tmp_path):
    out, file = tmp_path / "low", tmp_path / "options.toml"
    file.write_text("click_sigma_px = 0.0\n[defects]\nazimuth_scale = 1.5\n")
    settings = ("defects.azimuth_scale=1.03", "surroundings.companion=True", "rig.camera_angles_deg=0,2,0")
    named = (word for setting in settings for word in ("--set", setting))
    answer = cocalib("simulate", "--out", out, *TINY, "--options", file, *named)
    assert (answer.code, answer.err) == (0, "")
    truth, clicks = (json.loads((out / name).read_text()) for name in ("truth.json", "clicks.json"))
    pixels = np.array([p["pixel_px"] for p in truth["placements"]])
    off_px = np.array([c["pixel_px"] for c in clicks["clicks"]]) - pixels
    assert np.abs(off_px).max() < 0.02
