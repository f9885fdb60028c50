"""Kernels: the inverse of the orthonormal DCT, for signals of any length, with the same bits on every machine.

A library's transform has sines of the system's, and sums in an order that depends on the processor. Here everything is sums,
products and quotients of doubles in one order, so that a browser has the same bits.

1. A DCT of n values is a Fourier transform of n values, two signals at a time in its real and imaginary parts (Makhoul, "A
   Fast Cosine Transform in One and Two Dimensions", 1980).
2. A Fourier transform of any length is a convolution with a chirp, and that is a product of transforms of a power of two
   (Bluestein, "A linear filtering approach to the computation of discrete Fourier transform", 1970).

The cost is that of ``n log n`` for every n: clusters have as many members as they have.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64
from gvpipe.runtime.compiled import compiled

EIGHTH = 0.78539816339744830962  # of a full turn, radians
N_TERMS = 9  # of the series of sine and cosine within an eighth of a turn: exact to a unit in the last place or two


@compiled
def find_turn(numerator: int, denominator: int) -> tuple[float, float]:
    """Cosine and sine of ``numerator / denominator`` of a full turn, ``0 <= numerator < denominator``."""
    octant = 8 * numerator // denominator
    part = 8 * numerator - octant * denominator
    if octant & 1:  # back from the octant's end
        part = denominator - part
    angle = EIGHTH * (part / denominator)
    square = angle * angle
    cosine, sine = 1.0, 1.0
    for k in range(N_TERMS, 0, -1):
        cosine = 1.0 - cosine * square / ((2 * k - 1) * (2 * k))
        sine = 1.0 - sine * square / ((2 * k) * (2 * k + 1))
    sine *= angle
    if (octant + 1) & 2:
        cosine, sine = sine, cosine
    if 2 <= octant < 6:
        cosine = -cosine
    if octant >= 4:
        sine = -sine
    return cosine, sine


@compiled
def invert_cosines(first: Float64, second: Float64) -> None:
    """Turn orthonormal DCT coefficients ``(n, P)``, a signal per column, into the signals ``(n, P)``, in their place.

    Two arrays of signals at a time: they are the real and the imaginary part of one transform.
    """
    n, n_pairs = first.shape
    if n < 2:
        return
    size = 2
    while size < 2 * n - 1:
        size *= 2
    turns = np.empty((size // 2, 2))
    for i in range(size // 2):
        turns[i, 0], turns[i, 1] = find_turn(i, size)
    real, imaginary = np.zeros((size, n_pairs)), np.zeros((size, n_pairs))
    _modulate(first, second, real, imaginary)
    filter_real, filter_imaginary = _chirp(n, size)
    _transform(filter_real, filter_imaginary, turns)
    _transform(real, imaginary, turns)
    for i in range(size):
        c, s = filter_real[i, 0], filter_imaginary[i, 0]
        _rotate(real[i], imaginary[i], c, s)
    _transform_back(real, imaginary, turns)
    for i in range(n):
        c, s = find_turn(i * i % (2 * n), 2 * n)
        target = 2 * i if 2 * i < n else 2 * (n - 1 - i) + 1
        a, b, x, y = real[i], imaginary[i], first[target], second[target]
        for p in range(n_pairs):
            x[p] = a[p] * c - b[p] * s
            y[p] = a[p] * s + b[p] * c


@compiled
def _modulate(first: Float64, second: Float64, real: Float64, imaginary: Float64) -> None:
    """The chirp's multiples of the Fourier coefficients, into the first n rows."""
    n, n_pairs = first.shape
    factor = np.sqrt(1.0 / n)
    for p in range(n_pairs):
        real[0, p], imaginary[0, p] = first[0, p] * factor, second[0, p] * factor
    factor = np.sqrt(0.5 / n)
    for k in range(1, n):
        c, s = find_turn((k + 2 * k * k) % (4 * n), 4 * n)
        c *= factor
        s *= factor
        a, b, a_mirrored, b_mirrored, x, y = first[k], second[k], first[n - k], second[n - k], real[k], imaginary[k]
        for p in range(n_pairs):
            u, v = a[p] + b_mirrored[p], b[p] - a_mirrored[p]
            x[p] = u * c - v * s
            y[p] = u * s + v * c


@compiled
def _chirp(n: int, size: int) -> tuple[Float64, Float64]:
    """Real and imaginary part ``(size, 1)`` of the filter, over ``size``."""
    real, imaginary = np.zeros((size, 1)), np.zeros((size, 1))
    for i in range(n):
        c, s = find_turn(i * i % (2 * n), 2 * n)
        real[i, 0], imaginary[i, 0] = c / size, -s / size
        if i:
            real[size - i, 0], imaginary[size - i, 0] = c / size, -s / size
    return real, imaginary


@compiled
def _transform(real: Float64, imaginary: Float64, turns: Float64) -> None:
    """Fourier transform of the columns, rows of the result in the order of their reversed bits."""
    size = len(real)
    half = size // 2
    while half:
        step = size // (2 * half)
        for j in range(half):
            c, s = turns[j * step, 0], -turns[j * step, 1]
            for i in range(j, size, 2 * half):
                a, b, x, y = real[i], imaginary[i], real[i + half], imaginary[i + half]
                for p in range(len(a)):
                    u, v = a[p] - x[p], b[p] - y[p]
                    a[p] += x[p]
                    b[p] += y[p]
                    x[p] = u * c - v * s
                    y[p] = u * s + v * c
        half //= 2


@compiled
def _transform_back(real: Float64, imaginary: Float64, turns: Float64) -> None:
    """Mirror of `_transform`, times the number of rows."""
    size = len(real)
    half = 1
    while half < size:
        step = size // (2 * half)
        for j in range(half):
            c, s = turns[j * step, 0], turns[j * step, 1]
            for i in range(j, size, 2 * half):
                a, b, x, y = real[i], imaginary[i], real[i + half], imaginary[i + half]
                for p in range(len(a)):
                    u, v = x[p] * c - y[p] * s, x[p] * s + y[p] * c
                    x[p] = a[p] - u
                    y[p] = b[p] - v
                    a[p] += u
                    b[p] += v
        half *= 2


@compiled
def _rotate(real: Float64, imaginary: Float64, c: float, s: float) -> None:
    """Multiply rows by the complex number ``c + i s``."""
    for p in range(len(real)):
        u, v = real[p], imaginary[p]
        real[p] = u * c - v * s
        imaginary[p] = u * s + v * c
