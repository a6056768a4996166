"""Write the tables of docs/warnings.md from the rows of words and the consequences: `python docs/make_warnings_table.py`."""

import re
from inspect import getdoc
from pathlib import Path

from calib_core.results.verdict import CODES
from calib_core.words.remark import Row
from calib_core.words.warnings import SOLVER

PAGE = Path(__file__).parent / "warnings.md"
_HEAD = "| code | given when | could also be |\n|---|---|---|\n"
_CONSEQUENCES = "| consequence | codes |\n|---|---|\n"
_NAMES = {"limited": "not good", "note": "nothing"}


def _explained(row: Row) -> str:
    """Return the cells of a row, from its docstring."""
    when, _, also = " ".join((getdoc(row) or "").split()).partition(" Could also be: ")
    return f"{when.removeprefix('Given when ').removesuffix('.')} | {also.removesuffix('.')}".rstrip()


def with_tables(page: str) -> str:
    """Return the page with the tables' rows as the program has them."""
    rows = "".join(f"| `{code}` | {_explained(SOLVER[code])} |\n" for listed in CODES.values() for code in listed)
    codes = {_NAMES.get(name, name): " ".join(f"`{code}`" for code in listed) for name, listed in CODES.items()}
    consequences = "".join(f"| {name} | {listed} |\n" for name, listed in codes.items())
    for head, body in ((_HEAD, rows), (_CONSEQUENCES, f"{consequences}| none | warnings of a recording |\n")):
        page = re.sub(re.escape(head) + r"(?:\|.*\n)*", lambda _, text=head + body: text, page)  # type: ignore[misc]
    return page


if __name__ == "__main__":
    PAGE.write_text(with_tables(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
