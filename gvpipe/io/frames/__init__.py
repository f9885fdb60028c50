"""Sequences of frame files: which files, what of them moves, and how they are written."""
