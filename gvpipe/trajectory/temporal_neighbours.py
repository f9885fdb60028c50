"""The causal order of a trajectory basis' vectors, one per frame and axis, that interpolates them in time.

What: frames come in a dyadic order, each between frames decoded before it, so that `gvpipe.trajectory.prediction` can learn how
a frame lies between its neighbours. A frame's x, y and z vectors are predicted from the same axis of the frames around.
Why: a basis coded plainly is the largest part of a file. It is a factor of the same matrix as the coefficients, and predicts as
well: on chicken this took 0.24 bits per vertex and frame where a DCT along time in octave bands took 0.44.

Vector A f + a is axis a of frame f, of A axes: three of positions, any number of a field.
"""

from __future__ import annotations

import functools

import numpy as np

from gvpipe.trajectory.causal_order import CausalOrder

KEPT = 8  # orders: segments and short files have few lengths
MAX_NEIGHBOURS, MORE_NEIGHBOURS = 6, 8  # frames that predict a frame; where noises are found
VARIANCE, MORE_VARIANCE = 0.02, 0.3  # prior variance of a weight; where noises are found
MIN_BLOCK = 48  # vectors coded at once, at least
CUBIC = {-3: -1 / 16, -1: 9 / 16, 1: 9 / 16, 3: -1 / 16}  # interpolates a cubic half way; offsets in steps
LINEAR = {-1: 0.5, 1: 0.5}
OFFSETS = (-1, 1, -3, 3, -2, -5, 5, -4)  # frames that may be decoded, those that predict best first


@functools.lru_cache(KEPT)
def temporal_order(n_frames: int, n_axes: int = 3, finds_noises: bool = False) -> CausalOrder:
    """Return the order of the A F vectors of ``n_frames`` frames with A axes; it must not be changed.

    ``finds_noises``: of residuals that say how noisy a component is (`gvpipe.trajectory.trellis.FINDS_NOISES`). Weights then
    start less sure, and there are more of them.

    Examples:
        >>> (temporal_order(5).order[::3] // 3).tolist()
        [0, 4, 2, 1, 3]
    """
    n_near, variance = (MORE_NEIGHBOURS, MORE_VARIANCE) if finds_noises else (MAX_NEIGHBOURS, VARIANCE)
    order, weights_of = [0], [dict[int, float]()]  # frame to weight
    is_done = {0}
    top = 1 << max(0, (n_frames - 1).bit_length() - 1)
    levels = [(top, range(top, n_frames, top))]
    while top > 1:
        top //= 2
        levels.append((top, range(top, n_frames, 2 * top)))
    bounds = [0]
    for step, frames in levels:
        for frame in frames:
            near = [o for o in OFFSETS if frame + o * step in is_done][:n_near]
            prior = next((p for p in (CUBIC, LINEAR, {-1: 1.0}) if p.keys() <= set(near)), {})
            order.append(frame)
            weights_of.append({frame + o * step: prior.get(o, 0.0) for o in near})
            is_done.add(frame)
        if n_axes * (len(order) - bounds[-1]) >= MIN_BLOCK or step == 1:
            bounds.append(len(order))
    axes = np.arange(n_axes)
    counts = np.repeat([len(k) for k in weights_of], n_axes)
    near_frames = [np.array(list(k), np.int64) for k in weights_of]
    neighbours = np.concatenate([(n_axes * k + axes[:, None]).ravel() for k in near_frames])
    weights = np.concatenate([np.tile(np.array(list(k.values())), n_axes) for k in weights_of])
    return CausalOrder(
        order=(n_axes * np.array(order)[:, None] + axes).ravel().astype(np.int32),
        starts=np.concatenate([[0], np.cumsum(counts)]).astype(np.int32),
        neighbours=neighbours.astype(np.int32),
        weights=weights.astype(np.float64),
        variances=np.full(len(weights), variance),
        ring_sizes=np.minimum(counts, 2).astype(np.int32),
        blocks=(n_axes * np.array(bounds)).astype(np.int32),
        affine=False,
    )
