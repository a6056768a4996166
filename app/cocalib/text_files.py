"""Read small files of text that a user names."""

from pathlib import Path

from calib_core.errors import InputError
from calib_core.input_files import file_text, read_input

_MAX_TEXT_BYTES = 64 * 1024 * 1024


def read_text(
    path: Path,
    *,
    is_what: str = "a file of clicks or pairs",
    max_bytes: int = _MAX_TEXT_BYTES,
    if_missing: str = "check the path",
    if_no_text: str = "",
) -> str:
    """Read a text file.

    Args:
        path: the file.
        is_what: for messages.
        max_bytes: a larger one is refused.
        if_missing: what to do then.
        if_no_text: what to do then; "" says nothing.

    Raises:
        InputError: it is missing, a folder, a pipe or a device, unreadable, too large or not text.
    """
    try:
        return file_text(read_input(path, max_bytes=max_bytes, is_what=is_what))
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; {if_missing}") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {(error.strerror or str(error)).lower()}") from error
    except UnicodeDecodeError as error:
        hint = f"; {if_no_text}" if if_no_text else ""
        raise InputError(f"{path}: not a text file (byte {error.start} is not UTF-8){hint}") from error
