"""`cocalib solve --propose` and `cocalib solve --auto`: on a small recording, on the sample, and on what they must refuse."""

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from calib_core.geometry import rotation_angle_rad
from calib_core.interchange.own.proposal_documents import ProposalsDocument
from calib_core.json_forms import from_json
from calib_core.recordings.containers.writing import write_ros2
from cocalib.cli import run
from tests.cli.conftest import DWELL_S, START, Made

SIZE = ("--reflector-m", "0.4")
SEEN = Made(reflector_m=0.4, placements=12)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a recording whose images show the reflector."""
    return write_ros2(tmp_path_factory.mktemp("proposing") / "seen.mcap", SEEN.messages(), container="mcap")


def true_pixel_px(image_time: dict[str, int]) -> np.ndarray:
    """Return where the reflector is in a frame of that recording."""
    since_s = image_time["sec"] + 1e-9 * image_time["nanosec"] - START / 1e9
    pixels = SEEN.camera.project(SEEN.camera_from_radar @ SEEN.positions_radar_m)
    return np.asarray(pixels[int(since_s / DWELL_S)])


def off_px(click: dict[str, Any]) -> float:
    return float(np.linalg.norm(np.array(click["pixel_px"]) - true_pixel_px(click["image_time"])))


@pytest.mark.slow
def test_what_is_proposed_is_the_reflector_and_becomes_clicks_that_solve(cocalib, recording, tmp_path):
    out = tmp_path / "proposals.json"
    answer = cocalib("solve", "--propose", recording, *SIZE, "--out", out)
    assert answer.code == 0, answer.err
    head, *rows, summary, written = answer.out.splitlines()
    assert head.split()[:3] == ["id", "time", "[s]"]
    assert "nobody has confirmed" in summary
    assert written == f"written to {out}"
    assert "11 of 11 placements" in answer.err

    document = json.loads(out.read_text())
    msgspec.convert(document, ProposalsDocument, dec_hook=from_json)
    assert document["schema"] == "cocalib/proposals-1"
    assert [row.split()[0] for row in rows] == [one["id"] for one in document["proposals"]]
    confidences = [one["confidence"] for one in document["proposals"]]
    assert confidences == sorted(confidences, reverse=True)
    right = [one["click"] for one in document["proposals"] if off_px(one["click"]) < 5.0]
    assert len(right) >= 10

    clicks = tmp_path / "clicks.json"
    clicks.write_text(json.dumps({"schema": "cocalib/clicks-1", "clicks": right}))
    solved = cocalib("solve", recording, "--clicks", clicks)
    assert solved.code == 0, solved.err
    assert "nobody-confirmed" not in [one["code"] for one in json.loads(solved.out)["warnings"]]


@pytest.mark.slow
@pytest.mark.parametrize("off", [0.0, 40.0], ids=["on it", "beside it"])
def test_a_confirmed_click_stays_and_the_others_keep_their_ids_and_learn_from_it_if_it_is_right(
    cocalib, recording, tmp_path, off
):
    third = {"sec": START // 10**9 + 2 * DWELL_S + 2, "nanosec": 0}
    click = {"id": "p2", "image_time": third, "pixel_px": np.add(true_pixel_px(third), (off, 0.0)).tolist()}
    clicks = tmp_path / "one.json"
    clicks.write_text(json.dumps({"schema": "cocalib/clicks-1", "clicks": [click]}))
    answer = cocalib("solve", "--propose", recording, *SIZE, "--clicks", clicks, "--json")
    assert answer.code == 0, answer.err
    document = json.loads(answer.out)
    proposals = document["proposals"]
    assert ("warning: click p2 is " in answer.err) == bool(off)
    if off:
        assert len(proposals) >= 8
        assert max(off_px(one["click"]) for one in proposals if one["confidence"] > 0.9) < 3.0
    else:
        assert document["confirmed"] == ["p2"]
        assert {one["id"] for one in proposals} == {"p1", *(f"p{number}" for number in range(3, 12))}
        assert all(one["candidates"][0]["likeness"] is not None for one in proposals)


@dataclass(frozen=True)
class Solved:
    """The files of a recording solved without a person."""

    pose: Path
    clicks: Path


@pytest.fixture(scope="module")
def solved(recording: Path, tmp_path_factory: pytest.TempPathFactory) -> Solved:
    """Solve the recording without a person."""
    folder = tmp_path_factory.mktemp("solved")
    files = Solved(folder / "pose.json", folder / "clicks.json")
    typed = ("solve", recording, *SIZE, "--auto", "--out", files.pose, "--clicks-out", files.clicks)
    assert run([str(argument) for argument in typed]) == 0
    return files


@pytest.mark.slow
def test_a_calibration_that_nobody_confirmed_says_so_and_comes_again_from_its_clicks(
    cocalib, recording, solved, tmp_path
):
    document = json.loads(solved.pose.read_text())
    pose = document["camera_from_radar"]
    turned = np.array(pose["rotation"]) @ SEEN.camera_from_radar.rotation.T
    assert np.rad2deg(rotation_angle_rad(turned)) < 2.0
    assert "nobody-confirmed" in [one["code"] for one in document["warnings"]]
    assert document["evidence"] == "automatic"
    unconfirmed = document["provenance"]["unconfirmed"]
    assert unconfirmed["clicks"] == [pair["id"] for pair in document["pairs"]]
    assert 0.5 < unconfirmed["confidence"] <= 1.0
    assert all(pair["mark"] == "snapped" for pair in document["pairs"])

    again = tmp_path / "again.json"
    assert cocalib("solve", recording, "--clicks", solved.clicks, "--out", again).code == 0
    assert again.read_bytes() == solved.pose.read_bytes()

    position_m = SEEN.camera_from_radar.inverse().translation_m
    taped = cocalib("solve", recording, "--clicks", solved.clicks, "--camera-position-m", *position_m.round(3))
    assert json.loads(taped.out)["verdict"]["level"] == "usable"  # without a tape 11 pairs are within 3.2 deg

    from_pairs = cocalib("solve", "--pairs", solved.pose)
    assert "nobody-confirmed" in [one["code"] for one in json.loads(from_pairs.out)["warnings"]]
    assert json.loads(from_pairs.out)["provenance"]["unconfirmed"] == unconfirmed


def test_a_pose_that_unconfirmed_clicks_contradict_is_refused(cocalib, recording, solved, tmp_path):
    document = json.loads(solved.clicks.read_text())
    pixels = [click["pixel_px"] for click in document["clicks"]]
    for click, pixel_px in zip(document["clicks"], [*pixels[5:], *pixels[:5]], strict=True):
        click["pixel_px"] = pixel_px
    mixed, out = tmp_path / "mixed.json", tmp_path / "pose.json"
    mixed.write_text(json.dumps(document))
    answer = cocalib("solve", recording, "--clicks", mixed, "--out", out)
    assert answer.code == 1
    assert answer.err.startswith("cocalib: no calibration: ")
    assert not out.exists()


def test_a_weak_calibration_that_nobody_confirmed_fails_where_a_usable_one_is_required(
    cocalib, recording, solved, tmp_path
):
    document = json.loads(solved.clicks.read_text())
    document["clicks"] = document["clicks"][::2]
    few, out = tmp_path / "few.json", tmp_path / "pose.json"
    few.write_text(json.dumps(document))
    assert cocalib("solve", recording, "--clicks", few, "--out", out).code == 0
    answer = cocalib("solve", recording, "--clicks", few, "--out", out, "--require", "usable")
    assert answer.code == 3, answer.err
    written = json.loads(out.read_text())
    assert written["verdict"]["level"] == "coarse"
    assert written["provenance"]["unconfirmed"]["clicks"] == [click["id"] for click in document["clicks"]]


def test_clicks_that_nobody_confirmed_are_not_given_as_confirmed(cocalib, recording, solved):
    answer = cocalib("solve", recording, *SIZE, "--auto", "--clicks", solved.clicks)
    assert (answer.code, answer.out) == (2, "")
    assert f"{solved.clicks}: 11 of its clicks" in answer.err


@pytest.mark.slow
def test_the_sample_is_solved_without_a_person(cocalib, project_root, tmp_path):
    sample, out = project_root / "sample_data" / "rooftop", tmp_path / "pose.json"
    answer = cocalib("solve", sample / "radar.bag", sample / "camera.bag", "--auto", "--out", out)
    assert answer.code == 0, answer.err
    truth = json.loads((sample / "truth.json").read_text())["camera_from_radar"]
    pose = json.loads(out.read_text())["camera_from_radar"]
    turned = np.array(pose["rotation"]) @ np.array(truth["rotation"]).T
    assert np.rad2deg(rotation_angle_rad(turned)) < 1.4
    assert np.linalg.norm(np.array(pose["translation_m"]) - truth["translation_m"]) < 0.2


@dataclass(frozen=True)
class Reversed(Made):
    """The images of another recording: the placements come in the opposite order."""

    def image(self, index: int) -> np.ndarray:
        """Return the image of the placement as far from the end."""
        return super().image(self.placements - 1 - index)


def test_frames_that_show_no_placement_are_said(cocalib, tmp_path):
    early = START + 3 * 10**9
    messages = (one for one in SEEN.messages() if one.topic != "/camera/image/compressed" or one.receive_time < early)
    path = write_ros2(tmp_path / "early.mcap", messages, container="mcap")
    answer = cocalib("solve", "--propose", path, *SIZE)
    assert (answer.code, answer.out) == (1, "")
    assert "no frame during any" in answer.err


@pytest.mark.slow
def test_the_images_of_another_recording_are_refused(cocalib, tmp_path):
    radar = replace(SEEN, with_images=False, with_camera_info=False)
    camera = Reversed(reflector_m=SEEN.reflector_m, placements=SEEN.placements, with_radar=False)
    paths = [
        write_ros2(tmp_path / f"{name}.mcap", one.messages(), container="mcap")
        for name, one in (("radar", radar), ("camera", camera))
    ]
    out = tmp_path / "pose.json"
    answer = cocalib("solve", *paths, *SIZE, "--auto", "--out", out)
    assert answer.code == 1
    assert "cocalib: no calibration: " in answer.err
    assert not out.exists()
