"""Turn phrases of the core into sentences for the screen."""

from dataclasses import replace

from calib_core.results import DataWarning


def sentence(phrase: str) -> str:
    """Capitalize the phrase and add a full stop; an empty phrase stays empty, names such as /radar or c14 are not capitalized."""
    phrase = phrase.strip()
    if not phrase:
        return ""
    start = phrase[0].upper() if phrase.split()[0].rstrip(",:;.…").isalpha() else phrase[0]
    return start + phrase[1:] + ("" if phrase[-1] in ".!?…" else ".")


def warning_in_sentences(warning: DataWarning) -> DataWarning:
    """Return the warning with message and hint as sentences."""
    return replace(warning, message=sentence(warning.message), hint=sentence(warning.hint))
