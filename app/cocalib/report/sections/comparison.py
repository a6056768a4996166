"""The difference from another calibration: the figures that `check --against` prints."""

from cocalib.report.markup import Markup, tag
from cocalib.report.subject import Against
from cocalib.view.wording import sentence


def comparison(against: Against, name: str) -> Markup:
    """Return the comparison.

    Args:
        against: the other calibration and the difference.
        name: of this one.
    """
    found = against.comparison
    rows = (tag("tr", tag("th", one.label, scope="row"), tag("td", one.text)) for one in found.figures)
    known = len(found.figures) + 1
    return tag(
        "section",
        tag("h2", f"Compared with {against.name}"),
        tag(
            "table",
            tag("thead", tag("tr", tag("th", "what", scope="col"), tag("th", "difference", scope="col"))),
            tag("tbody", *rows),
            class_="figures",
        ),
        tag("p", sentence(found.verdict(against.name, name))),
        *(tag("p", sentence(line)) for line in against.judged),
        *(tag("p", sentence(line), class_="note") for line in found.lines()[known:]),
        id="comparison",
    )
