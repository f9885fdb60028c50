"""Frames as VTK's .vtp files: XML with compressed arrays behind it.

Each array is a header and blocks of zlib, as `gvpipe.io.simulation.xml_arrays` describes them. Positions are float64 where the
sequence has an origin, which is added; else float32.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from xml.sax.saxutils import quoteattr

import numpy as np

from gvpipe.foundation.arrays import Array, Float32
from gvpipe.io.mesh import FrameEncoder
from gvpipe.io.simulation.poly_content import PolyContent, poly_content
from gvpipe.io.simulation.xml_arrays import TYPES
from gvpipe.model.sequence import MeshSequence

BLOCK = 1 << 20  # bytes of a block before compression
LEVEL = 1  # of compression: level 6 takes three to six times as long, and saves 2 % of triangles
NAMES = {np.dtype(code): name for name, code in TYPES.items()}


class Appended:
    """The bytes behind the XML, and the elements that refer to them."""

    def __init__(self) -> None:
        self.data: list[bytes] = []
        self._size = 0

    def element(self, name: str, values: Array) -> str:
        """The element of an array ``(rows,)`` or ``(rows, C)``, whose bytes are appended."""
        width = values.shape[1] if values.ndim == 2 else 1
        packed = _packed(np.ascontiguousarray(values, values.dtype.newbyteorder("<")).tobytes())
        element = (
            f"<DataArray type={quoteattr(NAMES[values.dtype.newbyteorder('=')])} Name={quoteattr(name)} "
            f'NumberOfComponents="{width}" format="appended" offset="{self._size}"/>'
        )
        self.data.append(packed)
        self._size += len(packed)
        return element

    def texts(self, named: Mapping[str, Sequence[str]]) -> str:
        """The element ``FieldData`` with texts by name, ``""`` if there are none; each text ends with a zero."""
        elements = []
        for name, texts in named.items():
            packed = _packed(b"".join(text.encode() + b"\0" for text in texts))
            elements.append(
                f'<Array type="String" Name={quoteattr(name)} NumberOfTuples="{len(texts)}" format="appended" '
                f'offset="{self._size}"/>'
            )
            self.data.append(packed)
            self._size += len(packed)
        return f"<FieldData>{''.join(elements)}</FieldData>" if elements else ""


def encode_vtp(sequence: MeshSequence, name: str) -> FrameEncoder:
    """Return how the frames of a sequence become .vtp files."""
    content = poly_content(sequence, "VTP", parts="numbers")
    origin = sequence.origin

    def encode(positions: Float32, fields: Mapping[str, Array]) -> bytes:
        points = positions + origin if origin.any() else positions
        return vtp_bytes(content, points, fields)

    return FrameEncoder(encode, tuple(content.fields), content.notes)


def vtp_bytes(content: PolyContent, points: Array, fields: Mapping[str, Array]) -> bytes:
    """One frame as a whole file; ``fields`` are its values ``(R, C)`` by name."""
    appended = Appended()
    groups = []
    for tag, domain in (("PointData", "vertex"), ("CellData", "triangle")):
        arrays = content.still(domain)
        arrays |= {key: content.rows(one, fields[key][None])[0] for key, one in content.moving(domain).items()}
        groups.append(
            f"<{tag}{content.roles(domain)}>{''.join(appended.element(key, each) for key, each in arrays.items())}</{tag}>"
        )
    place = appended.element("Points", points)
    # 32 bits where they are enough, which VTK reads as they are
    integer = np.int32 if len(content.nodes) < 1 << 31 else np.int64
    polys = appended.element("connectivity", content.nodes.astype(integer))
    polys += appended.element("offsets", content.offsets[1:].astype(integer))
    sizes = f'NumberOfPoints="{len(points)}" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0"'
    head = (
        '<?xml version="1.0"?>\n<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64" '
        f'compressor="vtkZLibDataCompressor"><PolyData>{appended.texts(content.texts)}'
        f'<Piece {sizes} NumberOfPolys="{len(content.first)}">'
        f"{groups[0]}{groups[1]}<Points>{place}</Points><Polys>{polys}</Polys></Piece></PolyData>"
        '<AppendedData encoding="raw">_'
    )
    return head.encode() + b"".join(appended.data) + b"</AppendedData></VTKFile>\n"


def _packed(raw: bytes) -> bytes:
    """Header and compressed blocks."""
    blocks = [zlib.compress(raw[at : at + BLOCK], LEVEL) for at in range(0, len(raw), BLOCK)]
    header = [len(blocks), BLOCK, len(raw) % BLOCK, *map(len, blocks)] if blocks else [0]
    return np.array(header, "<u8").tobytes() + b"".join(blocks)
