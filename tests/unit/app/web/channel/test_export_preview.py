"""What the export panel says before a file is saved: groups of formats, evidence, the missing angle map, several files as one."""

import io
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulated_pairs import SystematicErrors, simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.interchange.formats.registry import CAMERA_ONLY, FORMATS
from calib_core.interchange.own.calibration_json import calibration_file
from calib_core.radar import AngleMap
from calib_core.words.verdict import StatedVerdict
from cocalib.web.channel import export_preview as panel
from cocalib.web.exports import FieldError, format_rows


def test_each_format_stands_once_under_the_heading_of_where_it_is_used():
    rows = format_rows()
    assert sorted(row.key for row in rows) == sorted(form.name for form in (*FORMATS, *CAMERA_ONLY))
    groups = [row.group for row in rows]
    assert groups == sorted(groups, key=groups.index)
    assert "Other tools" not in groups
    found = {row.key for row in rows if "ros 2" in f"{row.label} {row.also}".lower()}
    assert {"tf2", "tf2-launch-py", "urdf", "autoware"} <= found


def test_the_evidence_is_said_with_the_verdict(file):
    inliers = sum(pair.inlier for pair in file.calibration.pairs)
    for evidence, words in (
        (file.evidence, f"Rests on {inliers} clicks."),
        ("imported_assumed", "nothing proves it"),
        ("imported_proven", "proved"),
    ):
        assert words in panel.export_preview(replace(file, evidence=evidence), "tf2", "", "drive").evidence


def test_a_contradictory_calibration_is_shown_and_written_only_on_request(file):
    assert not panel.export_preview(file, "tf2", "", "drive").asks_despite_verdict
    doubted = replace(file, verdict=StatedVerdict("contradictory", "two poses fit", "measure the camera position"))
    assert panel.export_preview(doubted, "tf2", "", "drive").asks_despite_verdict
    with pytest.raises(FieldError) as refusal:
        panel.exported(doubted, "tf2", "")
    assert refusal.value.field == "despite_verdict"
    assert "verdict: contradictory" in panel.exported(doubted, "tf2", "despite_verdict=1").content
    assert panel.exported(doubted, "json", "").content, "our own format states the verdict"


def test_a_format_without_the_angle_map_says_so_with_both_figures(file):
    grid = AngleMap(np.array([-0.5, 0.5]), np.array([-0.2, 0.2]), np.zeros((2, 2, 2)), np.ones((2, 2, 2)), 22.9, 2.04)
    mapped = replace(file, calibration=replace(file.calibration, angle_map=grid))
    made = panel.export_preview(mapped, "opencv", "", "drive")
    assert "22.9 px" in made.missing
    assert "2.04 px" in made.missing
    assert made.missing not in made.notes
    assert panel.export_preview(mapped, "json", "", "drive").missing == ""
    assert panel.export_preview(file, "opencv", "", "drive").missing == ""


def test_a_file_with_others_that_belong_to_it_is_saved_as_one_zip(file):
    camera = replace(file.calibration.camera, model="plumb_bob", distortion=[-0.3, 0.1, 0, 0, 0])
    distorted = replace(file, calibration=replace(file.calibration, camera=camera))
    written = panel.exported(distorted, "kitti", "").download
    assert zipfile.ZipFile(io.BytesIO(written.data)).namelist() == ["calib.txt", "rectification.npz"]
    preview = panel.export_preview(distorted, "kitti", "", "drive")
    assert preview.file_name == f"drive_{written.file_name}"
    assert preview.size_bytes == len(written.data)


def test_which_radar_data_the_pose_is_for_can_be_chosen_where_corrections_are_lost():
    errors = SystematicErrors(azimuth_scale=0.04, range_bias_m=0.05)
    drawn = simulate_pairs(24, rng=np.random.default_rng(12), noise="imaging", systematic=errors)
    off = calibration_file(calibrate_pairs(drawn.pairs, drawn.camera).unwrap())
    plain, raw = (panel.export_preview(off, "tf2", query, "drive") for query in ("", "returns=raw"))
    assert (plain.other_pose.is_for, raw.other_pose.is_for) == ("raw", "corrected")
    assert not any("--for" in note for note in (*plain.notes, *raw.notes))
    assert raw.text == panel.exported(off, "tf2", "returns=raw").content
    assert plain.text != raw.text
    assert raw.check_is_good
    assert panel.export_preview(off, "opencv", "", "drive").other_pose.is_for == "corrected"
    assert panel.export_preview(off, "json", "returns=raw", "drive").other_pose is None
    with pytest.raises(FieldError):
        panel.export_preview(off, "tf2", "returns=both", "drive")
