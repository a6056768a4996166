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
    for name in waiting:
        text = "" if name in texts else _text(folder, name, standard=name != kind)
        if text:
            texts[name] = text if name == kind else f"\n{'=' * 80}\nMSG: {name}\n{text}"
            used = (one if "/" in one else f"{name.partition('/')[0]}/{one}" for one in _USED.findall(text))
            waiting += sorted({one.replace("/", "/msg/") for one in used} - {*waiting})
    return "".join(texts.values())


def _text(folder: Path, name: str, *, standard: bool) -> str:
    """Return a type's own file, or what every ROS 2 installs; "" if there is neither."""
    file = folder / f"{name}.msg"
    if _NAME.fullmatch(name) and file.is_file() and file.stat().st_size <= _LONGEST:
        return file.read_text("utf-8", errors="replace")
    if not standard:
        return ""
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    return store.generate_msgdef(name, ros_version=2)[0] if name in store.types else ""
