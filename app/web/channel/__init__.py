"""The page's channel: what it sends and gets, and what all tabs share."""
