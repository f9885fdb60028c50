"""The version, in a room of its own, so that parts which note it import nothing above them."""

__version__ = "1.0.0"
