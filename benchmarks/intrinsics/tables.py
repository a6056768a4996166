"""A table of the page."""

from dataclasses import dataclass

__all__ = ["Table"]


@dataclass(frozen=True, slots=True)
class Table:
    """A table.

    Attributes:
        title: of the section.
        head: names of the columns.
        cells: one tuple per row.
        note: what was measured, before the table.
    """

    title: str
    head: tuple[str, ...]
    cells: tuple[tuple[str, ...], ...]
    note: str = ""

    @property
    def text(self) -> str:
        """The table in Markdown."""
        lines = [f"## {self.title}", "", *([self.note, ""] if self.note else [])]
        lines += ["| " + " | ".join(self.head) + " |", "|---" * len(self.head) + "|"]
        return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in self.cells)]) + "\n"
