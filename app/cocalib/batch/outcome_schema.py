"""JSON Schema of outcome-1, generated from its type: `python -m cocalib.batch.outcome_schema docs/schemas`."""

import sys
from pathlib import Path

from calib_core.interchange.own.schemas import schema_file_name, schema_text
from cocalib.batch.outcome import OUTCOME_SCHEMA, Outcome


def write_outcome_schema(folder: Path) -> Path:
    """Write the schema into a folder; return its path."""
    path = folder / schema_file_name(OUTCOME_SCHEMA)
    path.write_text(schema_text(OUTCOME_SCHEMA, Outcome), encoding="utf-8")
    return path


if __name__ == "__main__":
    write_outcome_schema(Path(sys.argv[1]))
