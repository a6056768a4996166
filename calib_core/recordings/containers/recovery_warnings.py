"""The warning about a file whose index is missing or damaged, worded the same for every format."""

from pathlib import Path

from calib_core.results import DataWarning


def about_recovery(
    path: Path,
    *,
    messages: int,
    lost_bytes: int,
    tool: str,
    damaged_chunks: int = 0,
    fault: str = "",
    unknown: int = 0,
) -> DataWarning:
    """Describe what was recovered by reading the whole file, and what was lost.

    Args:
        path: the file.
        messages: number of messages recovered.
        lost_bytes: number of bytes that could not be parsed.
        tool: the command that repairs such a file.
        damaged_chunks: number of compressed chunks that could not be fully decompressed.
        fault: why the first of those could not.
        unknown: number of messages of connections or channels that the file does not describe.
    """
    parts = [
        f"{path.name} has no usable index (it was not closed properly, or is truncated or damaged): {messages} complete messages "
        "were recovered by reading the whole file"
    ]
    if damaged_chunks:
        parts.append(
            f"{damaged_chunks} chunk{'s are' if damaged_chunks > 1 else ' is'} damaged, and everything after the damage in "
            f"{'them' if damaged_chunks > 1 else 'it'} is lost ({fault})"
        )
    if unknown:
        parts.append(f"{unknown} of the messages belong to topics that the file does not describe, and are skipped")
    if lost_bytes:
        parts.append(f"{lost_bytes} bytes could not be parsed and are lost")
    return DataWarning(
        "not-closed",
        "; ".join(parts),
        f"check that the data you need is there; repair the file to open it quickly again: {tool} {path.name}",
    )
