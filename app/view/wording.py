"""Phrases of the core as sentences on the screen."""

__all__ = ["sentence"]


def sentence(phrase: str) -> str:
    """Begin with a capital and end with a full stop; nothing stays nothing."""
    phrase = phrase.strip()
    if not phrase:
        return ""
    return phrase[0].upper() + phrase[1:] + ("" if phrase[-1] in ".!?…" else ".")
