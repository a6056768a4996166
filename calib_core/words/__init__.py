"""What people are told: codes, facts and actions as sentences, remedies and labels. Nothing reads them back.

Imports whatever it words; the mathematics never imports it. `str` of a calibration, an outcome, a warning or a verdict is made
here, too (`summary`).
"""

from calib_core.words import summary  # noqa: F401  registers what `str` returns
from calib_core.words.outcomes import (
    UnpairedText,
    WarningText,
    in_sentences,
    outcome_told,
    said_of,
    unpaired_text,
    warning_text,
)
from calib_core.words.remark import Remark, remark
from calib_core.words.text import OptionPart, PairPart, Words, join, listed, named, option, say, sentence, words
from calib_core.words.unpaired import unpaired_told
from calib_core.words.verdict import (
    StatedVerdict,
    action_of,
    action_words,
    assumed_words,
    error_text,
    placement_words,
    stated_verdict,
    verdict_line,
    verdict_rest,
)
from calib_core.words.warnings import probability_text, told

__all__ = [
    "OptionPart",
    "PairPart",
    "Remark",
    "StatedVerdict",
    "UnpairedText",
    "WarningText",
    "Words",
    "action_of",
    "action_words",
    "assumed_words",
    "error_text",
    "in_sentences",
    "join",
    "listed",
    "named",
    "option",
    "outcome_told",
    "placement_words",
    "probability_text",
    "remark",
    "said_of",
    "say",
    "sentence",
    "stated_verdict",
    "told",
    "unpaired_text",
    "unpaired_told",
    "verdict_line",
    "verdict_rest",
    "warning_text",
    "words",
]
