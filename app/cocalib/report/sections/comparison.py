"""The difference from another calibration: the figures that `check --against` prints."""

from cocalib.report.markup import Markup, tag
from cocalib.report.subject import Against
from cocalib.view.wording import sentence


def comparison(against: Against) -> Markup:
    """Return the comparison.

    Args:
        against: the other calibration and the difference.
    """
    found = against.comparison
    rows = (tag("tr", tag("th", figure.label, scope="row"), tag("td", figure.text)) for figure in found.figures)
    return tag(
        "section",
        tag("h2", f"Compared with {against.name}"),
        tag(
            "table",
            tag("thead", tag("tr", tag("th", "what", scope="col"), tag("th", "difference", scope="col"))),
            tag("tbody", *rows),
            class_="figures",
        ),
        tag("p", sentence(found.verdict)),
        *(tag("p", sentence(line)) for line in against.judged),
        *(tag("p", sentence(line), class_="note") for line in found.notes),
        id="comparison",
    )
