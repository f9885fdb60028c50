"""Trajectory coding: a principal basis, and coefficients predicted from causal neighbours."""
