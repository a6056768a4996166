"""Bring a calibration to where it is used: into a recording, for players and viewers."""

from calib_core.deployment.into_recording import RecordingWritten, write_into_recording

__all__ = ["RecordingWritten", "write_into_recording"]
