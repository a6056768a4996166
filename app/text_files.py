"""Read small files of text that a user names."""

from pathlib import Path

from calib_core.errors import InputError
from calib_core.input_files import file_text, read_input

__all__ = ["read_text"]

_MAX_TEXT_BYTES = 64 * 1024 * 1024


def read_text(path: Path) -> str:
    """Read a text file.

    Raises:
        InputError: it is missing, a folder, a pipe or a device, unreadable, too large or not text.
    """
    try:
        return file_text(read_input(path, max_bytes=_MAX_TEXT_BYTES, is_what="a file of clicks or pairs"))
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; check the path") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {(error.strerror or str(error)).lower()}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not a text file (byte {error.start} is not UTF-8)") from error
