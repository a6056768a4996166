"""Recognise messages of boxes by their fields: vision_msgs, darknet_ros_msgs, Foxglove's image annotations, and the like."""

from collections.abc import Sequence
from dataclasses import dataclass

from calib_core.recordings.messages.definitions import PRIMITIVES, Definition, Field

_CENTRES = (("bbox.center.position.x", "bbox.center.position.y"), ("bbox.center.x", "bbox.center.y"))
_SIZES = (("bbox.size_x", "bbox.size_y"), ("bbox.size.x", "bbox.size.y"))
_EDGES = (("xmin", "ymin", "xmax", "ymax"), ("x_min", "y_min", "x_max", "y_max"))
_LABELS = ("class_name", "Class", "class_id", "class", "label")
_SCORES = ("score", "probability", "confidence")
_HYPOTHESES = (("hypothesis.class_id", "hypothesis.score"), ("id", "score"))
_TRACKS = ("tracking_id", "track_id")
_STAMPS = ("image_header.stamp", "header.stamp")


@dataclass(frozen=True, slots=True)
class BoxLayout:
    """Where a message has its boxes. Paths are dotted names within an element of the list.

    Attributes:
        name: what kind of message it is, for people.
        boxes: the list of boxes.
        stamp: path of the picture's stamp in the message; "" if every element has its own (Foxglove).
        edges: paths of left, top, right and bottom; empty if the centre is given.
        centre: paths of the centre's u and v, the width and the height; empty if the edges are given.
        angle: path of the rectangle's turn [rad]; "" without one.
        label: path of the class; "" if it is among the hypotheses, or there is none.
        score: path of the confidence; "" likewise.
        hypotheses: the list of possible classes, and in it the paths of class and confidence; empty without one.
        track: path of the object's number or name; "" if objects are not followed.
    """

    name: str
    boxes: str
    stamp: str
    edges: tuple[str, ...] = ()
    centre: tuple[str, ...] = ()
    angle: str = ""
    label: str = ""
    score: str = ""
    hypotheses: tuple[str, ...] = ()
    track: str = ""

    @property
    def is_drawing(self) -> bool:
        """Whether boxes are drawn as lines and texts rather than stated."""
        return not self.edges and not self.centre


def box_layout(definition: Definition) -> BoxLayout | None:
    """Return where messages of a definition have boxes; None if they have none."""
    if _is_drawing(definition):
        return BoxLayout("image annotations", "points", "")
    stamp = next((path for path in _STAMPS if _field_at(definition, definition.type, path)), "")
    for field in definition.fields:
        if field.count is None or field.type not in definition.types or not stamp:
            continue
        found = _struct_layout(definition, field, stamp)
        if found is not None:
            return found
    return None


def _is_drawing(definition: Definition) -> bool:
    points = _field_at(definition, definition.type, "points")
    return points is not None and all(
        _field_at(definition, points.type, path) for path in ("timestamp", "type", "points", "outline_color")
    )


def _struct_layout(definition: Definition, field: Field, stamp: str) -> BoxLayout | None:
    def first(paths: Sequence[str]) -> str:
        return next((path for path in paths if _is_single(_field_at(definition, field.type, path))), "")

    def whole(choices: Sequence[tuple[str, ...]], kind: str = field.type) -> tuple[str, ...]:
        return next((one for one in choices if all(_is_single(_field_at(definition, kind, path)) for path in one)), ())

    edges, centre, size = whole(_EDGES), whole(_CENTRES), whole(_SIZES)
    if not edges and not (centre and size):
        return None
    results = _field_at(definition, field.type, "results")
    inner = whole(_HYPOTHESES, results.type) if results is not None and results.count is not None else ()
    return BoxLayout(
        name="2D detections" if centre else "bounding boxes",
        boxes=field.name,
        stamp=stamp,
        edges=edges,
        centre=() if edges else (*centre, *size),
        angle=first(("bbox.center.theta",)),
        label="" if inner else first(_LABELS),
        score="" if inner else first(_SCORES),
        hypotheses=("results", *inner) if inner else (),
        track=first((*_TRACKS, "id")) if centre else first(_TRACKS),
    )


def _is_single(field: Field | None) -> bool:
    """Return whether a field is one number or text."""
    return field is not None and field.count is None and (field.type in PRIMITIVES or field.type == "string")


def _field_at(definition: Definition, kind: str, path: str) -> Field | None:
    """Return the field at a dotted path within a type."""
    found = None
    for name in path.split("."):
        fields = definition.types.get(kind, ())
        found = next((field for field in fields if field.name == name), None)
        if found is None:
            return None
        kind = found.type
    return found
