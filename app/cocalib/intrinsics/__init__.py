"""Calibrating a lens from a recording, a video or a folder of pictures, for the command line and the page."""

from cocalib.intrinsics.field_of_view import field_of_view_text
from cocalib.intrinsics.job import LensJob, LensSnapshot, LensStage, calibrate_from
from cocalib.intrinsics.picture_sources import OpenPictures, RecordedPictures, open_pictures

__all__ = [
    "LensJob",
    "LensSnapshot",
    "LensStage",
    "OpenPictures",
    "RecordedPictures",
    "calibrate_from",
    "field_of_view_text",
    "open_pictures",
]
