"""Make a long capture, and measure how soon a file of it shows its first frame over a slow connection.

    python samples/capture.py OUTPUT.mp4 [FRAMES] [CODEC]

The default is ten minutes: 20,000 vertices, 18,000 frames at 30 per second, codec pca, segments of 100 frames. Frames are made
when they are read, so memory holds a segment of them. A server on this machine then sends the file at 10 Mbit/s.
"""

from __future__ import annotations

import http.server
import resource
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import gvpipe

AROUND, ALONG = 200, 100  # vertices of the tube
WAVES = 60
FPS = 30.0
SEGMENT = 100  # frames
RATE = 10e6  # bits per second
CHUNK = 1 << 13
READER = """
import sys, time
import gvpipe, gvpipe.playback.player, gvpipe.coding.registry
warm, url = sys.argv[1:]
with gvpipe.open(warm) as video:
    video[0]  # compiled loops are loaded
def memory():
    status = dict(line.split(":", 1) for line in open("/proc/self/status"))
    return int(status["VmHWM"].split()[0]) / 1024
before, start = memory(), time.perf_counter()
with gvpipe.open(url) as video:
    video[0]
    print(f"first frame after {time.perf_counter() - start:.2f} s")
    for jump in (len(video) // 3, 9 * len(video) // 10, len(video) // 2):
        start = time.perf_counter()
        video[jump]
        print(f"frame {jump} after {time.perf_counter() - start:.2f} s")
print(f"memory {memory():.0f} MB at most, {before:.0f} MB of it before")
"""


class Capture:
    """Positions ``(F, V, 3) float32`` of a bending, swelling tube, each block made when it is sliced.

    Args:
        n_frames: F.
    """

    def __init__(self, n_frames: int) -> None:
        self.shape = (n_frames, AROUND * ALONG, 3)
        u, v = np.meshgrid(np.arange(AROUND) / AROUND, np.arange(ALONG) / (ALONG - 1))
        self._angle, self._height = 2 * np.pi * u.ravel(), v.ravel()
        rng = np.random.default_rng(7)
        self._around, self._along = rng.integers(0, 12, WAVES), rng.uniform(0.5, 16, WAVES)
        self._speed, self._size = rng.uniform(0.2, 6, WAVES), 0.02 / np.sqrt(1 + np.arange(WAVES))
        phases = self._angle[None] * self._around[:, None] + 2 * np.pi * self._height[None] * self._along[:, None]
        self._shapes = np.concatenate([np.sin(phases), np.cos(phases)])  # (2 WAVES, V)

    @property
    def faces(self) -> NDArray[np.int32]:
        """``(T, 3) int32`` triangles."""
        row, column = np.meshgrid(np.arange(ALONG - 1), np.arange(AROUND), indexing="ij")
        a, b = row * AROUND + column, row * AROUND + (column + 1) % AROUND
        quads = np.stack([a, b, b + AROUND, a, b + AROUND, a + AROUND], axis=-1)
        return quads.reshape(-1, 3).astype(np.int32)

    def __getitem__(self, key: slice) -> NDArray[np.float32]:
        times = np.arange(*key.indices(self.shape[0])) / FPS
        beats = times[:, None] * self._speed * (1 + 0.1 * np.sin(0.05 * times)[:, None])
        weights = np.concatenate([self._size * np.cos(beats), self._size * np.sin(beats)], axis=1)
        radius = 0.25 + weights @ self._shapes  # (n, V)
        bend = 0.6 * np.sin(0.9 * times[:, None] + 2 * self._height) * self._height**2
        positions = np.empty((len(times), *self.shape[1:]), np.float32)
        positions[..., 0] = radius * np.cos(self._angle) + bend
        positions[..., 1] = 2 * self._height - bend**2 / 4
        positions[..., 2] = radius * np.sin(self._angle) + 0.3 * np.sin(0.4 * times)[:, None] * self._height
        return positions


def make_capture(n_frames: int) -> gvpipe.MeshSequence:
    """A capture of that many frames."""
    capture = Capture(n_frames)
    return gvpipe.MeshSequence(capture, capture.faces, FPS, name="capture")


class SlowHandler(http.server.SimpleHTTPRequestHandler):
    """Sends parts of a file at `RATE`."""

    path_sent = Path()

    def log_message(self, *_: object) -> None:
        """Print nothing."""

    def do_GET(self) -> None:
        size = self.path_sent.stat().st_size
        first, last = self.headers["Range"].removeprefix("bytes=").split("-")
        start, stop = int(first), min(int(last) + 1, size)
        self.send_response(206)
        self.send_header("Content-Range", f"bytes {start}-{stop - 1}/{size}")
        self.send_header("Content-Length", str(stop - start))
        self.end_headers()
        with open(self.path_sent, "rb") as file:
            file.seek(start)
            begun, sent = time.perf_counter(), 0
            while data := file.read(min(CHUNK, stop - start - sent)):
                self.wfile.write(data)
                sent += len(data)
                time.sleep(max(0.0, 8 * sent / RATE - (time.perf_counter() - begun)))


def measure(path: Path, warm: Path) -> None:
    """Print how a process of its own reads the file at `RATE`; ``warm`` is a short file of the same codec."""
    SlowHandler.path_sent = path
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), SlowHandler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    url = f"http://127.0.0.1:{server.server_port}/{path.name}"
    subprocess.run([sys.executable, "-c", READER, str(warm), url], check=True)
    server.shutdown()
    server.server_close()


def main() -> None:
    """Encode a capture, and measure."""
    path = Path(sys.argv[1] if len(sys.argv) > 1 else "capture.mp4")
    n_frames = int(sys.argv[2]) if len(sys.argv) > 2 else 18_000
    codec = sys.argv[3] if len(sys.argv) > 3 else "pca"
    warm = path.with_name(f"{path.stem}-short.mp4")
    gvpipe.encode(make_capture(2 * SEGMENT), warm, codec, segment=SEGMENT, stream=True)
    report = gvpipe.encode(make_capture(n_frames), path, codec, segment=SEGMENT, stream=True)
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    made = f"{report.frames} frames, {report.vertices} vertices, codec {report.codec}"
    print(f"{made}: {report.bytes} bytes, {report.bpvf:.3f} bits per vertex and frame")
    print(f"encoded in {report.seconds['encode']:.0f} s, {used:.0f} MB at most")
    measure(path, warm)
    warm.unlink()


if __name__ == "__main__":
    main()
