"""The joints of a URDF or xacro; macros and expressions of xacro are not expanded, and said so where they matter."""

import re
from collections.abc import Iterator

import numpy as np

from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.format import WrittenPose
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.syntax.xml_places import PlacedElement, placed_xml
from calib_core.interchange.trees.frame_tree import Joint, JointNumbers, Place, Slot, TreePart

XACRO_COMMAND = "expand it first: xacro FILE.xacro > FILE.urdf"
_EXPRESSION = re.compile(r"\$[({]")
_HARMLESS = {"xacro:property", "xacro:arg"}
_PARTS = ("xyz", "rpy")


def recognizes_urdf(content: Content) -> bool:
    """Return whether a file is a robot description."""
    return content.root.tag == "robot"


def read_urdf(text: str, source: str) -> TreePart:
    """Read every joint with two links.

    Raises:
        InputError: it is not XML, or the numbers of an origin are not numbers.
    """
    root = placed_xml(text, source=source)
    joints = [joint for one, inside in _joints(root) if (joint := _joint(one, inside, text, source)) is not None]
    unexpanded = [one for one in root.everything() if one.tag.startswith("xacro:") and one.tag not in _HARMLESS]
    hint = ""
    if unexpanded:
        first = unexpanded[0]
        name = first.attributes.get("name") or first.attributes.get("filename") or ""
        hint = f"{source}:{first.line} has <{first.tag}{f' {name}' if name else ''}>, which is not expanded here; {XACRO_COMMAND}"
    return TreePart("urdf", tuple(joints), hint=hint)


def _joints(element: PlacedElement, inside: str = "") -> Iterator[tuple[PlacedElement, str]]:
    """Yield the joints of the robot, each with the macro or condition that it is inside of; "" for none."""
    for one in element.children:
        if one.tag == "joint":
            yield one, inside
        elif one.tag.startswith("xacro:"):
            yield from _joints(one, f"<{one.tag}> of line {one.line}")


def _joint(element: PlacedElement, inside: str, text: str, source: str) -> Joint | None:
    parent, child = element.child("parent"), element.child("child")
    if parent is None or child is None:
        return None
    above, below = (end.attributes.get("link", "") for end in (parent, child))
    if not above or not below or _EXPRESSION.search(above + below):
        return None
    name = element.attributes.get("name", "")
    origin = element.child("origin")
    place = Place(source, (origin or element).line)
    numbers = _numbers(origin, text) if origin is not None else _new_numbers(child, text)
    problem = _problem(element, inside, origin)
    if problem:
        return Joint(above, below, None, place, name, problem, None, numbers)
    attributes = origin.attributes if origin is not None else {}
    xyz, rpy = (
        np.array(
            floats(attributes.get(key, "0 0 0").split(), source=source, place=f"line {place.line}: {key}", length=3)
        )
        for key in _PARTS
    )
    written = WrittenPose("rpy", rpy, xyz, "radar_from_camera")
    return Joint.posed(above, below, written, place, name=name, numbers=numbers)


def _problem(element: PlacedElement, inside: str, origin: PlacedElement | None) -> str:
    if inside:
        return f"it is inside {inside}, which is not expanded here; {XACRO_COMMAND}"
    for key in _PARTS if origin is not None else ():
        value = origin.attributes.get(key, "") if origin is not None else ""
        if _EXPRESSION.search(value):
            return f'its origin is an expression, {key}="{value}"; {XACRO_COMMAND}'
    kind = element.attributes.get("type", "")
    if kind != "fixed":
        return (
            f"it is {kind or 'of no type'}, and only fixed joints have one pose; make it fixed, or give another frame"
        )
    return ""


def _numbers(origin: PlacedElement, text: str) -> JointNumbers | None:
    """Find the numbers of an origin; an attribute that is missing gets its place before the end of the tag."""
    slots = []
    for key in _PARTS:
        span = origin.attribute_span(text, key)
        if span is None:
            end = origin.end - (2 if text[origin.end - 2 : origin.end] == "/>" else 1)
            end = len(text[:end].rstrip())
            slots.append(_new_slots(end, f' {key}="', '"'))
            continue
        words = [Slot(span[0] + m.start(), span[0] + m.end()) for m in re.finditer(r"\S+", text[slice(*span)])]
        if len(words) != 3:
            return None
        slots.append(tuple(words))
    return JointNumbers("rpy", slots[0], slots[1])


def _new_numbers(child: PlacedElement, text: str) -> JointNumbers:
    """Return the place of an origin that is not written yet: on a line of its own after the child."""
    line_start = text.rfind("\n", 0, child.start) + 1
    indent = text[line_start : child.start]
    newline = "\r\n" if text[:line_start].endswith("\r\n") else "\n"
    before = newline + indent if not indent.strip() else ""
    first = _new_slots(max(child.end, child.close + _close_length(child, text)), f'{before}<origin xyz="', '" ')
    second = _new_slots(first[0].start, 'rpy="', '"/>')
    return JointNumbers("rpy", first, second)


def _close_length(element: PlacedElement, text: str) -> int:
    return len(f"</{element.tag}>") if text.startswith(f"</{element.tag}>", element.close) else 0


def _new_slots(at: int, before: str, after: str) -> tuple[Slot, ...]:
    return Slot(at, at, before), Slot(at, at, " "), Slot(at, at, " ", after)
