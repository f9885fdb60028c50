"""What goes wrong inside readers is one line with the file's name; odd numbers make no warnings."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from gvpipe import io
from gvpipe.foundation.arrays import Array
from gvpipe.foundation.errors import InputError
from gvpipe.io.damage import reading
from gvpipe.io.scene.fields import FieldFrames, Sampled
from gvpipe.io.scene.mesh import Fans


def test_odd_numbers_make_no_warnings() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with reading(Path("a.off"), "OFF"):
            np.array([np.nan, 1e300]).astype(np.int64)
            np.array([np.inf]) - np.array([np.inf])


def test_fields_that_fail_when_they_are_sliced() -> None:
    def at(time: float) -> Array:
        if time > 1:
            raise RuntimeError("illegal size")
        return np.zeros(4 if time else 3)

    none = np.zeros(0, np.int64)
    fans = Fans(none, none, none, (0,))
    frames = FieldFrames("heat", [Sampled(at, "scalar", "vertex")], [3], [fans], np.arange(3.0), "a.usdc")
    assert frames[0:1].shape == (1, 3)
    with pytest.raises(InputError, match=r"a\.usdc: field heat has 4 values in frame 1; 3 are needed"):
        frames[1:2]
    with pytest.raises(InputError, match=r"a\.usdc: field 'heat' in frame 2 cannot be read: illegal size; export it again"):
        frames[2:3]


def test_netcdf_of_three_bytes(tmp_path: Path) -> None:
    (tmp_path / "a.e").write_bytes(b"CDF")
    with pytest.raises(InputError, match=r"a\.e is not a netCDF file"):
        io.read(tmp_path / "a.e")


def test_frames_whose_normals_are_missing(tmp_path: Path) -> None:
    points = "0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n"
    head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    normals = "property float nx\nproperty float ny\nproperty float nz\n"
    faces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    (tmp_path / "1.ply").write_text(head + normals + faces + points + "3 0 1 2\n")
    (tmp_path / "2.ply").write_text(head + faces + points.replace(" 0 0 1\n", "\n") + "3 0 1 2\n")
    with pytest.raises(InputError, match=r"2\.ply has no 'normal'"):
        io.read(tmp_path)
