"""Static attributes of a mesh that the decoder has: values, seams, polygons, and the order of triangles."""
