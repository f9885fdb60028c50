"""Wavefront OBJ frames and their material files."""
