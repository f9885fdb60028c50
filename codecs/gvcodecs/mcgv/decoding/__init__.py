"""From a bitstream back to frames: pictures are frames, or coefficients of trajectories."""
