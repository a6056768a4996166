"""JSON Schemas of outcome-1 and batch-results-1, generated from their types: `python -m cocalib.batch.schemas docs/schemas`."""

import sys
from pathlib import Path

from calib_core.interchange.own.schemas import schema_file_name, schema_text
from cocalib.batch.outcome import OUTCOME_SCHEMA, Outcome
from cocalib.batch.results_table import RESULTS_SCHEMA, BatchResults


def write_batch_schemas(folder: Path) -> None:
    """Write the schemas into a folder."""
    for name, document in ((OUTCOME_SCHEMA, Outcome), (RESULTS_SCHEMA, BatchResults)):
        (folder / schema_file_name(name)).write_text(schema_text(name, document), encoding="utf-8")


if __name__ == "__main__":
    write_batch_schemas(Path(sys.argv[1]))
