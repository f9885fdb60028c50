"""Whether files of one input are equal, whichever machine encodes; the status is 1 where they are not.

    python tools/compare_machines.py                            # the repository's own samples
    python tools/compare_machines.py --data FOLDER              # and every .npz file of a folder
    python tools/compare_machines.py --data FOLDER --codec pca --sequence cow --machine old --machine Haswell
    python tools/compare_machines.py --sequence robot --python ./arm-python     # a Python for ARM in an emulator

Each codec codes each sequence with ``--target-kg 0.1``: here, and in processes whose libraries believe that the processor
has fewer instructions (`tests/machines.py`). ``old`` is all of that at once but for kernels, which ``generic`` compiles anew:
that takes minutes. ``--python`` names a program that runs as Python does, with the same versions of gvpipe and its libraries.
"""

from __future__ import annotations

import argparse
import runpy
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))
from machines import MACHINES, OLD, encoded_digest, lines_as  # noqa: E402 - found there

SCRIPT = "import sys; sys.path.insert(0, 'tests'); from machines import encoded_digest; print(encoded_digest(*sys.argv[1:]))"
KNOWN = {**MACHINES, "old": OLD}


def main() -> int:
    """Encode, print a line for each file and machine, and compare."""
    sizes = runpy.run_path(str(ROOT / "tools" / "compare_sizes.py"))
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, metavar="FOLDER", help="of .npz files, beside the repository's samples")
    parser.add_argument("--codec", action="append", choices=sizes["CODECS"], help="this codec alone; may be given again")
    parser.add_argument("--sequence", action="append", metavar="NAME", help="this sequence alone; may be given again")
    parser.add_argument("--machine", action="append", choices=KNOWN, help="default: old; may be given again")
    parser.add_argument(
        "--python", action="append", metavar="PROGRAM", help="another Python in place of machines; may be given again"
    )
    given = parser.parse_args()
    paths = sizes["find_sequences"](given.data, given.sequence)
    if not paths:
        parser.error("there is no such sequence")
    n_files = n_other = 0
    for path in paths:
        for codec in given.codec or sizes["CODECS"]:
            own = encoded_digest(path, codec)
            others = [(KNOWN[name], sys.executable, name) for name in given.machine or ([] if given.python else ["old"])]
            for machine, python, name in [*others, *(({}, python, Path(python).name) for python in given.python or [])]:
                is_same = lines_as(machine, SCRIPT, path.absolute(), codec, python=python) == [own]
                n_files, n_other = n_files + 1, n_other + (not is_same)
                print(f"{path.stem:16} {codec:18} {name:16} {'same' if is_same else 'OTHER'} bytes", flush=True)
    print(f"{n_other} of {n_files} files differ")
    return 1 if n_other else 0


if __name__ == "__main__":
    sys.exit(main())
