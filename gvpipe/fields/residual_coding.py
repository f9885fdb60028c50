"""Residuals of rows over the frames <-> bytes: adaptive binary decisions in contexts of magnitudes that are known.

A residual's likely magnitude is forecast from integers alone:

- the neighbours' residuals in the same frame, in the frame before and in the frame after (rows are coded whole);
- the row's own residuals in earlier frames, over a short and a long span;
- what this frame had in the rows coded last;
- the component before in the same frame and row.

Seven contexts are made of these. Each decision's probability is mixed from what the seven have learnt
(`gvpipe.entropy.decision_kernels`). Decisions of a value: is its magnitude's bit length 0; is it 1; ...; the two bits below the
highest; lower bits, all alike; the sign::

    residuals = bytes of the range coder, row after row in the causal order, column after column
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gvpipe.foundation.arrays import Bool, Int64
from gvpipe.foundation.errors import corrupt_section
from gvpipe.trajectory.causal_order import CausalOrder

if TYPE_CHECKING:
    from gvpipe.entropy.decision_kernels import Mixing

LARGEST = 1 << 39  # magnitude of a residual, exclusive


def encode_residuals(values: Int64, n_frames: int, causal: CausalOrder, still: Bool | None = None) -> bytes:
    """Return the bytes of ``values (R, C F)``, component after component, magnitudes below `LARGEST`.

    Args:
        values: by row.
        n_frames: F.
        causal: the order of the R rows.
        still: ``(R,)`` rows whose values after the first frame are 0 and are not coded.
    """
    from gvpipe.fields.residual_kernels import Residuals, encode_rows

    none = np.zeros(len(values), np.bool_)
    residuals = Residuals(np.ascontiguousarray(values), n_frames, none if still is None else still, causal)
    return encode_rows(residuals, _mixing()).tobytes()


def decode_residuals(
    data: bytes, n_columns: int, n_frames: int, causal: CausalOrder, name: str, still: Bool | None = None
) -> Int64:
    """Mirror of `encode_residuals`: ``(R, n_columns)``.

    Raises:
        CorruptFile: the bytes are not as many as the residuals take.
    """
    from gvpipe.entropy.decision_kernels import PLACE, start_decoder
    from gvpipe.fields.residual_kernels import Residuals, decode_rows, new_forecast

    n_rows = len(causal.order)
    values = np.zeros((n_rows, n_columns), np.int64)
    none = np.zeros(n_rows, np.bool_)
    residuals = Residuals(values, n_frames, none if still is None else still, causal)
    bytes_ = np.frombuffer(bytearray(data), np.uint8)
    state = start_decoder(bytes_)
    is_whole = decode_rows(residuals, new_forecast(residuals), _mixing(), state, bytes_, 0, n_rows)
    if not is_whole or state[PLACE] < len(data):
        raise corrupt_section(name, "its residuals do not decode")
    return values


def _mixing() -> Mixing:
    from gvpipe.entropy.decision_kernels import new_mixing
    from gvpipe.fields.residual_kernels import N_COARSE, N_CONTEXTS, N_FINE, N_MIXERS, NODES

    return new_mixing(N_CONTEXTS, N_FINE * N_COARSE * NODES, N_MIXERS)
