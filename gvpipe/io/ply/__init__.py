"""PLY frames."""
