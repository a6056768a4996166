"""recording.toml beside the recordings: the topics, clock and columns that are read where nothing else is asked for."""

import hashlib
import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec

from calib_core.errors import InputError, RecordingError
from calib_core.input_files import file_text, read_input
from calib_core.parsing import toml_table
from calib_core.recordings.selection import Need, RecordingOptions
from calib_core.results import InputFile

RECORDING_FILE = "recording.toml"
_KEYS = ("radar_topic", "image_topic", "camera_info_topic", "clock", "map", "radar_late", "radar_frame", "radar_mount")
_NEEDS: Mapping[str, Need] = {"radar_topic": "radar", "image_topic": "image", "camera_info_topic": "image"}
_MOST_BYTES = 1 << 16


@dataclass(frozen=True, slots=True)
class RecordingFile:
    """What such a file has changed.

    Attributes:
        file: by its content.
        used: the options that are taken from it.
    """

    file: InputFile
    used: Mapping[str, Any]

    @property
    def words(self) -> str:
        """What is used of it, for people."""
        used = ", ".join(f"{key} = {_toml(value)}" for key, value in self.used.items())
        return f"using {RECORDING_FILE}: {used or 'nothing of it'}"

    def fitting(
        self, options: RecordingOptions, topics: Collection[str], require: Sequence[Need]
    ) -> "tuple[RecordingOptions, RecordingFile]":
        """Leave out the topics of other recordings beside it, where this one need not have such a topic."""
        absent = {
            key
            for key, need in _NEEDS.items()
            if need not in require
            and all(name.startswith("/") and name not in topics for name in str(self.used.get(key, "")).split(","))
        }
        unset: dict[str, Any] = dict.fromkeys(absent)
        used = {key: value for key, value in self.used.items() if key not in absent}
        return replace(options, **unset), replace(self, used=used)


def with_recording_file(
    paths: Sequence[Path], options: RecordingOptions
) -> tuple[RecordingOptions, RecordingFile | None]:
    """Return the options with what the file beside the recordings states; what the options ask for themselves stays.

    Raises:
        RecordingError: it is not TOML, states something else, or there are two.
    """
    found = list(dict.fromkeys(place for path in paths if (place := recording_file_of(path)).is_file()))
    if options.no_recording_file or not found:
        return options, None
    if len(found) > 1:
        raise RecordingError(f"{found[0]} and {found[1]} may differ; keep one, or give --no-recording-file")
    (path,) = found
    try:
        data = read_input(path, max_bytes=_MOST_BYTES, is_what=f"a {RECORDING_FILE}")
        stated = toml_table(file_text(data), source=str(path))
        typed = msgspec.convert(stated, RecordingOptions)
    except InputError as error:
        raise RecordingError(f"{error}, or give --no-recording-file") from None
    except (UnicodeDecodeError, msgspec.ValidationError) as error:
        raise RecordingError(f"{path}: {error}; correct it, or give --no-recording-file") from None
    if unknown := next((key for key in stated if key not in _KEYS), None):
        raise RecordingError(f"{path}: unknown key {unknown[:80]!r}; it may have {', '.join(_KEYS)}")
    unasked = RecordingOptions()
    used = {key: getattr(typed, key) for key in stated if getattr(options, key) == getattr(unasked, key)}
    file = InputFile(RECORDING_FILE, len(data), hashlib.sha256(data).hexdigest())
    return replace(options, **used), RecordingFile(file, used)


def recording_file_of(path: Path) -> Path:
    """Return where the file of a recording is: beside a bag, in a folder of plain files."""
    plain = path.is_dir() and not (path / "metadata.yaml").exists()
    return (path if plain else path.absolute().parent) / RECORDING_FILE


def recording_file_text(options: RecordingOptions) -> str:
    """Return the text of a file that states the same."""
    unasked = RecordingOptions()
    stated = [(key, getattr(options, key)) for key in _KEYS if getattr(options, key) != getattr(unasked, key)]
    return "".join(f"{key} = {_toml(value)}\n" for key, value in stated)


def _toml(value: str | float | tuple[str | float, ...] | None) -> str:
    return json.dumps(value, ensure_ascii=False)
