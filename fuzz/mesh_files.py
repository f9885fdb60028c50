"""Files of meshes: text, binary, archives, and files beside each other, changed and put together again."""

from __future__ import annotations

import io
import struct
import zipfile
from pathlib import Path

import gvpipe.io
from fuzz.hdf import HDF, mutate_hdf
from fuzz.library_processes import fork_library_processes
from fuzz.mutation import Change, Rng, mutate_bytes, mutate_json, mutate_text
from fuzz.parts import Parts, Seed, Target
from fuzz.results import check_asset, check_faces, check_positions
from gvpipe.foundation.errors import InputError
from gvpipe.io.library.worker import LEAST_MEMORY, LEAST_SECONDS

MESH = "mesh.obj"  # what a point cache belongs to
CACHES = (".pc2", ".mdd", ".npy")
MOST_VALUES = 1 << 22
MEMORY = LEAST_MEMORY + (256 << 20)  # bytes: the limit of libraries' processes, and what they have before that
LIMITED = ("usd", "abc")  # formats whose library's process has a limit of time
INSIDE = "|"  # between a file's name and the name of what it holds
GLTF_JSON = 0x4E4F534A  # kind of a chunk
TEXTS = (b"ply\n", b"v ", b"#", b"solid", b"OFF", b"<?xml", b"<", b"FORMAT", b"; FBX", b"{", b"$", b"*")


def mesh_targets(seeds: dict[str, tuple[Seed, ...]]) -> list[Target]:
    """The parsers of mesh files, by format; seeds by format, each with its files as parts, the main one first."""
    fork_library_processes()
    return [
        Target(
            name,
            tuple(Seed(seed.name, split_files(seed.parts)) for seed in group),
            mutate_files,
            join_files,
            parse_mesh,
            (InputError,),
            MEMORY,
            *((LEAST_SECONDS + 1,) if name.startswith(LIMITED) else ()),  # the system ends a process after a whole second
        )
        for name, group in seeds.items()
    ]


def parse_mesh(path: Path) -> None:
    """Read a file and everything in it, of very long ones the ends.

    Raises:
        InputError: it is refused.
        BrokenPromise: what was read cannot be.
    """
    sequence = gvpipe.io.read(path, mesh=path.with_name(MESH) if path.suffix in CACHES else None)
    n_frames, n_vertices, _ = sequence.shape
    check_faces(sequence.faces, n_vertices)
    stop = max(1, min(n_frames, MOST_VALUES // (3 * n_vertices)))
    check_positions(sequence.read(0, stop), (stop, n_vertices, 3))
    check_positions(sequence.read(n_frames - 1, n_frames), (1, n_vertices, 3))
    check_asset(sequence, infinite=True)


def split_files(files: Parts) -> Parts:
    """Files by name to parts: archives (.npz, .usdz) by member, .glb by chunk."""
    parts: Parts = {}
    for name, data in files.items():
        if data[:4] == b"PK\3\4":
            with zipfile.ZipFile(io.BytesIO(data)) as archive:
                parts |= {f"{name}{INSIDE}{member}": archive.read(member) for member in archive.namelist()}
        elif data[:4] == b"glTF":
            parts |= {f"{name}{INSIDE}{kind}": chunk for kind, chunk in _chunks(data)}
        else:
            parts[name] = data
    return parts


def join_files(parts: Parts) -> dict[str, bytes]:
    """Mirror of `split_files`: archives' checksums and chunks' lengths are made anew."""
    held: dict[str, Parts] = {}
    files: dict[str, bytes] = {}
    for name, data in parts.items():
        file, _, member = name.partition(INSIDE)
        if member:
            held.setdefault(file, {})[member] = data
            files.setdefault(file, b"")
        else:
            files[file] = data
    for file, members in held.items():
        files[file] = _join_glb(members) if Path(file).suffix == ".glb" else _join_zip(members, Path(file).suffix == ".usdz")
    return files


def mutate_files(parts: Parts, rng: Rng, seeds: tuple[Seed, ...]) -> Parts:
    """Change parts; now and then one comes from another seed, or is left out."""
    for _ in range(1 + (int(rng.geometric(0.5)) if rng.random() < 0.5 else 0)):
        names = [name for name in parts if name != MESH]
        name = names[0 if rng.random() < 0.3 else int(rng.integers(len(names)))]
        kind = rng.random()
        if kind < 0.02 and name != names[0]:
            del parts[name]
        elif kind < 0.06:
            other = seeds[int(rng.integers(len(seeds)))].parts
            parts[name] = other[list(other)[int(rng.integers(len(other)))]]
        else:
            parts[name] = _change_of(name, parts[name])(parts[name], rng)
    return parts


def _change_of(name: str, data: bytes) -> Change:
    """What changes a part of that content."""
    if data[:4] == HDF:
        return mutate_hdf
    if name.endswith((str(GLTF_JSON), ".gltf", ".series")):
        return mutate_json
    is_text = b"\0" not in data[:64] and data.lstrip()[:16].startswith(TEXTS)
    return mutate_text if is_text else mutate_bytes


def _chunks(data: bytes) -> list[tuple[int, bytes]]:
    found, position = [], 12
    while position + 8 <= len(data):
        length, kind = struct.unpack_from("<II", data, position)
        found.append((kind, data[position + 8 : position + 8 + length]))
        position += 8 + length
    return found


def _join_glb(chunks: Parts) -> bytes:
    packed = b""
    for kind, data in chunks.items():
        padded = data + (b" " if int(kind) == GLTF_JSON else b"\0") * (-len(data) % 4)
        packed += struct.pack("<II", len(padded), int(kind)) + padded
    return struct.pack("<4sII", b"glTF", 2, 12 + len(packed)) + packed


def _join_zip(members: Parts, aligned: bool) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for name, data in members.items():
            entry = zipfile.ZipInfo(name)
            if aligned:  # as USD wants it
                start = file.tell() + 30 + len(name.encode()) + 4
                entry.extra = struct.pack("<HH", 0x1986, -start % 64) + bytes(-start % 64)
            archive.writestr(entry, data)
    return file.getvalue()
