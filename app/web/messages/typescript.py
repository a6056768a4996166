"""The channel's types as TypeScript, so that an editor checks the page against the program."""

import dataclasses
import inspect
import types
import typing
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import msgspec

from app.web.messages.incoming import MessageForm
from app.web.messages.outgoing import TYPES, FrameHeader, Outgoing

__all__ = ["declarations"]

_HEAD = """// The words of the channel between the page and the program.
// Made by `python -m app.web.messages > static/messages.d.ts`; do not edit.
"""
_PLAIN = {int: "number", float: "number", str: "string", bool: "boolean", type(None): "null", Any: "unknown"}


def declarations() -> str:
    """Return the text of `static/messages.d.ts`."""
    known: dict[str, str] = {}
    for owner in (*get_args(Outgoing), FrameHeader, *get_args(MessageForm)):
        _declare(owner, known)
    unions = [
        _union("FromServer", [owner.__name__ for owner in get_args(Outgoing)]),
        _union("FromPage", [owner.__name__ for owner in get_args(MessageForm)]),
    ]
    return "\n".join([_HEAD, *known.values(), *unions])


def _union(name: str, members: list[str]) -> str:
    return f"export type {name} =\n" + "\n".join(f"  | {member}" for member in members) + ";\n"


def _declare(owner: Any, known: dict[str, str]) -> None:
    """Add the interface of a class, and before it those that it needs."""
    if owner.__name__ in known:
        return
    known[owner.__name__] = ""  # holds the place against classes that hold one another
    is_form = issubclass(owner, msgspec.Struct)
    is_array = is_form and owner.__struct_config__.array_like
    text = _tuple(owner, known) if is_array else _interface(owner, known, is_form=is_form)
    del known[owner.__name__]
    known[owner.__name__] = text


def _interface(owner: Any, known: dict[str, str], *, is_form: bool) -> str:
    hints = typing.get_type_hints(owner, include_extras=False)
    lines = [f"/** {_summary(owner)} */", f"export interface {owner.__name__} {{"]
    tag = owner.__struct_config__.tag if is_form else TYPES.get(owner)
    if tag:
        lines.append(f'  type: "{tag}";')
    for name in _field_names(owner):
        optional = "?" if is_form and _has_default(owner, name) else ""
        lines.append(f"  {name}{optional}: {_type(hints[name], known)};")
    if is_form and tag and "request" not in hints:
        lines.append("  request?: number;")
    return "\n".join([*lines, "}", ""])


def _tuple(owner: Any, known: dict[str, str]) -> str:
    hints = typing.get_type_hints(owner)
    fields = ", ".join(f"{name}: {_type(hints[name], known)}" for name in owner.__struct_fields__)
    return f"/** {_summary(owner)} */\nexport type {owner.__name__} = [{fields}];\n"


def _field_names(owner: Any) -> tuple[str, ...]:
    if issubclass(owner, msgspec.Struct):
        return owner.__struct_fields__
    return tuple(field.name for field in dataclasses.fields(owner))


def _has_default(owner: Any, name: str) -> bool:
    return not next(field for field in msgspec.structs.fields(owner) if field.name == name).required


def _summary(owner: Any) -> str:
    return (inspect.getdoc(owner) or "").partition("\n")[0]


def _type(hint: Any, known: dict[str, str]) -> str:
    origin, arguments = get_origin(hint), get_args(hint)
    if hint in _PLAIN:
        return _PLAIN[hint]
    if origin is Annotated:
        return _type(arguments[0], known)
    if origin is Literal:
        return " | ".join(f'"{value}"' for value in arguments)
    if origin in (Union, types.UnionType):
        return " | ".join(dict.fromkeys(_type(argument, known) for argument in arguments))
    if origin is dict:
        return f"Record<string, {_type(arguments[1], known)}>"
    if origin is tuple:
        return _sequence(arguments, known)
    _declare(hint, known)
    return str(hint.__name__)


def _sequence(arguments: tuple[Any, ...], known: dict[str, str]) -> str:
    if arguments[-1] is not Ellipsis:
        return f"[{', '.join(_type(argument, known) for argument in arguments)}]"
    item = _type(arguments[0], known)
    return f"({item})[]" if " " in item and not item.startswith("[") else f"{item}[]"
