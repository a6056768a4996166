"""Proposals: where in the images the reflector stood, found by the machine for a person to confirm."""

from calib_core.proposing.automatic import AutomaticClicks, automatic_clicks
from calib_core.proposing.dwell_views import DwellView, ViewProgress, dwell_views
from calib_core.proposing.image_candidates import ImageCandidate
from calib_core.proposing.proposals import Proposal, Proposals
from calib_core.proposing.proposing import proposals_of
from calib_core.proposing.still_images import FrameSource

__all__ = [
    "AutomaticClicks",
    "DwellView",
    "FrameSource",
    "ImageCandidate",
    "Proposal",
    "Proposals",
    "ViewProgress",
    "automatic_clicks",
    "dwell_views",
    "proposals_of",
]
