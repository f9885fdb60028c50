"""Real scene files agree with other readers, where the folder that holds them stands beside the project."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import pytest
from folders import DATA, ROOT

TOOL: dict[str, Any] = runpy.run_path(str(ROOT / "tools" / "check_scenes.py"), run_name="check_scenes")
REFUSED = {  # a part of the message
    "curves.abc": "has no polygon mesh; it holds Curve",
    "points.abc": "has no polygon mesh; it holds Points",
    "cube.abc": "old HDF5 kind",
    "xforms.abc": "old HDF5 kind",
    "topology_changes_abc1.abc": "the topology of mesh /Suzanne/Suzanne changes at frame 1",
    "varying.usda": "the topology of mesh /Root/subdiv changes at frame 1 (time code 2)",
    "cube.usdc": "cannot be read as USD",
    **dict.fromkeys(
        ("badver.abc", "fuzzer_issue25166.abc", "fuzzer_issue25175.abc", "issue254.abc", "issue283.abc"), "cannot be read"
    ),
}


@pytest.mark.slow
@pytest.mark.skipif(not (DATA / "assets" / "MANIFEST.csv").is_file(), reason="no ../shared/data")
@pytest.mark.parametrize("kind", ["usd", "abc", "pointcache"])
def test_files_agree_with_their_references(kind: str) -> None:
    pytest.importorskip({"abc": "alembic3d"}.get(kind, "pxr"))
    rows = list(TOOL["check"](DATA, kind, ""))
    assert rows
    assert not [row.file for row in rows if row.is_far]
    refused = {Path(row.file).name: row.held for row in rows if row.held.startswith("refused")}
    for name, message in refused.items():
        assert REFUSED[name] in message
