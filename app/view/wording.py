"""Phrases of the core as sentences on the screen."""

__all__ = ["sentence"]


def sentence(phrase: str) -> str:
    """Begin with a capital and end with a full stop; nothing stays nothing, and names such as /radar or c14 stay as they are."""
    phrase = phrase.strip()
    if not phrase:
        return ""
    start = phrase[0].upper() if phrase.split()[0].rstrip(",:;.…").isalpha() else phrase[0]
    return start + phrase[1:] + ("" if phrase[-1] in ".!?…" else ".")
