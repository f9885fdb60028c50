"""Normals of frames: which a sequence has of its own, and which follow from its positions."""
