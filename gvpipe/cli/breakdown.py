"""Where a file's bytes go: a bar per section, in bits per vertex and frame.

Sections that every segment has (``basis.0``, ``basis.1`` ...) are one bar.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table

WIDTH = 40  # of the bar of a section that is the whole file, characters


def group_sections(sections: Mapping[str, int]) -> dict[str, int]:
    """Return the bytes of each kind of section, in order: by name, or ``KIND x COUNT`` where there are several."""
    groups: dict[str, list[str]] = {}
    for name in sections:
        kind, _, number = name.rpartition(".")
        groups.setdefault(kind if number.isdigit() else name, []).append(name)
    return {
        names[0] if len(names) == 1 else f"{kind} x {len(names)}": sum(sections[name] for name in names)
        for kind, names in groups.items()
    }


def section_table(sections: Mapping[str, int], n_samples: int) -> Table:
    """Return the table to print; ``sections`` hold bytes, ``n_samples`` is V F."""
    from rich.bar import Bar
    from rich.table import Table

    total = sum(sections.values())
    table = Table(box=None, show_header=False, padding=(0, 0, 0, 2))
    for _ in range(4):
        table.add_column(justify="right", no_wrap=True)
    table.columns[0].justify = "left"
    for name, count in group_sections(sections).items():
        bar = Bar(total or 1, 0, count, width=WIDTH)
        table.add_row(name, f"{count} bytes", f"{8 * count / n_samples:.4f} bpvf", bar)
    return table
