"""Write the table of exports in docs/formats.md from the registry: `python docs/make_formats_table.py`."""

import re
from pathlib import Path

from calib_core.interchange.formats.registry import CAMERA_ONLY, FORMATS

PAGE = Path(__file__).parent / "formats.md"
_HEAD = "| FORMAT | what | file | camera | for returns | meaning of the numbers |\n|---|---|---|---|---|---|\n"
_POSE_FOR = {"raw": "as reported", "corrected": "corrected", None: "-"}
_CAMERA = {"none": "none", "matrix": "K only", "lens": "lens"}


def with_table(page: str) -> str:
    """Return the page with the table's rows as the registry has them."""
    rows = [
        f"| `{known.name}` | {known.title} | `{known.file_name}` | {_CAMERA[known.camera]} | "
        f"{_POSE_FOR[known.pose_for]} | {known.numbers} |\n"
        for known in (*FORMATS, *CAMERA_ONLY)
    ]
    return re.sub(re.escape(_HEAD) + r"(?:\|.*\n)*", lambda _: _HEAD + "".join(rows), page)


if __name__ == "__main__":
    PAGE.write_text(with_table(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
