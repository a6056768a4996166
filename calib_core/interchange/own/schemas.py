"""JSON Schema of our files, generated from the types: `python -m calib_core.interchange.own.schemas docs/schemas`."""

import sys
from pathlib import Path
from typing import Any

import msgspec

from calib_core.interchange.own.detection_documents import BOXES_SCHEMA, LABELS_SCHEMA, BoxesDocument, LabelsDocument
from calib_core.interchange.own.documents import (
    CALIBRATION_SCHEMA,
    CLICKS_SCHEMA,
    PAIRS_SCHEMA,
    CalibrationDocument,
    ClicksDocument,
    PairsDocument,
)
from calib_core.interchange.own.lens_documents import (
    BOARD_VIEWS_SCHEMA,
    INTRINSICS_SCHEMA,
    BoardViewsDocument,
    IntrinsicsDocument,
)
from calib_core.interchange.own.proposal_documents import PROPOSALS_SCHEMA, ProposalsDocument
from calib_core.interchange.syntax.strict_json import json_text

_DOCUMENTS: dict[str, Any] = {
    CLICKS_SCHEMA: ClicksDocument,
    PAIRS_SCHEMA: PairsDocument,
    CALIBRATION_SCHEMA: CalibrationDocument,
    BOXES_SCHEMA: BoxesDocument,
    LABELS_SCHEMA: LabelsDocument,
    BOARD_VIEWS_SCHEMA: BoardViewsDocument,
    INTRINSICS_SCHEMA: IntrinsicsDocument,
    PROPOSALS_SCHEMA: ProposalsDocument,
}


def schema_texts() -> dict[str, str]:
    """Return the JSON Schema (2020-12) of each of our files, keyed by the file name of the schema."""
    return {schema_file_name(name): schema_text(name, document) for name, document in _DOCUMENTS.items()}


def schema_file_name(name: str) -> str:
    """Return the file name of a schema, such as outcome-1.schema.json of cocalib/outcome-1."""
    return f"{name.removeprefix('cocalib/')}.schema.json"


def schema_text(name: str, document: Any) -> str:
    """Return the JSON Schema (2020-12) of a kind of file.

    Args:
        name: of the schema, such as cocalib/clicks-1.
        document: the type of its content.
    """
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": name}
    schema = {**head, **msgspec.json.schema(document)}
    for part, definition in schema["$defs"].items():
        if part.endswith(("Options", "Prior")):  # settings: the reader refuses unknown keys
            definition["additionalProperties"] = False
    return json_text(_null_last(schema))


def write_schemas(folder: Path) -> None:
    """Write every schema into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in schema_texts().items():
        (folder / name).write_text(text, encoding="utf-8")


def _null_last(schema: Any) -> Any:
    """Put null behind the other types of a choice: msgspec's order of them differs from version to version."""
    if isinstance(schema, dict):
        ordered = {key: _null_last(value) for key, value in schema.items()}
        if "anyOf" in ordered:
            ordered["anyOf"].sort(key=lambda choice: choice == {"type": "null"})
        return ordered
    return [_null_last(item) for item in schema] if isinstance(schema, list) else schema


if __name__ == "__main__":
    write_schemas(Path(sys.argv[1]))
