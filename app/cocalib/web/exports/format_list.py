"""The formats of the export panel, grouped by where they are used, with the words to find them by."""

from dataclasses import dataclass

from calib_core.interchange import written_formats


@dataclass(frozen=True, slots=True)
class FormatRow:
    """One line of the list of formats.

    Attributes:
        key: what `--to` takes.
        label: one line for display.
        group: the heading it stands under.
        also: other words to find it by.
        takes_parent: the radar can be posed in a third frame.
        takes_rectified: the user may have to state that the pictures are rectified.
    """

    key: str
    label: str
    group: str
    also: str
    takes_parent: bool
    takes_rectified: bool


def format_rows() -> tuple[FormatRow, ...]:
    """Return the list of formats, group by group, each in the order of the registry."""
    formats = written_formats()
    groups = list(dict.fromkeys(form.used_in for form in formats))
    return tuple(
        FormatRow(
            form.name,
            form.title,
            form.used_in,
            f"{form.used_in} {form.also} {form.file_name}",
            takes_parent=form.write_in_parent is not None,
            takes_rectified=form.is_for_rectified,
        )
        for form in sorted(formats, key=lambda form: groups.index(form.used_in))
    )
