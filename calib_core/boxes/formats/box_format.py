"""What a format of boxes is: how its files are recognised, and how they are read."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any
from xml.etree.ElementTree import Element

from calib_core.boxes.file_frames import FileBoxes


@dataclass(frozen=True, slots=True, eq=False)
class BoxFile:
    """A file of boxes, or a folder or zip archive of files, its syntax parsed once.

    Attributes:
        source: its name, for messages.
        value: of JSON; None for anything else.
        root: of XML; None for anything else.
        members: the text files of a folder or archive, or a single text file, by their path with forward slashes.
        image_size_px: width and height of the recorded pictures, for formats that count in shares of them; None if unknown.
    """

    source: str
    value: Any = None
    root: Element | None = None
    members: Mapping[str, str] = field(default_factory=dict)
    image_size_px: tuple[int, int] | None = None

    @property
    def mapping(self) -> Mapping[str, Any]:
        """The value if it is a JSON object, otherwise an empty mapping."""
        return self.value if isinstance(self.value, dict) else {}


@dataclass(frozen=True, slots=True)
class BoxFormat:
    """A format of boxes that is read.

    Attributes:
        name: for messages, as its tool spells it.
        recognizes: whether a file is of this format, by its content; never raises.
        read: the frames and boxes of a recognised file; raises InputError with the place of what is wrong.
    """

    name: str
    recognizes: Callable[[BoxFile], bool]
    read: Callable[[BoxFile], FileBoxes]
