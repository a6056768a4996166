"""The page's channel: the messages sent and received, and what all tabs share."""
