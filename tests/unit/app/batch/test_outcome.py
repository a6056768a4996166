"""The outcome's file is read strictly."""

import pytest

from calib_core.errors import InputError
from cocalib.batch.outcome import OUTCOME_SCHEMA, Outcome, OutcomeFile, OutcomeRun, outcome_text, read_outcome
from cocalib.batch.schemas import write_batch_schemas

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


def test_the_published_schemas_are_those_of_the_types(tmp_path, project_root):
    write_batch_schemas(tmp_path)
    written = {path.name: path.read_text(encoding="utf-8") for path in tmp_path.iterdir()}
    published = {name: (project_root / "docs" / "schemas" / name).read_text(encoding="utf-8") for name in written}
    assert published == written, "run: python -m cocalib.batch.schemas docs/schemas"
