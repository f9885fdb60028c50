"""The layout of a picture: which pixel carries which point."""
