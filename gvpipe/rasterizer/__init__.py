"""A software rasterizer: one mesh and a camera in, one picture out."""
