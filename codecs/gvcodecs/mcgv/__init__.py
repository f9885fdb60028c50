"""Multi-chart geometry video (Mamou, Zaharia and Preteux 2007)."""

from gvcodecs.mcgv.encoder import Mcgv

__all__ = ["Mcgv"]
