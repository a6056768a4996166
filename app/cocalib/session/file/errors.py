"""The error of session files."""

from calib_core.errors import CalibrationError


class SessionFileError(CalibrationError):
    """A session that cannot be opened, read or written; what is on disk is unchanged."""
