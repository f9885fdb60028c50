"""The lattice of a base frame in a header: origin x, y, z and step, model units."""

from __future__ import annotations

from gvpipe.container.json_object import JsonObject
from gvpipe.container.segments import HUGE
from gvpipe.mesh.lattice import Lattice

KEY = "base"


def read_lattice(fields: JsonObject) -> Lattice:
    """Return a header's lattice; raises `CorruptFile` for anything else."""
    x, y, z, step = fields.numbers(KEY, 4, -HUGE, HUGE)
    if not 0 < step <= HUGE:
        raise fields.wrong(KEY, "a step above 0")
    return Lattice((x, y, z), step)
