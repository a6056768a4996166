"""Acc in the View: it says so as soon as it belongs to other boxes than those shown."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from calib_core.measurements import TimeNs
from cocalib.session import BoxDrawn
from cocalib.view import AccPanel
from cocalib.view.model import Figure
from cocalib.workspace import Workspace, open_workspace
from tests.street_recording import StreetRecording, reference_calibration

FIGURES = (Figure("acc", "in their boxes (Acc)", "86.4", "%", ""),)


@pytest.fixture
def workspace(tmp_path: Path) -> Iterator[Workspace]:
    walk = StreetRecording()
    opened = open_workspace(
        walk, camera=walk.camera(), session_folder=tmp_path / "s", name="street", reference=reference_calibration()
    )
    yield opened
    opened.close()


def test_figures_of_earlier_boxes_are_marked_in_the_view_that_has_the_new_ones(workspace):
    drawn = (
        BoxDrawn(time, (10.0, 10.0, 60.0, 90.0), "person") for time in map(TimeNs, workspace.facts.image_times.tolist())
    )
    workspace.dispatch(next(drawn))
    assert not workspace.view.acc.judging, "without figures there is nothing to mark"
    workspace.show_acc(AccPanel(figures=FIGURES), workspace.to_judge)
    assert not workspace.view.acc.judging
    seen = []
    workspace.subscribe(seen.append)
    workspace.dispatch(next(drawn))
    assert all(one.acc.judging for one in seen if len(one.boxes) > 1)
    assert workspace.view.acc.judging
    workspace.show_acc(AccPanel(figures=FIGURES), workspace.to_judge)
    assert not workspace.view.acc.judging
