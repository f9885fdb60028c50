"""Rate-distortion sweeps, their comparison and their plots."""
