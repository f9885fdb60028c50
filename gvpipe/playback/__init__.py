"""Frames from files: players, files that are still written, and what a file says of itself."""
