"""A made volume: a curved block that a moving torch heats while it vibrates, as a grid of hexahedra or tetrahedra.

``python samples/volume.py block.pvd`` writes a .vtu file per frame. Heat spreads by explicit finite differences; the block
swings in a few modes. Points have temperature (degrees Celsius) and velocity (m/s), cells a strain energy density (kJ/m3). No
random numbers.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

SIZES = (45, 37, 33)  # points along the block's edges: 50,688 hexahedra
LENGTHS = (0.5, 0.4, 0.12)  # m
N_FRAMES = 30
STEPS = 12  # of heat, a frame
SPREAD = 0.14  # part of a difference that flows to a neighbour in a step
MODES = ((1, 0, 0.010, 0.45), (0, 1, 0.008, 0.71), (2, 1, 0.004, 1.3), (3, 2, 0.002, 2.4))  # waves, m, radians a frame
HEXAHEDRON, TETRAHEDRON = 12, 10
SPLIT = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))  # a hexahedron into tetrahedra
Float64 = NDArray[np.float64]


class Frame(NamedTuple):
    """Points ``(N, 3)`` in metres, numbers of points ``(N,)`` and ``(N, 3)``, and of cells ``(M,)``."""

    points: Float64
    temperature: Float64
    velocity: Float64
    energy: Float64


def hexahedra(sizes: tuple[int, int, int] = SIZES) -> NDArray[np.int64]:
    """``(M, 8)`` points of the cells, in VTK's order; x runs fastest."""
    number = np.arange(np.prod(sizes)).reshape(sizes[::-1])  # z, y, x
    low, high = slice(None, -1), slice(1, None)
    square = [(low, low), (low, high), (high, high), (high, low)]
    corners = [number[layer, row, column].reshape(-1) for layer in (low, high) for row, column in square]
    return np.stack(corners, axis=1)


def tetrahedra(sizes: tuple[int, int, int] = SIZES) -> NDArray[np.int64]:
    """``(6 M, 4)``: six of each hexahedron."""
    return hexahedra(sizes)[:, SPLIT].reshape(-1, 4)


def frames(sizes: tuple[int, int, int] = SIZES, n_frames: int = N_FRAMES, cut: bool = False) -> Iterator[Frame]:
    """Yield the block at each moment; ``cut``: as tetrahedra."""
    z, y, x = np.meshgrid(*(np.linspace(0, 1, n) for n in sizes[::-1]), indexing="ij")
    rest = bent(np.stack([x, y, z], axis=-1).reshape(-1, 3))
    heat = np.full(x.shape, 20.0)
    cells = tetrahedra(sizes) if cut else hexahedra(sizes)
    for k in range(n_frames):
        shift, velocity = swing(rest, k)
        points = rest + shift
        middle = shift[cells].mean(axis=1)
        strain = np.linalg.norm(shift[cells] - middle[:, None], axis=2).mean(axis=1)
        yield Frame(points, heat.reshape(-1).copy(), velocity, 5e4 * strain**2 / np.prod(LENGTHS))
        for step in range(STEPS):
            heat = warmed(heat, (x, y, z), k + step / STEPS)


def bent(parts: Float64) -> Float64:
    """Points of the unit cube in the shape of the block, which is a piece of a wide ring."""
    angle = (parts[:, 0] - 0.5) * 0.9
    radius = LENGTHS[0] / 0.9 + parts[:, 2] * LENGTHS[2]
    return np.stack([radius * np.sin(angle), parts[:, 1] * LENGTHS[1], radius * np.cos(angle)], axis=1)


def swing(rest: Float64, k: float) -> tuple[Float64, Float64]:
    """Displacement ``(N, 3)`` in metres at frame k, and its speed at 100 frames a second."""
    shift, speed = np.zeros_like(rest), np.zeros_like(rest)
    for across, along, size, rate in MODES:
        shape = np.cos(np.pi * across * rest[:, 0] / LENGTHS[0]) * np.cos(np.pi * along * rest[:, 1] / LENGTHS[1])
        shift[:, 2] += size * shape * np.sin(rate * k)
        shift[:, 0] += 0.3 * size * shape * rest[:, 2] * np.sin(rate * k + 0.4)
        speed[:, 2] += 100 * size * rate * shape * np.cos(rate * k)
        speed[:, 0] += 30 * size * rate * shape * rest[:, 2] * np.cos(rate * k + 0.4)
    return shift, speed


def warmed(heat: Float64, axes: tuple[Float64, ...], k: float) -> Float64:
    """The temperature a step later, under a torch that goes along a curve on top."""
    for axis in range(3):
        flow = SPREAD * np.diff(heat, axis=axis)
        ends = [(0, 0)] * 3
        ends[axis] = (1, 1)
        heat = heat + np.diff(np.pad(flow, ends), axis=axis)
    x, y, z = axes
    torch = 0.5 + 0.35 * np.sin(0.21 * k), 0.5 + 0.3 * np.sin(0.34 * k + 1)
    heat += 60 * np.exp(-((x - torch[0]) ** 2 + (y - torch[1]) ** 2) / 0.004 - (1 - z) / 0.06)
    return heat


def main() -> None:
    """Write the files."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("target", type=Path, help="such as block.pvd")
    parser.add_argument("--tetrahedra", action="store_true", help="split each hexahedron into six")
    parser.add_argument("--frames", type=int, default=N_FRAMES)
    parser.add_argument("--sizes", type=int, nargs=3, default=SIZES, help="points along the three edges")
    given = parser.parse_args()
    sizes = tuple(given.sizes)
    nodes = tetrahedra(sizes) if given.tetrahedra else hexahedra(sizes)
    folder = given.target.with_suffix("")
    folder.mkdir(exist_ok=True)
    listed = []
    for k, frame in enumerate(frames(sizes, given.frames, given.tetrahedra)):
        name = f"{folder.name}_{k:04d}.vtu"
        (folder / name).write_bytes(vtu(frame, nodes))
        listed.append(f'<DataSet timestep="{k / 100}" file="{folder.name}/{name}"/>')
    given.target.write_text(f'<VTKFile type="Collection"><Collection>{"".join(listed)}</Collection></VTKFile>')


def vtu(frame: Frame, nodes: NDArray[np.int64]) -> bytes:
    """A file of VTK's: XML, with the numbers as they are behind it."""
    count, size = nodes.shape
    kind = HEXAHEDRON if size == 8 else TETRAHEDRON
    arrays = {
        "Points": frame.points.astype("<f4"),
        "temperature": frame.temperature.astype("<f4"),
        "velocity": frame.velocity.astype("<f4"),
        "energy": frame.energy.astype("<f4"),
        "connectivity": nodes.astype("<i4").reshape(-1),
        "offsets": (size * np.arange(1, count + 1)).astype("<i4"),
        "types": np.full(count, kind, "u1"),
    }
    data, elements = b"", {}
    for name, values in arrays.items():
        width = values.shape[1] if values.ndim == 2 else 1
        of = {"f": "Float32", "i": "Int32", "u": "UInt8"}[values.dtype.kind]
        elements[name] = (
            f'<DataArray type="{of}" Name="{name}" NumberOfComponents="{width}" format="appended" offset="{len(data)}"/>'
        )
        data += np.uint64(values.nbytes).tobytes() + values.tobytes()
    groups = {
        "PointData": ("temperature", "velocity"),
        "CellData": ("energy",),
        "Points": ("Points",),
        "Cells": ("connectivity", "offsets", "types"),
    }
    inner = "".join(f"<{tag}>{''.join(elements[name] for name in names)}</{tag}>" for tag, names in groups.items())
    head = (
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64"><UnstructuredGrid>'
        f'<Piece NumberOfPoints="{len(frame.points)}" NumberOfCells="{count}">{inner}</Piece></UnstructuredGrid>'
        '<AppendedData encoding="raw">_'
    )
    return head.encode() + data + b"</AppendedData></VTKFile>"


if __name__ == "__main__":
    main()
