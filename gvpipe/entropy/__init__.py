"""Entropy coding: integers to range-coded bytes and back."""
