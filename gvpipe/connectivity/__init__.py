"""Connectivity coding: triangles, seams and vertex order to bytes and back."""
