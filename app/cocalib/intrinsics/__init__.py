"""Calibrating a lens from a recording, a video or a folder of pictures, for the command line and the page."""

from cocalib.intrinsics.calibrating import calibrate_from
from cocalib.intrinsics.field_of_view import field_of_view_text
from cocalib.intrinsics.job import LensJob, LensSnapshot, LensStage
from cocalib.intrinsics.picture_sources import OpenPictures, open_pictures
from cocalib.intrinsics.recorded_pictures import RecordedPictures

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
