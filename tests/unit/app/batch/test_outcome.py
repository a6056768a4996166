"""The outcome's file is read strictly."""

import pytest

from calib_core.errors import InputError
from cocalib.batch.outcome import OUTCOME_SCHEMA, Outcome, OutcomeFile, OutcomeRun, outcome_text, read_outcome

OUTCOME = Outcome(
    OUTCOME_SCHEMA,
    "0123",
    "van",
    "1",
    "solved",
    recorded_ns=1_760_000_000_363_870_074,
    steps={"evaluate": "done", "report": "failed"},
    step_reasons={"report": "no camera"},
    files=(OutcomeFile("calibration.json", "ab"),),
    run=OutcomeRun("host", "2026-11-23T07:00:00+00:00", 1.5),
)


def test_what_is_written_is_read():
    assert read_outcome(outcome_text(OUTCOME)) == OUTCOME


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{}",
        outcome_text(OUTCOME)[:-9],
        outcome_text(OUTCOME).replace('"solved"', '"perfect"'),
        outcome_text(OUTCOME).replace('"vehicle"', '"car"'),
        outcome_text(OUTCOME).replace("outcome-1", "outcome-2"),
    ],
)
def test_anything_else_is_refused(text):
    with pytest.raises(InputError):
        read_outcome(text)
