"""Check and write JSON; every error is one line that names the file, the place in it and what to do."""

import dataclasses
import json
import math
import re
import types
from collections.abc import Iterator, Mapping
from functools import cache
from types import MappingProxyType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import msgspec

from calib_core.errors import InputError, meant
from calib_core.input_files import other_kind
from calib_core.json_forms import form_of, from_json, to_json
from calib_core.parsing import json_value

Document = TypeVar("Document")

_HALF = re.compile("[\ud800-\udfff]")


def parse_document(text: str, document: type[Document], *, source: str) -> Document:
    """Parse JSON text into a document type, refusing unknown keys.

    Args:
        text: the file's content.
        document: a msgspec Struct whose key "schema" names the format.
        source: the name of the file in error messages.

    Raises:
        InputError: not JSON, another format, an unknown or repeated key, a value of the wrong type, NaN or Infinity.
    """
    return document_in(json_object(text, source=source), document, source=source)


def document_in(content: Mapping[str, Any], document: type[Document], *, source: str) -> Document:
    """Check a parsed JSON object that names its schema against the document type of that schema.

    Raises:
        InputError: another format, an unknown key, a value of the wrong type, NaN or Infinity.
    """
    wanted = str(get_args(get_type_hints(document)["schema"])[0])
    found = content.get("schema")
    if found != wanted:
        same = str(found).rpartition("-")[0] == wanted.rpartition("-")[0]
        step = "another version of cocalib wrote it: use that one" if same else "give a file of that format"
        reason = f"schema: expected {wanted!r}, found {_value_text(found)}; {step}"
        raise InputError(f"{source}: {other_kind(found, wanted) or reason}")
    return checked(content, document, source=source)


def checked(content: Mapping[str, Any], document: type[Document], *, source: str, place: str = "") -> Document:
    """Check parsed values against a document type and return the document.

    Args:
        content: parsed values.
        document: a msgspec Struct.
        source: the name of the file in error messages.
        place: where the values are in the file.

    Raises:
        InputError: an unknown key, a value of the wrong type, NaN or Infinity.
    """
    for where, fault in _faults(content, document, place):
        raise InputError(f"{source}: {where or 'the file'}: {fault}")
    try:
        return msgspec.convert(content, document, dec_hook=from_json)
    except UnicodeEncodeError as error:
        half = f"{error.object[error.start]!a}"
        raise InputError(f"{source}: {place or 'the file'}: contains half a character ({half}); remove it") from None
    except InputError as error:  # a type's own words, which begin with the key
        raise InputError(f"{source}: {error}") from None
    except (msgspec.ValidationError, OverflowError) as error:
        raise InputError(f"{source}: {_from_msgspec(str(error), place)}") from None


def json_object(text: str, *, source: str) -> dict[str, Any]:
    """Parse JSON text that must be an object; keys may not repeat within it.

    Raises:
        InputError: it is something else.
    """
    content = json_value(text, source=source)
    if not isinstance(content, dict):
        raise InputError(
            f"{source}: expected an object in braces, found {_value_text(content)}; give a file in one of cocalib's formats"
        )
    return content


def _value_text(value: Any) -> str:
    if value is None:
        return "none"
    if isinstance(value, dict | list):
        return "an object" if isinstance(value, dict) else "a list"
    shown = json.dumps(value)
    return shown if len(shown) <= 60 else shown[:57] + "..."


def _faults(value: Any, annotation: Any, place: str) -> Iterator[tuple[str, str]]:
    """Walk a value along with its type: yield the place and the fault of each unknown key and non-finite number."""
    if isinstance(value, float) and not math.isfinite(value):
        yield place, f"{value} is not a valid number; give its value or remove the entry"
    elif isinstance(value, str) and (fault := _fault_of_text(value, annotation)):
        yield place, fault
    elif isinstance(value, dict):
        fields = fields_of(annotation)
        for key, item in value.items():
            inner = f"{place}.{key}" if place else key
            if fields is not None and key not in fields and _refuses_unknown(annotation):
                yield inner, _unknown_word("unknown key", key, list(fields), "known keys:")
            yield from _faults(item, (fields or {}).get(key), inner)
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from _faults(item, item_type(annotation), f"{place}[{index}]")


def _fault_of_text(value: str, annotation: Any) -> str:
    """Return what is wrong with a text; "" if nothing is. Results of a later version have no type and are kept as they are."""
    if annotation is not None and (half := _HALF.search(value)):
        return f"\\u{ord(half[0]):04x} is half of a character, which is not text; correct it"
    if get_origin(annotation) is Literal and value not in get_args(annotation):
        return _unknown_word(f"unknown value {value!r}", value, list(get_args(annotation)), "known values:")
    return ""


def _unknown_word(what: str, word: str, known: list[str], these: str) -> str:
    return f"{what}; {meant(word, known, these)}"


def _variants(annotation: Any) -> list[Any]:
    if get_origin(annotation) in (Union, types.UnionType):
        return [form_of(part) for part in get_args(annotation) if part not in (type(None), msgspec.UnsetType)]
    return [form_of(annotation)]


def fields_of(annotation: Any) -> Mapping[str, Any] | None:
    """Return the keys of a type that represents a JSON object, each with its own type; None for other types."""
    found = (_fields_of_type(part) for part in _variants(annotation) if isinstance(part, type))
    return next((fields for fields in found if fields is not None), None)


@cache
def _fields_of_type(part: type) -> Mapping[str, Any] | None:
    """Return the same of a class; looking up the names in its annotations takes longer than reading a file."""
    if issubclass(part, msgspec.Struct):
        hints = get_type_hints(part)
        return MappingProxyType({field.encode_name: hints[field.name] for field in msgspec.structs.fields(part)})
    if dataclasses.is_dataclass(part):
        hints = get_type_hints(part)
        return MappingProxyType({field.name: hints[field.name] for field in dataclasses.fields(part)})
    return None


def _refuses_unknown(annotation: Any) -> bool:
    """Return whether a type refuses unknown keys: inputs and settings do, results may grow."""
    return all(
        part.__struct_config__.forbid_unknown_fields if issubclass(part, msgspec.Struct) else is_setting(part.__name__)
        for part in _variants(annotation)
        if isinstance(part, type)
    )


def is_setting(name: str) -> bool:
    """Return whether a dataclass of this name holds settings, whose reader refuses unknown keys."""
    return name.endswith(("Options", "Prior"))


def item_type(annotation: Any) -> Any:
    """Return the item type of a type that represents a JSON list; None for other types."""
    for part in _variants(annotation):
        items = [item for item in get_args(part) if item is not Ellipsis]
        if get_origin(part) in (tuple, list) and items:
            return items[0]
    return None


def _from_msgspec(message: str, outer: str) -> str:
    """Turn msgspec's "text - at `$.path`" into "path: text", and the place within another form, "text in `key`", likewise."""
    match = re.fullmatch(r"(.*?)(?: in `(.*?)`)?(?: - at `\$\.?(.*?)`)?", message, flags=re.DOTALL)
    text, within, inner = match.groups() if match else (message, None, None)
    place = ".".join(part for part in (outer, inner, within) if part)
    text = text.replace("`", "").replace("Expected", "expected", 1)
    missing = re.fullmatch(r"Object missing required field (\w+)", text)
    if missing:
        return f"{f'{place}.' if place else ''}{missing.group(1)}: missing; add it"
    text = re.sub(r"expected (\S+), got null", r"is null, expected \1; give its value or remove the entry", text)
    step = '; write {"sec": 1700000000, "nanosec": 0}' if place.endswith("time") and "expected object" in text else ""
    return f"{place or 'the file'}: {text}{step}"


_WIDTH = 118
_INDENT = "  "


def document_text(document: Any) -> str:
    """Write a document as JSON; the same document gives the same bytes."""
    return json_text(builtins_of(document))


def builtins_of(document: Any) -> Any:
    """Return a document as dicts, lists, strings and numbers."""
    return msgspec.to_builtins(document, enc_hook=to_json)


def json_text(content: Any) -> str:
    """Write dicts, lists, strings and numbers as JSON that is easy to read and diff; ends with a line feed.

    Keys keep their order; floats are written with repr, so they read back bit for bit.
    """
    return _lines(_finite(content), 0) + "\n"


def _finite(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, dict):
        return {str(key): _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return value


def _lines(value: Any, depth: int) -> str:
    """Format a value on one line if it fits, otherwise one entry per line. Long lists of numbers are not broken."""
    compact = json.dumps(value, allow_nan=False)
    whole = len(compact) + depth * len(_INDENT) <= _WIDTH or not isinstance(value, dict | list)
    if whole or (isinstance(value, list) and all(isinstance(item, int | float) for item in value)):
        return compact
    inner, outer = _INDENT * (depth + 1), _INDENT * depth
    if isinstance(value, dict):
        rows = [f"{json.dumps(key)}: {_lines(item, depth + 1)}" for key, item in value.items()]
        return "{\n" + ",\n".join(inner + row for row in rows) + f"\n{outer}}}"
    return "[\n" + ",\n".join(inner + _lines(item, depth + 1) for item in value) + f"\n{outer}]"
