"""Proposals: where in the pictures the reflector stood, found by the machine for a person to confirm."""

from calib_core.proposing.automatic import AutomaticClicks, automatic_clicks
from calib_core.proposing.dwell_views import DwellView, ViewProgress, dwell_views
from calib_core.proposing.picture_candidates import PictureCandidate
from calib_core.proposing.proposals import Proposal, Proposals
from calib_core.proposing.proposing import proposals_of
from calib_core.proposing.still_pictures import FrameSource

__all__ = [
    "AutomaticClicks",
    "DwellView",
    "FrameSource",
    "PictureCandidate",
    "Proposal",
    "Proposals",
    "ViewProgress",
    "automatic_clicks",
    "dwell_views",
    "proposals_of",
]
