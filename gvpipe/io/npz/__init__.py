"""NumPy archives: all that a sequence has."""
