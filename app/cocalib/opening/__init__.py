"""Open a recording for the page: which one, how it is read, with which intrinsics and session; ask the page if unclear."""

from cocalib.opening.choice import Choice, GivenClicks
from cocalib.opening.serving import Serving, serve

__all__ = ["Choice", "GivenClicks", "Serving", "serve"]
