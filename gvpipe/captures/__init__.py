"""Animations whose vertices and triangles change: shots into one file, and out of it."""
