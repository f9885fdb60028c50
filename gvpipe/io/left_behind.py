"""What a reader met in a file and did not take: each thing once, by name, with how often it was met."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable

COUNT = re.compile(r" \((\d+)\)$")  # of things that were met several times
VOLUME_CELLS, INNER_POINTS = "volume cells", "inner points"


class LeftBehind:
    """Collects names; a reader that skips anything says so here, and everything that lists them follows.

    They become `MeshSequence.not_carried`, a note, `not_carried` of `gvpipe encode --json`, and a text of the file.

    Examples:
        >>> left = LeftBehind()
        >>> left.add("cameras"), left.add("KHR_lights_punctual", 2), left.add("cameras")
        (None, None, None)
        >>> left.names
        ('KHR_lights_punctual (2)', 'cameras (2)')
    """

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()

    def add(self, name: str, count: int = 1) -> None:
        """Note that something was met, so many times."""
        if count > 0:
            self._counts[name] += count

    def add_all(self, names: Iterable[str]) -> None:
        """Note several things."""
        for name in names:
            self.add(name)

    @property
    def names(self) -> tuple[str, ...]:
        """What was met, in alphabetical order, with the number of times where there are several."""
        return tuple(name if count == 1 else f"{name} ({count})" for name, count in sorted(self._counts.items()))


def met_later(first: Iterable[str], later: Iterable[str]) -> list[str]:
    """Names of a later file that the first one has not, however often either met them."""
    known = {COUNT.sub("", name) for name in first}
    return [name for name in later if COUNT.sub("", name) not in known]


def count_of(names: Iterable[str], name: str) -> int:
    """How often something was met, by `LeftBehind.names`.

    Examples:
        >>> count_of(("cameras", "volume cells (12)"), "volume cells"), count_of(("cameras",), "cameras")
        (12, 1)
    """
    for each in names:
        if COUNT.sub("", each) == name:
            found = COUNT.search(each)
            return int(found[1]) if found else 1
    return 0
