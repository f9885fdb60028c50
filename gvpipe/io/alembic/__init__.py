"""Alembic caches (.abc, Ogawa) by Alembic's own library, package alembic3d: reading and writing.

Source: Sony Pictures Imageworks and Industrial Light & Magic, Alembic 1.8: AbcGeom.
"""
