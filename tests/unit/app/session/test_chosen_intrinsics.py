"""Intrinsics chosen for a session: kept on the disk, undone and redone, and refused where they do not fit the frames."""

from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace

from calib_core.camera import Camera, CameraCovariance
from cocalib.session import (
    ChosenIntrinsics,
    EventError,
    History,
    IntrinsicsChosen,
    RecordingFacts,
    Redo,
    Session,
    Undo,
    advance,
    apply,
)
from cocalib.session.file import open_session_file

FACTS = RecordingFacts("a.bag", np.array([0, 10**9]), 640, 480)
CAMERA = Camera(
    "plumb_bob",
    640,
    480,
    np.array([[500.25, 0.0, 320.0], [0.0, 501.0, 239.1], [0.0, 0.0, 1.0]]),
    np.array([-0.1, 0.01, 0.0, 1e-4]),
    CameraCovariance(("fx_px", "k1"), np.array([[0.25, 1e-4], [1e-4, 1e-6]])),
)
CHOSEN = ChosenIntrinsics.of(CAMERA, "the board in this recording, 24 views")


def test_a_camera_comes_back_from_its_numbers() -> None:
    camera = CHOSEN.camera
    assert (camera.model, camera.width_px, camera.height_px) == ("plumb_bob", 640, 480)
    np.testing.assert_array_equal(camera.parameters, CAMERA.parameters)
    assert camera.covariance is not None
    np.testing.assert_array_equal(camera.covariance.matrix, CAMERA.covariance.matrix)  # type: ignore[union-attr]
    assert ChosenIntrinsics.of(camera, CHOSEN.about) == CHOSEN


def test_choosing_intrinsics_is_a_change_that_can_be_undone_and_redone() -> None:
    start = History()
    chosen = advance(start, IntrinsicsChosen(CHOSEN), FACTS)
    assert chosen.present.intrinsics == CHOSEN
    assert chosen.present.revision == 1, "clicks are solved again"
    assert advance(chosen, IntrinsicsChosen(CHOSEN), FACTS) is chosen, "choosing the same again changes nothing"
    undone = advance(chosen, Undo(), FACTS)
    assert undone.present.intrinsics is None
    assert advance(undone, Redo(), FACTS).present.intrinsics == CHOSEN


@pytest.mark.parametrize(
    ("intrinsics", "said"),
    [
        (replace(CHOSEN, size_px=(800, 600)), "800 x 600 px, but the frames have 640 x 480"),
        (replace(CHOSEN, model="mirror"), "unknown camera model"),
        (replace(CHOSEN, distortion=(1.0,)), "distortion coefficients"),
    ],
)
def test_intrinsics_that_do_not_fit_are_refused_in_words(intrinsics: ChosenIntrinsics, said: str) -> None:
    with pytest.raises(EventError, match=said):
        apply(Session(), IntrinsicsChosen(intrinsics), FACTS)


@pytest.mark.parametrize("lost", ["journal-copy.jsonl", "journal.jsonl"])
def test_chosen_intrinsics_survive_a_restart_from_the_journal_or_its_copy(tmp_path: Path, lost: str) -> None:
    file = open_session_file(tmp_path / "s", FACTS)
    step = IntrinsicsChosen(CHOSEN)
    file.append(step, advance(file.restored.history, step, FACTS))
    file.close()
    (tmp_path / "s" / lost).unlink()
    again = open_session_file(tmp_path / "s", FACTS)
    assert again.restored.history.present.intrinsics == CHOSEN
    again.close()
