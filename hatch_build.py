"""The description of the package: README with absolute links, since a package index knows no files of this project.

Links to files lead below `Source` of `[project.urls]`; while the project has no address, their words stay without a link.
"""

import re
from pathlib import Path

from hatchling.metadata.plugin.interface import MetadataHookInterface

_LINK = re.compile(r"(?P<image>!?)\[(?P<words>[^\]]*)\]\((?P<target>(?!https?:)[^)\s]+)\)")


def described(readme: str, address: str | None) -> str:
    """Return README's text with absolute links, or without those that would lead nowhere."""
    if address is None:
        return _LINK.sub(lambda link: "" if link["image"] else link["words"], readme)
    return _LINK.sub(lambda link: f"{link['image']}[{link['words']}]({address}/raw/HEAD/{link['target']})", readme)


class Description(MetadataHookInterface):
    """Gives hatchling the description."""

    def update(self, metadata: dict) -> None:
        """Set the description."""
        readme = (Path(self.root) / "README.md").read_text(encoding="utf-8")
        address = metadata.get("urls", {}).get("Source")
        metadata["readme"] = {"content-type": "text/markdown", "text": described(readme, address)}
