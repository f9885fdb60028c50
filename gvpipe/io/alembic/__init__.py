"""Alembic caches (.abc, Ogawa) by Alembic's own library, package alembic3d: reading and writing.

Source: Sony Pictures Imageworks and Industrial Light & Magic, Alembic 1.8: AbcGeom.
"""

from gvpipe.io.alembic.process import read_alembic
from gvpipe.io.alembic.writer import write_alembic

__all__ = ["read_alembic", "write_alembic"]
