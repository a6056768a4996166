"""Write docs/schemas, the JSON Schema of each of our files, from the types: `python docs/make_schemas.py`."""

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
    INTRINSICS_SCHEMA,
    IntrinsicsDocument,
)
from calib_core.interchange.own.proposal_documents import PROPOSALS_SCHEMA, ProposalsDocument
from calib_core.interchange.syntax.strict_json import is_setting, json_text
from calib_core.json_forms import form_of
from calib_core.measurements import Stamp
from calib_core.watching.baseline import BASELINE_SCHEMA, Baseline
from cocalib.batch.outcome import OUTCOME_SCHEMA, Outcome
from cocalib.batch.results_table import RESULTS_SCHEMA, BatchResults

FOLDER = Path(__file__).parent / "schemas"

_DOCUMENTS: dict[str, Any] = {
    CLICKS_SCHEMA: ClicksDocument,
    PAIRS_SCHEMA: PairsDocument,
    CALIBRATION_SCHEMA: CalibrationDocument,
    BOXES_SCHEMA: BoxesDocument,
    LABELS_SCHEMA: LabelsDocument,
    INTRINSICS_SCHEMA: IntrinsicsDocument,
    PROPOSALS_SCHEMA: ProposalsDocument,
    BASELINE_SCHEMA: Baseline,
    OUTCOME_SCHEMA: Outcome,
    RESULTS_SCHEMA: BatchResults,
}

_NAMES = {
    "AssumptionNote": "AssumptionDocument",
    "Baseline": "BaselineDocument",
    "Board": "BoardDocument",
    "ChosenReturn": "ReturnDocument",
    "WarningText": "WarningDocument",
    "LabelledScan": "ScanDocument",
    "InputFile": "InputDocument",
    "LeftOutImage": "LeftOutDocument",
    "Metrics": "MetricsDocument",
    "ImageSource": "SourceDocument",
    "RadarErrors": "RadarErrorsDocument",
    "Stamp": "TimeDocument",
    "StillPlaces": "StillPlacesDocument",
    "SystematicErrorResult": "SystematicErrorDocument",
    "TrafficModel": "TrafficDocument",
    "UnpairedText": "UnpairedDocument",
    "UnconfirmedClicks": "UnconfirmedDocument",
    "VehicleNote": "VehicleDocument",
    "StatedVerdict": "VerdictDocument",
}
"""The names under which definitions were published, where they differ from those of their types."""


def schema_texts() -> dict[str, str]:
    """Return the JSON Schema (2020-12) of each of our files, keyed by the file name of the schema."""
    return {
        f"{name.removeprefix('cocalib/')}.schema.json": schema_text(name, document)
        for name, document in _DOCUMENTS.items()
    }


def schema_text(name: str, document: Any) -> str:
    """Return the JSON Schema (2020-12) of a kind of file.

    Args:
        name: of the schema, such as cocalib/clicks-1.
        document: the type of its content.
    """
    (top,), components = msgspec.json.schema_components([document], schema_hook=_form_schema)
    (_,), stamp = msgspec.json.schema_components([Stamp])
    definitions: dict[str, Any] = {}
    published = _published(top, components | stamp, definitions)
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": name}
    return json_text({**head, **published, "$defs": definitions})


def _form_schema(kind: Any) -> dict[str, Any]:
    """Return the schema of a type that JSON states in another form."""
    form = form_of(kind)
    return {"$ref": f"#/$defs/{Stamp.__name__}"} if form is Stamp else msgspec.json.schema(form)


def _published(schema: Any, components: dict[str, Any], definitions: dict[str, Any]) -> Any:
    """Return a schema with published names, and add the definitions that it refers to in the order in which it does.

    Null is put behind the other types of a choice: msgspec's order of them differs from version to version.
    """
    if isinstance(schema, list):
        return [_published(item, components, definitions) for item in schema]
    if not isinstance(schema, dict):
        return schema
    shown = {key: _published(value, components, definitions) for key, value in schema.items() if key != "$ref"}
    if "anyOf" in shown:
        shown["anyOf"].sort(key=lambda choice: choice == {"type": "null"})
    if "$ref" not in schema:
        return shown
    part = schema["$ref"].removeprefix("#/$defs/")
    name = _NAMES.get(part, part)
    if name not in definitions:
        definitions[name] = {}
        definition = components[part] | {"title": name}
        definition["description"] = definition["description"].partition("\n\n    Attributes:")[0]
        if is_setting(part):  # the reader refuses unknown keys
            definition["additionalProperties"] = False
        definitions[name] |= _published(definition, components, definitions)
    return {"$ref": f"#/$defs/{name}", **shown}


if __name__ == "__main__":
    for file_name, text in schema_texts().items():
        (FOLDER / file_name).write_text(text, encoding="utf-8")
