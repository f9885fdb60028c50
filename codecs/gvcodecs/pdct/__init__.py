"""Predictive DCT coding in local coordinate frames (Amjoun and Strasser 2008)."""

from gvcodecs.pdct.encoder import Pdct
from gvcodecs.pdct.stream import StreamEncoder, StreamReader

__all__ = ["Pdct", "StreamEncoder", "StreamReader"]
