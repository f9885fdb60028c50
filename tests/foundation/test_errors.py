"""Messages are one short line that a terminal shows, whatever a file holds."""

from __future__ import annotations

import dataclasses
import pickle
from pathlib import Path

import numpy as np
import pytest

from gvpipe.coding.registry import open_reader
from gvpipe.container.mp4 import read_file
from gvpipe.foundation.errors import LONGEST, InputError, NewerVersion, TopologyChange
from gvpipe.model.sequence import MeshSequence

GOLDEN = Path(__file__).parents[1] / "golden"


def test_control_characters() -> None:
    assert str(InputError("a\nb\x1b[2J\u2028\x80")) == "a b\\x1b[2J \\x80"
    sequence = MeshSequence(np.zeros((1, 3, 3)), np.array([[0, 1, 2]]), notes=("per\x80 node",))
    assert sequence.notes == ("per\\x80 node",)


def test_length() -> None:
    message = str(InputError(f"a.mp4: it is {'9' * 5000}; export it again"))
    assert len(message) == LONGEST - 1 and message.startswith("a.mp4") and message.endswith("; export it again")


def test_values_of_files_are_quoted_in_part() -> None:
    bitstream = read_file(next(GOLDEN.glob("pca-*.mp4")))
    with pytest.raises(NewerVersion) as caught:
        open_reader(dataclasses.replace(bitstream, codec="9" * 5000))
    assert len(str(caught.value)) < 160


def test_a_change_of_topology_is_pickled() -> None:
    assert pickle.loads(pickle.dumps(TopologyChange("faces", 3))).frame == 3
