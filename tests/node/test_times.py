"""Times of frames, read by the player's JavaScript in Node: Python's, bit for bit."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess

import numpy as np
import pytest
from folders import ROOT

from gvpipe.asset_coding.times import pack_times

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="no node")
CODE = """
import { readTimes } from "./gvpipe/web/src/asset/times.js";
const [data, count] = process.argv.slice(1);
try {
  console.log(JSON.stringify(Array.from(await readTimes(Uint8Array.from(Buffer.from(data, "base64")), Number(count)))));
} catch (error) {
  console.log(JSON.stringify(`${error.kind}: ${error.message}`));
}
"""


def read(data: bytes, count: int) -> object:
    command = ["node", "--input-type=module", "-e", CODE, base64.b64encode(data).decode(), str(count)]
    return json.loads(subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout)


def test_times_are_python_s() -> None:
    times = (0.0, 1.25e-5, 2.5e-5, 3.7500000000000003e-05, 1.0, 0.5, -7e300, *np.random.default_rng(1).normal(size=9).tolist())
    assert read(pack_times(times), len(times)) == list(times)
    assert "corrupt" in str(read(pack_times(times), len(times) - 1)) and "corrupt" in str(read(pack_times((float("inf"),)), 1))
