"""A guaranteed error bound: displacements of the vertices that a codec leaves too far off."""
