"""The parsers as targets of atheris, which looks for inputs that reach new code: ``pip install atheris`` first.

    python -m fuzz.coverage_guided obj -max_total_time=600

The bytes that atheris makes choose a seed file and changes of it, one after the other. So checksums hold, and an input like
another makes a case like the other's.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parent.parent


class Choices:
    """The methods of `numpy.random.Generator` that mutations use, their results taken from given bytes; 0 behind their end."""

    def __init__(self, data: bytes) -> None:
        self._data, self._position = data, 0

    def bytes(self, length: int) -> bytes:
        """The next bytes."""
        found = self._data[self._position : self._position + length]
        self._position += length
        return found.ljust(length, b"\0")

    def random(self) -> float:
        """A number in 0..1, 1 left out."""
        return int.from_bytes(self.bytes(2), "little") / 65536

    def integers(self, low: int, high: int | None = None, size: int | None = None, dtype: Any = np.int64) -> Any:
        """Integers in low..high, ``high`` left out; in 0..low with one argument."""
        start, stop = (0, low) if high is None else (low, high)
        drawn = [start + int.from_bytes(self.bytes(4), "little") % (stop - start) for _ in range(1 if size is None else size)]
        return drawn[0] if size is None else np.array(drawn, dtype)

    def geometric(self, p: float) -> int:
        """How many draws until one is below ``p``; at most 8."""
        return next((k for k in range(1, 8) if self.random() < p), 8)

    def choice(self, values: Any, size: int) -> Any:
        """Some of the values, each as often as it comes."""
        return np.asarray(values)[self.integers(0, len(values), size)]


def kernel_modules() -> list[str]:
    """Modules with compiled functions, which numba must see as they are."""
    found = []
    for root in (ROOT, ROOT / "codecs"):
        for path in (path for name in ("gvpipe", "gvcodecs") for path in (root / name).rglob("*.py")):
            if "@compiled" in path.read_text("utf-8"):
                found.append(".".join(path.relative_to(root).with_suffix("").parts))
    return found


def main() -> None:
    """Let atheris run one target; arguments after its name are libFuzzer's."""
    import atheris

    name, folder = sys.argv.pop(1), Path(tempfile.mkdtemp())
    with atheris.instrument_imports(
        include=["gvpipe", "gvcodecs"], exclude=kernel_modules()
    ):  # some modules load when a file needs them
        from fuzz.limits import BAD
        from fuzz.seeds import FOLDER
        from fuzz.targets import Options, load_targets
        from fuzz.worker import run_case

        (target,) = load_targets(Options(0, targets=(name,), seeds=str(FOLDER)))

        def test(data: bytes) -> None:
            rng: Any = Choices(data)
            seed = target.seeds[int(rng.integers(len(target.seeds)))]
            verdict = run_case(target, target.mutate(dict(seed.parts), rng, target.seeds), folder)
            if verdict.kind in BAD:
                raise RuntimeError(f"{verdict.kind}: {verdict.place}\n{verdict.detail}")

        atheris.Setup([sys.argv[0], "-len_control=0", "-max_len=200", *sys.argv[1:]], test)
        atheris.Fuzz()


if __name__ == "__main__":
    main()
