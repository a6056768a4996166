"""What the reader must know before using the calibration: warnings with what to do, clicks without a pair, assumptions."""

from collections.abc import Iterator

from calib_core.results import DataWarning
from calib_core.results.verdict import by_consequence, consequence_of
from calib_core.words.outcomes import in_sentences
from calib_core.words.warnings import warning_remark
from cocalib.report.markup import Markup, tag
from cocalib.report.subject import ReportSubject
from cocalib.view.wording import sentence

_MOST, _MOST_UNPAIRED = 10, 5
_SIGNS = {"contradictory": "✕", "coarse": "▲", "limited": "△", "note": "·"}


def cautions(subject: ReportSubject) -> Markup:
    """Return the warnings, gravest first, then the rest."""
    warnings = list(_all_warnings(subject))
    items = [_item(warning) for warning in warnings[:_MOST]]
    if len(warnings) > _MOST:
        codes = ", ".join(dict.fromkeys(warning.code for warning in warnings[_MOST:]))
        items.append(tag("li", f"{len(warnings) - _MOST} more: {codes}."))
    unpaired = subject.calibration.unpaired if subject.calibration is not None else ()
    items += [
        tag("li", _sign("·"), tag("b", f"{row.id} has no pair. "), str(in_sentences(row)))
        for row in unpaired[:_MOST_UNPAIRED]
    ]
    if len(unpaired) > _MOST_UNPAIRED:
        items.append(tag("li", f"{len(unpaired) - _MOST_UNPAIRED} more clicks have no pair."))
    body = tag("ul", *items, class_="cautions") if items else tag("p", _no_warnings(subject), class_="note")
    return tag("section", tag("h2", "Warnings"), body, id="cautions")


def _no_warnings(subject: ReportSubject) -> str:
    if subject.judged is None and (subject.calibration is None or not subject.calibration.pairs):
        return "No warnings; but without pairs, and without clicks or boxes in a recording, hardly anything could be checked."
    return "No warnings."


def _all_warnings(subject: ReportSubject) -> Iterator[DataWarning]:
    """Yield each warning once: of the calibration, of the judgment on the recording, of the recording."""
    own = by_consequence(subject.calibration.warnings) if subject.calibration is not None else _assumed(subject)
    judged = subject.judged.evaluation.warnings if subject.judged is not None else ()
    recorded = subject.recording.warnings if subject.recording is not None else ()
    seen: list[DataWarning] = []
    for warning in (*own, *judged, *recorded):
        if warning not in seen:
            seen.append(warning)
            yield warning


def _assumed(subject: ReportSubject) -> tuple[DataWarning, ...]:
    return tuple(DataWarning.reported("assumed", note, "verify this assumption") for note in subject.found.assumptions)


def _item(warning: DataWarning) -> Markup:
    sign, said = _sign(_SIGNS[consequence_of(warning.code)]), warning_remark(warning)
    hint = tag("b", sentence(str(said.hint)))
    return tag("li", sign, tag("code", warning.code), " ", sentence(str(said.message)), " ", hint)


def _sign(shape: str) -> Markup:
    return tag("span", shape, class_="sign", aria_hidden="true")
