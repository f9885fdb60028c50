"""Animated fields on a mesh: values of vertices or triangles over the frames, coded within a bound on every value."""
