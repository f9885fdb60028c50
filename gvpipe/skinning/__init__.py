"""Skeletons for any sequence: which vertices follow which joints, and how these move."""
