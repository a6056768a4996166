"""Read the definitions of messages from .msg files beside a recording that has none."""

import re
from pathlib import Path

_NAME = re.compile(r"\w+/msg/\w+")
_USED = re.compile(r"^\s*(\w+(?:/\w+)?)", re.MULTILINE)
_LONGEST = 1 << 18


def definition_beside(folder: Path, kind: str) -> str:
    """Return the definition of a type and of those it uses, from files PACKAGE/msg/TYPE.msg; "" if there is none."""
    texts: dict[str, str] = {}
    waiting = [kind]
    while waiting:
        name = waiting.pop()
        text = "" if name in texts or not _NAME.fullmatch(name) else _text(folder / f"{name}.msg")
        if not text and texts and name not in texts:
            text = _standard(name)
        if text:
            texts[name] = text if name == kind else f"\n{'=' * 80}\nMSG: {name}\n{text}"
            package = name.partition("/")[0]
            waiting += [
                used.replace("/", "/msg/") if "/" in used else f"{package}/msg/{used}" for used in _USED.findall(text)
            ]
    return "".join(texts.values())


def _text(file: Path) -> str:
    if file.is_file() and file.stat().st_size <= _LONGEST:
        return file.read_text("utf-8", errors="replace")
    return ""


def _standard(name: str) -> str:
    """Return the definition of a type that is installed with every ROS 2."""
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    return store.generate_msgdef(name, ros_version=2)[0] if name in store.types else ""
