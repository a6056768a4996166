"""What people are told: codes, facts and actions as sentences, remedies and labels. Nothing reads them back.

Imports whatever it words; the mathematics never imports it. `str` of a calibration, an outcome, a warning or a verdict is made
here, too (`summary`).
"""

from calib_core.words import summary  # noqa: F401  registers what `str` returns
