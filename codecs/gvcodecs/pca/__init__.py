"""Trajectory PCA with geometric predictors (Vasa and Skala 2010)."""

from gvcodecs.pca.encoder import Pca

__all__ = ["Pca"]
