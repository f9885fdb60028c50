"""Which parts of a sequence are blocks of a VTKHDF file: those that follow each other in vertices and in polygons."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gvpipe.asset.part import Part
from gvpipe.io.simulation.poly_content import PolyContent
from gvpipe.io.simulation.vtkhdf import ROOT
from gvpipe.model.sequence import MeshSequence

MOST_BLOCKS = 1000  # to write or to open one takes 15 ms, so that more parts are numbers of cells


class Block(NamedTuple):
    """Where a block's numbers are in the sequence's.

    Args:
        path: of its group.
        vertices, polygons: that it has.
    """

    path: str
    vertices: slice
    polygons: slice

    def rows(self, domain: str) -> slice:
        """Its rows of numbers per vertex, or per polygon."""
        return self.vertices if domain == "vertex" else self.polygons


def own_blocks(parts: Sequence[Part], n_vertices: int) -> list[str]:
    """Names for the blocks of a file, all different; none where parts are no blocks.

    Parts are blocks where there are several, their vertices follow each other, and each has triangles.
    """
    edges = [0, *(part.vertices[1] for part in parts)]
    follow = all(part.vertices[0] == edge for part, edge in zip(parts, edges, strict=False))
    if len(parts) < 2 or len(parts) > MOST_BLOCKS or not follow or edges[-1] != n_vertices:
        return []
    if any(part.triangles[1] == part.triangles[0] for part in parts):
        return []
    names: dict[str, int] = {}
    for number, part in enumerate(parts):
        plain = part.name.replace("/", "_").replace("\0", "")
        plain = f"part_{number}" if plain.strip(".") == "" else plain
        own, again = plain, 2
        while own in names:
            own, again = f"{plain}_{again}", again + 1
        names[own] = number
    return list(names)


def find_blocks(sequence: MeshSequence, content: PolyContent) -> list[Block]:
    """Return a block for each part, or one of everything where `own_blocks` has no names."""
    if not own_blocks(sequence.parts, sequence.n_vertices):
        return [Block(ROOT, slice(0, sequence.n_vertices), slice(0, len(content.first)))]
    edges = np.searchsorted(content.first, [part.triangles for part in sequence.parts]).tolist()
    return [
        Block(f"{ROOT}/Block_{number}", slice(*part.vertices), slice(*polygons))
        for number, (part, polygons) in enumerate(zip(sequence.parts, edges, strict=True))
    ]
