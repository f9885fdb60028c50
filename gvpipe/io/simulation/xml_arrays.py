"""The arrays of VTK's XML files: as text, as base64, or appended behind the XML; plain or compressed in blocks.

An encoded array is a header of unsigned integers and its bytes. Plain: one integer, the number of bytes. Compressed: the number
of blocks, the bytes of a full block, those of a partial last block (0: it is full), and the compressed bytes of each block.
In base64 the header is encoded apart from the blocks if they are compressed, else with the bytes.

Source: Kitware, VTK file formats, "XML file formats", and vtkXMLDataParser of VTK 9.7.
"""

from __future__ import annotations

import base64
import lzma
import zlib
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.io.simulation.limits import check_bytes
from gvpipe.io.simulation.xml_root import parse_xml

TYPES = {
    "Int8": "i1", "UInt8": "u1", "Int16": "i2", "UInt16": "u2", "Int32": "i4", "UInt32": "u4", "Int64": "i8", "UInt64": "u8",
    "Float32": "f4", "Float64": "f8",
}  # fmt: skip
HEADER_TYPES = {"UInt32": "u4", "UInt64": "u8"}
MAX_DICTIONARY = 1 << 28  # bytes that LZMA may take, whatever a block says
COMPRESSORS = {"": "", "vtkZLibDataCompressor": "zlib", "vtkLZMADataCompressor": "lzma"}


@dataclass(frozen=True, eq=False)
class VtkXml:
    """A parsed file.

    Args:
        root: its element ``VTKFile``.
        appended: the bytes behind the mark ``_`` of ``AppendedData``.
        is_raw: whether those are plain bytes, not base64.
        order: ``"<"`` or ``">"``.
        header: type of the integers of array headers.
        compressor: ``""``, ``"zlib"`` or ``"lzma"``.
        bytes_file: size of the file.
    """

    root: ElementTree.Element
    appended: bytes
    is_raw: bool
    order: str
    header: np.dtype[np.unsignedinteger]
    compressor: str
    bytes_file: int


def parse_vtk_xml(data: bytes) -> VtkXml:
    """Parse a file's bytes; no array is decoded.

    Raises:
        ValueError: it is no such file, is cut short, or is compressed in a way that is not read.
    """
    if not data.strip():
        raise ValueError("the file is empty")
    xml, appended, is_raw = _split_appended(data)
    root = parse_xml(xml, "VTKFile")
    compressor = root.get("compressor", "")
    if compressor not in COMPRESSORS:
        raise ValueError(f"it is compressed by {compressor}, which is not read; save it with ZLib or without compression")
    order = ">" if root.get("byte_order") == "BigEndian" else "<"
    header = np.dtype(order + HEADER_TYPES.get(root.get("header_type", "UInt32"), "u4"))
    return VtkXml(root, appended, is_raw, order, header, COMPRESSORS[compressor], len(data))


def read_array(file: VtkXml, element: ElementTree.Element, n_rows: int | None = None) -> Array:
    """Decode an array: ``(rows,)``, or ``(rows, C)`` for several components.

    Args:
        file: that holds it.
        element: ``DataArray``.
        n_rows: how many rows it must have; None: any number.

    Raises:
        ValueError: a type, size or encoding that does not hold.
    """
    name = element.get("Name", "an array")
    if element.get("type") not in TYPES:
        raise ValueError(f"{name!r} is of type {element.get('type')}, not of numbers")
    dtype = np.dtype(file.order + TYPES[element.get("type", "")])
    width = int(element.get("NumberOfComponents") or 1)
    if not 1 <= width <= 1 << 20:
        raise ValueError(f"{name!r} has {width} components")
    if n_rows is not None:
        check_bytes((n_rows, width), dtype.itemsize, file.bytes_file, repr(name))
    form = element.get("format", "ascii")
    values = (
        _from_text(element.text or "", dtype) if form == "ascii" else np.frombuffer(_decode(file, element, form, name), dtype)
    )
    if values.size % width or (n_rows is not None and values.size != n_rows * width):
        needed = "" if n_rows is None else f", {n_rows} x {width} are needed"
        raise ValueError(f"{name!r} has {values.size} numbers{needed}")
    return values.reshape(-1, width) if width > 1 else values


def read_texts(file: VtkXml, element: ElementTree.Element) -> list[str]:
    """Decode an ``Array`` of texts, each of which ends with a zero; raises `ValueError`."""
    name, form = element.get("Name", "an array"), element.get("format", "ascii")
    if form == "ascii":
        data = bytes(int(word) & 255 for word in (element.text or "").split())  # VTK writes signed bytes
    else:
        data = _decode(file, element, form, name)
    return [text.decode("utf-8", "replace") for text in data.split(b"\0")[:-1]]


def _split_appended(data: bytes) -> tuple[bytes, bytes, bool]:
    """The XML without its appended bytes, those bytes, and whether they are raw."""
    at = data.find(b"<AppendedData")
    if at < 0:
        return data, b"", False
    end = data.find(b">", at)
    mark = data.find(b"_", end)
    if end < 0 or mark < 0:
        raise ValueError("it is cut short inside AppendedData")
    return data[:at] + b"</VTKFile>", data[mark + 1 :], b"raw" in data[at:end]


def _from_text(text: str, dtype: np.dtype[np.generic]) -> Array:
    words = text.split()
    if dtype.kind == "f":
        return np.array(words, np.float64).astype(dtype)
    return np.array(words, np.uint64 if dtype.kind == "u" else np.int64).astype(dtype)


def _decode(file: VtkXml, element: ElementTree.Element, form: str, name: str) -> bytes:
    if form == "binary":
        source, is_raw = "".join((element.text or "").split()).encode(), False
    elif form == "appended":
        offset = int(element.get("offset") or 0)
        if not 0 <= offset <= len(file.appended):
            raise ValueError(f"{name!r} starts at byte {offset} of {len(file.appended)}; the file is cut short")
        source, is_raw = file.appended[offset:], file.is_raw
    else:
        raise ValueError(f"{name!r} has format {form!r}; ascii, binary or appended is needed")
    return _plain(file, source, is_raw, name) if not file.compressor else _unpack(file, source, is_raw, name)


def _plain(file: VtkXml, source: bytes, is_raw: bool, name: str) -> bytes:
    size = file.header.itemsize
    head = _take(source, 0, size, is_raw, name)
    n_bytes = int(np.frombuffer(head, file.header)[0])
    return _take(source, 0, size + n_bytes, is_raw, name)[size:]


def _unpack(file: VtkXml, source: bytes, is_raw: bool, name: str) -> bytes:
    size = file.header.itemsize
    n_blocks, full, partial = (int(x) for x in np.frombuffer(_take(source, 0, 3 * size, is_raw, name), file.header))
    if not n_blocks:
        return b""
    check_bytes((n_blocks,), size, file.bytes_file, f"the header of {name!r}")
    check_bytes((n_blocks, full), 1, file.bytes_file, repr(name))
    n_header = (3 + n_blocks) * size
    lengths = np.frombuffer(_take(source, 0, n_header, is_raw, name), file.header)[3:].astype(np.int64)
    start = n_header if is_raw else 4 * -(-n_header // 3)
    packed = _take(source, start, int(lengths.sum()), is_raw, name)
    ends = np.cumsum(lengths)
    blocks = []
    for number, (end, length) in enumerate(zip(ends.tolist(), lengths.tolist(), strict=True)):
        expected = partial if number == n_blocks - 1 and partial else full
        block = _inflate(packed[end - length : end], expected, file.compressor)
        if len(block) != expected:
            raise ValueError(f"block {number} of {name!r} has {len(block)} bytes, {expected} are needed; the file is damaged")
        blocks.append(block)
    return b"".join(blocks)


def _inflate(packed: bytes, most: int, compressor: str) -> bytes:
    try:
        if compressor == "zlib":
            return zlib.decompressobj().decompress(packed, most)
        return lzma.LZMADecompressor(memlimit=MAX_DICTIONARY).decompress(packed, most)
    except (zlib.error, lzma.LZMAError, EOFError, MemoryError) as exc:
        raise ValueError(f"its compressed data are damaged ({exc})") from exc


def _take(source: bytes, start: int, n_bytes: int, is_raw: bool, name: str) -> bytes:
    """Bytes of the decoded source from byte ``start`` of the source itself."""
    if is_raw:
        taken = source[start : start + n_bytes]
    else:
        n_chars = 4 * -(-n_bytes // 3)
        try:
            taken = base64.b64decode(source[start : start + n_chars].rstrip(b" \n\r\t"))[:n_bytes]
        except ValueError as exc:
            raise ValueError(f"the base64 text of {name!r} is damaged or cut short") from exc
    if len(taken) < n_bytes:
        raise ValueError(f"{name!r} needs {n_bytes} bytes and has {len(taken)}; the file is cut short")
    return taken
