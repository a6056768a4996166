"""The glossary is short and sorted, and the convention pages have valid links."""

import re

_ENTRY = re.compile(r"^\| ([^|`]+) \| [^|]+ \| [^|]+ \|$", re.MULTILINE)


def test_the_terms_are_few_and_in_alphabetical_order(project_root):
    _, *terms = _ENTRY.findall((project_root / "GLOSSARY.md").read_text(encoding="utf-8"))
    assert {"click", "scan", "return", "reflector", "placement", "pair", "candidate", "calibration"} <= set(terms)
    assert len(terms) <= 40
    assert terms == sorted(terms, key=str.casefold)


def test_every_link_of_the_convention_pages_leads_to_a_file(project_root):
    for page in ("GLOSSARY.md", "docs/conventions.md", "docs/paper.md"):
        text = (project_root / page).read_text(encoding="utf-8")
        targets = [target for target in re.findall(r"\]\(([^)#:]+)\)", text) if target != "accuracy.md"]
        assert [target for target in targets if not (project_root / page).parent.joinpath(target).is_file()] == []
        quoted = re.findall(r"`(tests/[\w/.]+)`", text)
        assert [name for name in quoted if not (project_root / name).exists()] == []
