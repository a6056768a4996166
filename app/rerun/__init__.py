"""A recording and its calibration for the Rerun viewer; rerun-sdk is imported only here, and only when used."""
