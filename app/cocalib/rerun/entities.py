"""Where everything is in the Rerun recording: entity paths and the timeline."""

__all__ = [
    "ACC",
    "AED",
    "AGAINST_CAMERA",
    "AGAINST_RETURNS",
    "BOXES",
    "CAMERA",
    "CAMERA_POSITION",
    "CLICKED_NOW",
    "METRICS",
    "PAIRS",
    "PICTURE",
    "RADAR",
    "REFLECTORS",
    "RESIDUALS",
    "RETURNS",
    "RETURNS_SEEN",
    "SEEN_RETURNS",
    "SUMMARY",
    "TIMELINE",
]

TIMELINE = "recorded"
"""The stamps of the recording, as the solver uses them."""

RADAR = "radar"
"""The root: the radar's frame, x forward, y left, z up."""
RETURNS = f"{RADAR}/returns"
REFLECTORS = f"{RADAR}/reflectors"
CAMERA = f"{RADAR}/camera"
CAMERA_POSITION = f"{RADAR}/camera_position_95"
AGAINST_CAMERA = f"{RADAR}/against"

PICTURE = f"{CAMERA}/picture"
SEEN_RETURNS = f"{PICTURE}/returns"
AGAINST_RETURNS = f"{PICTURE}/returns_against"
BOXES = f"{PICTURE}/boxes"
PAIRS = f"{PICTURE}/all_clicks"
CLICKED_NOW = f"{PICTURE}/clicked_now"

METRICS = "metrics"
RESIDUALS = f"{METRICS}/residual_px"
AED = f"{METRICS}/aed_px"
ACC = f"{METRICS}/acc_percent"
RETURNS_SEEN = f"{METRICS}/returns_in_picture"
SUMMARY = "summary"
