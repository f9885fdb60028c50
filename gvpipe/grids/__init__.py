"""Grids of cells: what a simulation's mesh is made of, and what lies inside of a surface."""
