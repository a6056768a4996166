"""What is said about a file whose index is missing or damaged, in the same words for every format."""

from pathlib import Path

from calib_core.results import DataWarning

__all__ = ["about_recovery"]


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
    """Say what was found by reading a whole file, and what was lost.

    Args:
        path: the file.
        messages: how many were found.
        lost_bytes: that could not be understood.
        tool: the command that repairs such a file.
        damaged_chunks: packed chunks that could not be unpacked whole.
        fault: why the first of those could not.
        unknown: messages of connections or channels that nothing in the file describes.
    """
    parts = [
        f"{path.name} has no usable index (it was not closed properly, was cut short, or is damaged): {messages} whole messages "
        "were found by reading all of it"
    ]
    if damaged_chunks:
        parts.append(
            f"{damaged_chunks} chunk{'s are' if damaged_chunks > 1 else ' is'} damaged, and what follows the damage in "
            f"{'them' if damaged_chunks > 1 else 'it'} is lost ({fault})"
        )
    if unknown:
        parts.append(f"{unknown} of the messages belong to topics that nothing in the file describes, and are left out")
    if lost_bytes:
        parts.append(f"{lost_bytes} bytes could not be understood and are lost")
    return DataWarning(
        "not-closed",
        "; ".join(parts),
        f"check that what you need is there; {tool} {path.name} makes opening fast again",
    )
