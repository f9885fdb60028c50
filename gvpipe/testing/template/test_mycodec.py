"""What gvpipe asks of every codec. Install the package before: ``pip install -e .``."""

from __future__ import annotations

from pathlib import Path

import pytest

from gvpipe.testing import PROMISES, Promise, Subject
from gvpipe.testing.template.mycodec import MyCodec


@pytest.mark.parametrize("promise", PROMISES, ids=lambda promise: promise.name)
def test_promise(promise: Promise, tmp_path: Path) -> None:
    promise(Subject(MyCodec(), tmp_path))
