"""Every format of boxes in one table, in the order in which they are tried. To add one: write its module, and add a line."""

from calib_core.boxes.formats.box_format import BoxFormat
from calib_core.boxes.formats.own import OWN

__all__ = ["BOX_FORMATS"]

BOX_FORMATS: tuple[BoxFormat, ...] = (OWN,)
