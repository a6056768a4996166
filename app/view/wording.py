"""Phrases of the core as sentences on the screen."""

from dataclasses import replace

from calib_core.results import DataWarning

__all__ = ["sentence", "warning_in_sentences"]


def sentence(phrase: str) -> str:
    """Begin with a capital and end with a full stop; nothing stays nothing, and names such as /radar or c14 stay as they are."""
    phrase = phrase.strip()
    if not phrase:
        return ""
    start = phrase[0].upper() if phrase.split()[0].rstrip(",:;.…").isalpha() else phrase[0]
    return start + phrase[1:] + ("" if phrase[-1] in ".!?…" else ".")


def warning_in_sentences(warning: DataWarning) -> DataWarning:
    """Return the warning with message and hint as sentences."""
    return replace(warning, message=sentence(warning.message), hint=sentence(warning.hint))
