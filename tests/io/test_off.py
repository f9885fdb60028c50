"""OFF with comments, other properties and polygons."""

from __future__ import annotations

from pathlib import Path

from mesh_files import PLY_ROWS

from gvpipe import io


def test_off_polygons_keep_their_order(tmp_path: Path) -> None:
    text = (
        "# c\nNOFF 4 3 0 # counts\n"
        + "\n\n".join(row + " 0 0 1" for row in PLY_ROWS)
        + "\n4 0 1 2 3\n3 0 1 2 255 0 0\n3 3 2 1\n"
    )
    (tmp_path / "a.off").write_text(text)
    assert io.read(tmp_path / "a.off").faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 2], [3, 2, 1]]
