"""The joints that static_transform_publishers publish: in commands and scripts, and in launch files of ROS 1 and ROS 2."""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.format import Form, WrittenPose
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.syntax.xml_places import placed_xml
from calib_core.interchange.trees.frame_tree import Joint, JointNumbers, Place, Slot, TreePart
from calib_core.parsing import python_tree

PUBLISHER = "static_transform_publisher"
_QUATERNION = ("qx", "qy", "qz", "qw")
_WORD = re.compile(r"""(?:"[^"\n]*"|'[^'\n]*'|[^\s"'\\;&|])+""")
_REST_OF_COMMAND = re.compile(r"""(?:"[^"\n]*"|'[^'\n]*'|\\\r?\n|[^\n;&|])*""")


@dataclass(frozen=True, slots=True)
class _Word:
    """A word of a command.

    Attributes:
        text: without its quotes.
        start: index of its first character in the text, within the quotes.
        end: index after its last one; -1 if the word is written in some other way than it reads.
        line: from 1.
    """

    text: str
    start: int
    end: int
    line: int


def recognizes_publishers(content: Content) -> bool:
    """Return whether a launch file, a script or a command runs a static_transform_publisher."""
    if content.syntax == "xml":
        return content.root.tag == "launch"
    return content.syntax == "lines" and (PUBLISHER in content.text or "generate_launch_description" in content.text)


def read_publishers(content: Content, source: str) -> TreePart:
    """Read the transform of every publisher.

    Raises:
        InputError: one has no pose between two frames.
    """
    text = content.text
    if content.syntax == "xml":
        name, commands = "tf2-launch-xml", list(_in_xml(text, source))
        if not any(f'exec="{PUBLISHER}"' in line for line in text.splitlines()):
            name = "tf1-launch"
    elif "generate_launch_description" in text:
        name, commands = "tf2-launch-py", list(_in_python(text, source))
    else:
        name, commands = "tf2", list(_in_script(text))
    joints = tuple(_joint(words, source) for words in commands if words)
    return TreePart(name, joints, hint="" if joints else f"it runs no {PUBLISHER} with arguments written out")


def _in_script(text: str) -> Iterator[list[_Word]]:
    for match in re.finditer(PUBLISHER, text):
        line_start = text.rfind("\n", 0, match.start()) + 1
        if text[line_start:].lstrip().startswith("#"):
            continue
        rest = _REST_OF_COMMAND.match(text, match.end())
        yield list(_words(text, match.end(), rest.end() if rest else len(text)))


def _words(text: str, start: int, end: int) -> Iterator[_Word]:
    """Split a part of the text as a shell does, as far as commands of numbers and names need it."""
    for match in _WORD.finditer(text, start, end):
        if match[0].startswith("#"):
            return
        plain = re.sub(r"""["']""", "", match[0])
        quoted = plain != match[0]
        whole = quoted and match[0][1:-1] == plain
        first, last = (match.start() + 1, match.end() - 1) if whole else match.span()
        yield _Word(plain, first, last if whole or not quoted else -1, text.count("\n", 0, match.start()) + 1)


def _in_xml(text: str, source: str) -> Iterator[list[_Word]]:
    for node in placed_xml(text, source=source).everything():
        if node.tag != "node" or PUBLISHER not in (node.attributes.get("exec"), node.attributes.get("type")):
            continue
        span = node.attribute_span(text, "args")
        if span is None:
            continue
        if "&" not in text[slice(*span)]:
            yield list(_words(text, *span))
            continue
        line = text.count("\n", 0, span[0]) + 1  # with entities, the words read otherwise than they are written
        arguments = node.attributes["args"]
        yield [_Word(word.text, word.start, -1, line) for word in _words(arguments, 0, len(arguments))]


def _in_python(text: str, source: str) -> Iterator[list[_Word]]:
    tree = python_tree(text, source=source)
    lines = text.splitlines(keepends=True)
    starts = np.concatenate([[0], np.cumsum([len(line) for line in lines])])
    for call in ast.walk(tree):
        if not isinstance(call, ast.Call):
            continue
        given = {keyword.arg: keyword.value for keyword in call.keywords}
        program, arguments = given.get("executable", given.get("node_executable")), given.get("arguments")
        runs_it = program is None or (isinstance(program, ast.Constant) and program.value == PUBLISHER)
        if runs_it and isinstance(arguments, ast.List):
            yield [_constant(item, lines, starts, source) for item in arguments.elts]


def _constant(item: ast.expr, lines: list[str], starts: np.ndarray, source: str) -> _Word:
    line = lines[item.lineno - 1]
    start = int(starts[item.lineno - 1]) + len(line.encode()[: item.col_offset].decode())
    if not isinstance(item, ast.Constant):
        return _Word(f"$({ast.unparse(item)})", start, -1, item.lineno)
    value = str(item.value)
    written = line[start - int(starts[item.lineno - 1]) :]
    if written[:1] in ("'", '"') and written[1:].startswith(value + written[0]):
        return _Word(value, start + 1, start + 1 + len(value), item.lineno)
    return _Word(value, start, -1, item.lineno)


def _joint(words: list[_Word], source: str) -> Joint:
    words = [word for word in words if ":=" not in word.text]
    place = Place(source, words[0].line if words else None)
    named = _by_name(words)
    if named:
        return _posed_by_name(named, words, place)
    count = 7 if len(words) >= 9 and _is_number(words[6]) else 6
    if not count + 2 <= len(words) <= count + 3:
        raise InputError(
            f"{place}: expected 6 or 7 numbers and two frames after {PUBLISHER}, found {len(words)} words; correct it"
        )
    rotation = words[3:7] if count == 7 else words[5:2:-1]  # yaw, pitch and roll, in this order
    form: Form = "quaternion_xyzw" if count == 7 else "rpy"
    return _posed(words[count].text, words[count + 1].text, form, words[:3], rotation, place)


def _by_name(words: list[_Word]) -> dict[str, _Word]:
    """Return the named arguments: "--x 1" and "--x=1"."""
    found, index = {}, 0
    while index < len(words):
        word = words[index]
        index += 1
        if not re.match(r"--[a-z]", word.text):
            continue
        name, equals, value = word.text[2:].partition("=")
        if equals:
            start = word.start + len(name) + 3
            found[name] = _Word(value, start, word.end, word.line)
        elif index < len(words):
            found[name] = words[index]
            index += 1
    return found


def _posed_by_name(named: dict[str, _Word], words: list[_Word], place: Place) -> Joint:
    at = words[0].start  # where arguments that are left out can be added
    can_add = all(word.end >= 0 for word in words) and at > 0

    def argument(label: str) -> _Word:
        return named.get(label, _Word("1" if label == "qw" else "0", at, -1, place.line or 0))

    form: Form = "quaternion_xyzw" if set(_QUATERNION) & set(named) else "rpy"
    labels = _QUATERNION if form == "quaternion_xyzw" else ("roll", "pitch", "yaw")
    parent, child = (named[label].text if label in named else "" for label in ("frame-id", "child-frame-id"))
    translation, rotation = ([argument(label) for label in part] for part in (("x", "y", "z"), labels))
    joint = _posed(parent, child, form, translation, rotation, place)
    if joint.numbers is None and can_add and joint.written is not None:
        slots = [
            Slot(word.start, word.end) if label in named else Slot(at, at, f"--{label} ", " ")
            for label, word in zip(("x", "y", "z", *labels), (*translation, *rotation), strict=True)
        ]
        numbers = JointNumbers(form, tuple(slots[:3]), tuple(slots[3:]))
        return Joint.posed(parent, child, joint.written, place, numbers=numbers)
    return joint


def _posed(parent: str, child: str, form: Form, translation: list[_Word], rotation: list[_Word], place: Place) -> Joint:
    if not parent or not child:
        raise InputError(f"{place}: a frame's name is missing; add --frame-id and --child-frame-id")
    words = [*translation, *rotation]
    numbers = JointNumbers.at(form, [(word.start, word.end) if word.end >= 0 else None for word in words])
    wrong = next((word for word in words if not _is_number(word)), None)
    if wrong is not None:
        return Joint(
            parent, child, None, place, problem=f"{wrong.text!r} is not a number; write it out", numbers=numbers
        )
    values = np.array([float(word.text) for word in words])
    written = WrittenPose(form, values[3:], values[:3], "radar_from_camera")
    return Joint.posed(parent, child, written, place, numbers=numbers)


def _is_number(word: _Word) -> bool:
    try:
        return abs(float(word.text)) <= 1e12
    except ValueError:
        return False
