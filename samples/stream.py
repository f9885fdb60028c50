"""Stream an animation: the sender codes frames clip by clip, the receiver decodes them as the bytes arrive.

    python samples/stream.py [SEQUENCE.npz] [FRAMES_PER_CLIP]

Sender and receiver each hold one clip, for animations of any length.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import gvpipe
from gvcodecs.pdct import Pdct, StreamEncoder, StreamReader

PACKET = 1400  # bytes that a network hands over at a time


def main() -> None:
    """Send a sequence to a receiver in this process, and print which frames arrive when."""
    source = sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent / "cloth.npz"
    clip = int(sys.argv[2]) if len(sys.argv) > 2 else 24
    sequence = gvpipe.read(source)
    sender = StreamEncoder(sequence.faces, Pdct(segment=clip), sequence.fps)
    receiver = StreamReader()
    n_bytes = n_received = 0
    worst = 0.0
    for k in range(sequence.n_frames + 1):
        data = sender.add(sequence.read(k, k + 1)[0]) if k < sequence.n_frames else sender.finish()
        n_bytes += len(data)
        before = n_received
        for at in range(0, len(data), PACKET):
            for frame in receiver.feed(data[at : at + PACKET]):
                worst = max(worst, float(np.abs(frame - sequence.read(n_received, n_received + 1)[0]).max()))
                n_received += 1
        if n_received > before:
            print(f"frames {before}..{n_received - 1} arrived once frame {min(k, sequence.n_frames - 1)} was sent")
    receiver.close()
    bits = 8 * n_bytes / sequence.n_frames / sequence.n_vertices
    print(f"{n_received} frames, {n_bytes} bytes, {bits:.2f} bits per vertex and frame, largest error {worst:.2g}")


if __name__ == "__main__":
    main()
