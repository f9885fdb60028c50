"""Pictures of mesh sequences by the software rasterizer: stills, films, error maps, posters; see docs/render.md."""
