"""Flags that several commands share, and the names of values in the help."""

import dataclasses
from pathlib import Path
from typing import Annotated, Any, TypeAlias, get_args

import tyro
from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec, PrimitiveTypeInfo


def called(metavar: str | None = None) -> object:
    """Name a value in the help, and omit its default: None or False would say nothing."""
    return tyro.conf.arg(metavar=metavar, help_behavior_hint="")


def same(options: type[Any], name: str) -> Any:
    """Copy an option's default and text to a field of a subclass, which names the value in the help."""
    (found,) = (field for field in dataclasses.fields(options) if field.name == name)
    return dataclasses.field(default=found.default, metadata=found.metadata)


VALUES = ConstructorRegistry()
"""How values are read and shown that tyro would show with its own words."""


@VALUES.primitive_rule
def _optional_number(found: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[Any] | None:
    """Show a number that may be unset as FLOAT or INT, not as {None}|FLOAT."""
    kind = next((kind for kind in (float, int) if set(get_args(found.type)) == {kind, type(None)}), None)
    if kind is None:
        return None
    return PrimitiveConstructorSpec(
        nargs=1,
        metavar=kind.__name__.upper(),
        instance_from_str=lambda words: kind(words[0]),
        is_instance=lambda value: value is None or isinstance(value, kind | int),
        str_from_instance=lambda value: ["unset" if value is None else str(value)],
    )


@VALUES.primitive_rule
def _text(found: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[Any] | None:
    """Show a text as TEXT, not as STR."""
    if found.type is not str:
        return None
    return PrimitiveConstructorSpec(
        nargs=1,
        metavar="TEXT",
        instance_from_str=lambda words: words[0],
        is_instance=lambda value: isinstance(value, str),
        str_from_instance=lambda value: [value],
    )


File: TypeAlias = Annotated[Path | None, called("FILE")]
NewFile: TypeAlias = Annotated[Path, tyro.conf.arg(metavar="FILE")]
Folder: TypeAlias = Annotated[Path | None, called("FOLDER")]
Switch: TypeAlias = Annotated[bool, called()]
