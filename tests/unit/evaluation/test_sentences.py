"""The words of an evaluation say what its figures say, and never Acc alone."""

import re

import pytest

from calib_core.evaluation.figures import BoxFigures, ClassFigure, Evaluation, FrameFigure, Sensitivity, Share
from calib_core.evaluation.sentences import NOT_ACCURACY, evaluation_lines, sensitivity_sentences
from calib_core.measurements import TimeNs

ANGLES = (-1.0, 0.0, 1.0)


def figures(*curves: Sensitivity, acc: float | None = 0.6) -> BoxFigures:
    return BoxFigures(
        acc=acc,
        acc_standard_error=0.03,
        acc_without_zero_frames=0.8,
        frames=(FrameFigure(TimeNs(1), TimeNs(2), 3, 2, 1, 10.0), FrameFigure(TimeNs(3), TimeNs(4), 1, 0, 1, 10.0)),
        classes=(ClassFigure("person", acc, 2, 4, 2),),
        ranges=(Share(0.0, 10.0, 4, 2),),
        sensitivity=curves,
        chance=0.01,
        rule="the rule",
        source="boxes.json",
        targets=2,
        matched_targets=1,
    )


@pytest.mark.parametrize(
    ("acc", "error", "said"),
    [
        ((0.604, 0.6, 0.602), 0.001, "Acc is flat in roll: it cannot see it (60.0 % to 60.4 %)"),
        ((0.62, 0.6, 0.61), 0.03, "Acc is flat in roll: it cannot see it (60.0 % to 62.0 %)"),
        ((0.5, 0.6, 0.4), 0.001, "Acc under roll: 60.0 % here, 50.0 % at -1 deg, 40.0 % at +1 deg"),
        (
            (0.7, 0.6, 0.4),
            0.001,
            "Acc under roll: 60.0 % here, 70.0 % at -1 deg, 40.0 % at +1 deg, highest at -1 deg (70.0 %), not here",
        ),
    ],
)
def test_each_axis_is_said_to_be_flat_or_seen(acc, error, said):
    assert sensitivity_sentences(figures(Sensitivity("roll", ANGLES, acc, error))) == (said,)


def test_acc_comes_with_its_error_its_sensitivity_and_the_warning_not_to_take_it_for_accuracy():
    lines = evaluation_lines(Evaluation(None, figures(Sensitivity("yaw", ANGLES, (0.5, 0.6, 0.4)))))

    assert re.findall(r"[\d.]+", lines[0]) == ["60.0", "3.0", "2", "4", "2", "1"]
    assert lines[1].strip().startswith("Acc under yaw")
    assert lines[2].strip() == NOT_ACCURACY
    assert any(re.match("  1 frame .*80.0", line) for line in lines)


def test_without_a_counting_frame_there_is_no_acc():
    lines = evaluation_lines(Evaluation(None, figures(acc=None)))
    assert lines[0].startswith("Acc: none")
