"""How vertices get their pixels, by docs/format.md, sections 5.1 and 5.5, in Python's integers, one cell after the other."""

from __future__ import annotations

import math

STEPS = range(-2, 3)
DIRECTIONS = [(a, b, c) for a in STEPS for b in STEPS for c in STEPS if (a, b, c) > (0, 0, 0) and math.gcd(a, b, c) == 1]
assert len(DIRECTIONS) == 49


def dot(a: tuple[int, ...], b: tuple[int, ...]) -> int:
    return sum(i * j for i, j in zip(a, b, strict=True))


def weight(d: tuple[int, ...]) -> int:
    return 90 // dot(d, d) if any(d) else 90


def spread_along(points: list[list[int]], shift: int) -> list[int]:
    """The scores of all directions for points."""
    mean = [sum(c) // len(points) for c in zip(*points, strict=True)]
    left = [tuple((a - b) >> shift for a, b in zip(p, mean, strict=True)) for p in points]
    return [weight(d) * sum(dot(d, e) ** 2 for e in left) for d in DIRECTIONS]


Cell = tuple[list[int], int, int, int, int]  # vertices, x, y, width, height


def widest(spread: list[int]) -> tuple[tuple[int, int, int], tuple[int, int, int]]:
    """The direction of the highest score, and that of the highest at 60 degrees or more from it."""
    one = DIRECTIONS[spread.index(max(spread))]
    apart = [s if 4 * dot(one, d) ** 2 <= dot(one, one) * dot(d, d) else -1 for s, d in zip(spread, DIRECTIONS, strict=True)]
    return one, DIRECTIONS[apart.index(max(apart))]


def halved(
    points: list[list[int]], groups: list[int] | None, width: int, height: int, block: int, cells: list[Cell] | None = None
) -> list[int]:
    """Pixels by section 5.1 of docs/format.md, ``cells`` in place of the plane."""
    if groups is not None:
        middle = [sum(c) // len(points) for c in zip(*points, strict=True)]
        moves = {}
        for g in set(groups):
            own = [p for p, h in zip(points, groups, strict=True) if h == g]
            moves[g] = [2 * (sum(c) // len(own) - m) for c, m in zip(zip(*own, strict=True), middle, strict=True)]
        points = [[a + b for a, b in zip(p, moves[g], strict=True)] for p, g in zip(points, groups, strict=True)]
    low = [min(c) for c in zip(*points, strict=True)]
    points = [[a - b for a, b in zip(p, low, strict=True)] for p in points]
    shift = max(0, max(max(p) for p in points).bit_length() - 10)
    pixels = [-1] * len(points)

    def along(d: tuple[int, ...], before: tuple[int, ...]) -> tuple[int, ...]:
        return tuple(-i for i in d) if dot(d, before) < 0 else d

    def scores(own: list[int]) -> list[int]:
        return spread_along([points[v] for v in own], shift)

    def cell(own: list[int], x: int, y: int, w: int, h: int, across: tuple[int, ...], down: tuple[int, ...]) -> None:
        if not own:
            return
        if w == h == 1:
            pixels[own[0]] = y * width + x
            return
        if cells:
            pass  # they keep their directions
        elif max(w, h) > 4:
            spread = scores(own)
            best = DIRECTIONS[spread.index(max(spread))]
            if w >= h:
                across = along(best, across)
            else:
                down = along(best, down)
        elif w == h == 4:
            one, two = widest(scores(own))

            def like(d: tuple[int, ...], e: tuple[int, ...]) -> int:
                return weight(d) * weight(e) * dot(d, e) ** 2

            if like(two, across) + like(one, down) > like(one, across) + like(two, down):
                one, two = two, one
            across, down = along(one, across), along(two, down)
        longer, direction = (w, across) if w >= h else (h, down)
        first = longer // block // 2 * block if longer >= 2 * block else longer // 2
        own = sorted(own, key=lambda v: dot(tuple(points[v]), direction))
        n = (2 * len(own) * first + longer) // (2 * longer)
        if w >= h:
            cell(own[:n], x, y, first, h, across, down)
            cell(own[n:], x + first, y, w - first, h, across, down)
        else:
            cell(own[:n], x, y, w, first, across, down)
            cell(own[n:], x, y + first, w, h - first, across, down)

    for part, x, y, w, h in cells or []:
        one, two = widest(scores(part))
        cell(part, x, y, w, h, *((one, two) if w >= h else (two, one)))
    if not cells:
        cell(list(range(len(points))), 0, 0, width, height, (0, 0, 0), (0, 0, 0))
    return pixels


def tiled(points: list[list[int]], charts: list[int], width: int, height: int, block: int) -> tuple[list[int], list[Cell]]:
    """Pixels by section 5.5, and the charts' rectangles with their vertices."""
    low = [min(c) for c in zip(*points, strict=True)]
    points = [[a - b for a, b in zip(p, low, strict=True)] for p in points]
    shift = max(0, max(max(p) for p in points).bit_length() - 10)
    centres = {}
    for chart in set(charts):
        own = [p for p, c in zip(points, charts, strict=True) if c == chart]
        centres[chart] = [sum(c) // len(own) for c in zip(*own, strict=True)]
    tiles = []

    def cell(own: list[int], x: int, y: int, w: int, h: int) -> None:
        if len({charts[v] for v in own}) == 1:
            tiles.append((own, x, y, w, h))
            return
        spread = spread_along([centres[charts[v]] for v in own], shift)
        direction = DIRECTIONS[spread.index(max(spread))]
        own = sorted(own, key=lambda v: (dot(tuple(centres[charts[v]]), direction), charts[v]))
        n, longer, shorter = len(own), max(w, h), min(w, h)
        best: tuple[int, int, int] | None = None
        for kept in range(1, n):
            if charts[own[kept - 1]] == charts[own[kept]]:
                continue
            least, most = math.ceil(kept / shorter), longer - math.ceil((n - kept) / shorter)
            worth = min(kept, n - kept) * (2 if least <= most else 1)
            if best is None or worth > best[0]:
                low, high = (least, most) if least <= most else (1, longer - 1)
                first = min(max((2 * longer * kept + n) // (2 * n), low), high)
                best = worth, first, min(max(kept, n - (longer - first) * shorter), first * shorter)
        assert best
        _, first, kept = best
        if w >= h:
            cell(own[:kept], x, y, first, h)
            cell(own[kept:], x + first, y, w - first, h)
        else:
            cell(own[:kept], x, y, w, first)
            cell(own[kept:], x, y + first, w, h - first)

    cell(list(range(len(points))), 0, 0, width, height)
    return halved(points, None, width, height, block, tiles), tiles
