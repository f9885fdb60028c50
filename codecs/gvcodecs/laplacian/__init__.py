"""Trajectory PCA coded by geometric Laplacians of an average mesh (Vasa, Marras, Hormann and Brunnett 2014)."""

from gvcodecs.laplacian.encoder import Laplacian

__all__ = ["Laplacian"]
