"""Calibrating a lens from a recording, a video or a folder of images, for the command line and the page."""

from cocalib.intrinsics.field_of_view import field_of_view_text
from cocalib.intrinsics.image_sources import OpenImages, RecordedImages, open_images
from cocalib.intrinsics.job import LensJob, LensSnapshot, LensStage, calibrate_from

__all__ = [
    "LensJob",
    "LensSnapshot",
    "LensStage",
    "OpenImages",
    "RecordedImages",
    "calibrate_from",
    "field_of_view_text",
    "open_images",
]
