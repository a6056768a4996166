"""Options by name, of calibrations and of simulations: `--set noise.sigma_px=3`, and `--options FILE.toml`.

A name is its path in the dataclass of options, as in the `options` of calibration.json.
"""

import typing
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Annotated, Any, TypeAlias, TypeVar

import msgspec
import tyro

from calib_core.errors import InputError, OptionError
from calib_core.input_files import read_text
from calib_core.parsing import toml_table
from cocalib.option_changes import unknown_option

Settings: TypeAlias = Annotated[
    tuple[str, ...], tyro.conf.arg(metavar="NAME=VALUE", help_behavior_hint=""), tyro.conf.UseAppendAction
]
Named = TypeVar("Named")

_UNSET = "none"


def with_named(options: Named, settings: Sequence[str], file: Path | None = None) -> Named:
    """Return options with some of them changed, all at once: by a TOML file, then by texts.

    Args:
        options: a dataclass, whose fields may be dataclasses.
        settings: such as "noise.sigma_px=3".
        file: with tables as in calibration.json: `[noise]`, `sigma_px = 3`.

    Raises:
        InputError: a text is no NAME=VALUE, or the file is not TOML.
        OptionError: a name is unknown (the nearest one is suggested), or a value has the wrong type.
    """
    tree: dict[str, Any] = {}
    if file is not None:
        tree = toml_table(read_text(file, is_what="a TOML file of options"), source=str(file))
    for text in settings:
        name, sign, value = text.partition("=")
        if not sign:
            raise InputError(f"--set {text}: give NAME=VALUE, such as --set {next(names_of(type(options)))}=...")
        _put(tree, name.strip().replace("-", "_").split("."), value.strip())
    return _changed(options, tree, "", tuple(names_of(type(options)))) if tree else options


def names_of(kind: type[Any], prefix: str = "") -> Iterator[str]:
    """Yield the names of all options in a dataclass, such as "noise.sigma_px"."""
    hints = typing.get_type_hints(kind)
    for field in fields(kind):
        if is_dataclass(hints[field.name]):
            yield from names_of(hints[field.name], f"{prefix}{field.name}.")
        else:
            yield f"{prefix}{field.name}"


def _put(tree: dict[str, Any], path: Sequence[str], value: str) -> None:
    for part in path[:-1]:
        inner = tree.setdefault(part, {})
        tree = inner if isinstance(inner, dict) else {}
    tree[path[-1]] = value


def _changed(options: Named, tree: Mapping[str, Any], prefix: str, known: Sequence[str]) -> Named:
    hints = typing.get_type_hints(type(options))
    changed: dict[str, Any] = {}
    for name, value in tree.items():
        path = f"{prefix}{name}"
        present = getattr(options, name, None) if name in hints else None
        if name not in hints or (is_dataclass(hints[name]) and not isinstance(value, Mapping)):
            raise unknown_option(path, known)
        if present is not None and is_dataclass(present) and isinstance(value, Mapping):
            changed[name] = _changed(present, value, f"{path}.", known)
            continue
        typed = isinstance(value, str)
        if typed and typing.get_origin(hints[name]) is tuple:
            value = value.split(",")
        elif typed and value.lower() == _UNSET and type(None) in typing.get_args(hints[name]):
            value = None
        try:
            changed[name] = msgspec.convert(value, hints[name], strict=not typed)
        except msgspec.ValidationError as error:
            wanted = {float: "a number with a decimal point", int: "a whole number"}.get(hints[name])
            if typing.get_origin(hints[name]) is typing.Literal:
                wanted = " or ".join(map(str, typing.get_args(hints[name])))
            reason = f"takes {wanted}, not {value!r}" if wanted else f"{str(error)[:1].lower()}{str(error)[1:]}"
            raise OptionError(f"option {path}: {reason}") from None
    return replace(options, **changed)  # type: ignore[type-var]
