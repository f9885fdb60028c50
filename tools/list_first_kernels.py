"""List the kernels of a first encode and decode: python tools/list_first_kernels.py writes gvpipe/runtime/first_kernels.json.

Samples are encoded and decoded in new processes, each with an empty cache. What both compile is listed for their codec,
in the order of the first. Run it after kernels, or arguments of theirs, have changed.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from gvpipe.coding.registry import codec_ids
from gvpipe.foundation.isolation.python import run_python

ROOT = Path(__file__).parents[1]
TARGET = ROOT / "gvpipe" / "runtime" / "first_kernels.json"
SAMPLES = ("creature", "cloth")
ALONE = {"GVPIPE_KERNELS": "quick", "GVPIPE_COMPILES_ALONE": "1"}


def main() -> None:
    """Write the list."""
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    types: dict[str, int] = {}
    with ThreadPoolExecutor(len(SAMPLES)) as pool:
        listed = {codec: _list_codec(codec, types, pool) for codec in codec_ids()}
    rows = {"types": list(types), **{codec: list(map(json.dumps, kernels)) for codec, kernels in listed.items()}}
    TARGET.write_text("{" + ",\n".join(f'"{key}": [\n' + ",\n".join(row) + "\n]" for key, row in rows.items()) + "}\n", "utf-8")


def _list_codec(codec: str, types: dict[str, int], pool: ThreadPoolExecutor) -> list[Any]:
    """``[module, name, numbers of types]`` for each kernel that a codec's first encode and decode compile."""
    first, second = pool.map(lambda sample: _record(codec, sample), SAMPLES)
    kept = [kernel for kernel in first if kernel in second]
    return [[module, name, [types.setdefault(json.dumps(one), len(types)) for one in given]] for module, name, given in kept]


def _record(codec: str, sample: str) -> list[Any]:
    with tempfile.TemporaryDirectory() as folder:
        video = str(Path(folder, "a.mp4"))
        arguments = [__file__, codec, str(ROOT / "samples" / f"{sample}.npz"), video]
        ended = run_python(
            ["-c", PROGRAM, *arguments], {"NUMBA_CACHE_DIR": folder, "GVPIPE_KERNELS": "quick", "GVPIPE_COMPILES_ALONE": "1"}
        )
    if ended.status:
        raise SystemExit(ended.err)
    found: list[Any] = json.loads(ended.out)
    return found


PROGRAM = """
import json, sys
import gvpipe
from gvpipe.runtime.code_file import text_of_type
from gvpipe.runtime.machine_code import MachineCode

found = []
save = MachineCode.save_overload

def note(self, sig, data):
    save(self, sig, data)
    function = self._function
    is_ours = function.__module__.startswith(("gvpipe.", "gvcodecs.")) and function.__module__ != "gvpipe.runtime.self_test"
    if is_ours and "<" not in function.__qualname__:
        found.append([function.__module__, function.__qualname__, [text_of_type(kind) for kind in data.signature.args]])

MachineCode.save_overload = note
_, _, codec, sample, video = sys.argv
gvpipe.encode(sample, video, codec)
gvpipe.decode(video).positions[:]
print(json.dumps(found))
"""


if __name__ == "__main__":
    main()
