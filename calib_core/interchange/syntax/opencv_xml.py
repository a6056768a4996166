"""OpenCV's FileStorage XML as plain values."""

from typing import Any
from xml.etree import ElementTree

from calib_core.errors import InputError

_MAX_CHARACTERS = 4 * 1024 * 1024


def parse_xml(text: str, *, source: str) -> ElementTree.Element:
    """Parse XML that has no document type, so no entity in it expands.

    Raises:
        InputError: it is not XML, or declares entities.
    """
    if len(text) > _MAX_CHARACTERS or "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise InputError(f"{source}: too large for a calibration, or declares a document type; give a plain XML file")
    try:
        return ElementTree.fromstring(text.lstrip("\ufeff \t\r\n"))
    except ElementTree.ParseError as error:
        raise InputError(f"{source}: not XML ({error}); correct it there") from None
    except ValueError as error:
        raise InputError(f"{source}: not XML ({error}); save it as UTF-8") from None


def load_opencv_xml(text: str, *, source: str) -> dict[str, Any]:
    """Return a FileStorage XML's values: matrices become mappings with rows, cols and data, as in its YAML.

    Raises:
        InputError: it is some other XML.
    """
    root = parse_xml(text, source=source)
    if not is_file_storage(root):
        raise InputError(f"{source}: XML with <{root.tag}>; expected OpenCV's <opencv_storage>")
    return opencv_values(root)


def is_file_storage(root: ElementTree.Element) -> bool:
    """Return whether XML is OpenCV's FileStorage."""
    return root.tag == "opencv_storage"


def opencv_values(root: ElementTree.Element) -> dict[str, Any]:
    """Return the values of parsed FileStorage XML.

    Raises:
        InputError: it is nested too deeply.
    """
    try:
        return {child.tag: _value(child) for child in root}
    except RecursionError:
        raise InputError("the XML is nested too deeply; correct the file") from None


def _value(element: ElementTree.Element) -> Any:
    if element.get("type_id") == "opencv-matrix":
        parts = {child.tag: (child.text or "").strip() for child in element}
        return {**parts, "data": parts.get("data", "").split()}
    if len(element):
        return {child.tag: _value(child) for child in element}
    return (element.text or "").strip().strip('"')
