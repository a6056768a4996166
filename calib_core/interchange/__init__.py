"""Read and write files: clicks, pairs, cameras, calibrations, formats of other tools. What a plug-in needs is named here."""

from calib_core.interchange.format import Format, ImportedCalibration, Reads, WrittenPose
from calib_core.interchange.syntax.content import Content

__all__ = ["Content", "Format", "ImportedCalibration", "Reads", "WrittenPose"]
