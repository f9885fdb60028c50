"""The same input gives the same bytes, whichever instructions the machine has."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from folders import ROOT
from machines import MACHINES, OLD, encoded_digest, lines_as, only_x86_64
from sequences import waving, wrinkled

import gvpipe
from gvpipe.model.sequence import MeshSequence

CODECS = ("mcgv", "mcgv:transform=klt", "mcgv:prediction=affine", "pca", "laplacian", "pdct")
DIGESTS = """
import sys
sys.path.insert(0, "tests")
from machines import encoded_digest

for name in sys.argv[1].split():
    for path in sys.argv[2:]:
        print(encoded_digest(path, name))
"""
PRODUCT = """
import hashlib
import numpy as np

left, right = np.random.default_rng(1).standard_normal((2, 200, 200))
print(hashlib.sha256((left @ right).tobytes()).hexdigest())
"""


def stretched(sequence: MeshSequence) -> MeshSequence:
    """Its axes have like motion no more: principal trajectories would else be degenerate, and easy for all machines."""
    frames = sequence.read(0, sequence.n_frames) * np.array([1.0, 0.7, 1.3], np.float32)
    return replace(sequence, positions=frames, parts=())


def digests(machine: dict[str, str], codecs: tuple[str, ...], paths: list[Path]) -> list[str]:
    """The hash of each file that a process with these environment variables makes."""
    return lines_as(machine, DIGESTS, " ".join(codecs), *paths)


def save(folder: Path, *sequences: MeshSequence) -> list[Path]:
    """Saved, since another machine would not make the same coordinates."""
    paths = [folder / f"{sequence.name}.npz" for sequence in sequences]
    for path, sequence in zip(paths, sequences, strict=True):
        gvpipe.write(sequence, path)
    return paths


@only_x86_64
def test_files_of_an_old_machine_are_those_of_this_one(tmp_path: Path) -> None:
    stiff, soft = save(tmp_path, stretched(wrinkled(8)), stretched(waving(12, 10)))
    for codecs, path in ((CODECS[1:2], stiff), (CODECS, soft)):
        assert digests(OLD, codecs, [path]) == [encoded_digest(path, codec) for codec in codecs]


@pytest.mark.slow
@only_x86_64
def test_files_of_all_machines_are_those_of_this_one(tmp_path: Path) -> None:
    paths = [*save(tmp_path, stretched(wrinkled(40))), ROOT / "samples" / "creature.npz"]
    expected = digests({}, CODECS, paths)
    for machine, settings in {**MACHINES, "old": OLD}.items():
        assert digests(settings, CODECS, paths) == expected, machine


@pytest.mark.slow
@only_x86_64
def test_products_of_a_blas_differ_between_these_machines() -> None:
    """Else the tests above would show nothing."""
    assert len({*lines_as(MACHINES["Haswell"], PRODUCT), *lines_as(MACHINES["Prescott"], PRODUCT)}) == 2
