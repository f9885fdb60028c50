"""The base frame: welded points, and which of them move."""
