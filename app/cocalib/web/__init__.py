"""The one port: viser, our page, its frames and its channel."""
