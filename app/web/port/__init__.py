"""The one port: who may talk to it, what it answers, and how it is started."""
