"""Triangles and what follows from them: adjacency, vertex hierarchy, traversal, lattice."""
