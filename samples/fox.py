"""The rest pose of a fox: its bones, and the round cones around them.

Frame: metres, y up, the fox faces +z, its left is +x, the ground is y = 0.
"""

from __future__ import annotations

from dataclasses import dataclass

from implicit import Point, RoundCone


@dataclass(frozen=True)
class Leg:
    """The joints of one leg at rest, all in one plane of constant x."""

    name: str
    parent: str  # bone
    root: Point  # m, hip or shoulder
    knee: Point  # m, knee or elbow
    ankle: Point  # m, hock or wrist
    ball: Point  # m, where the paw begins; it stays in place while the leg carries weight
    toe: Point  # m
    knee_side: int  # +1 if the knee bends forward, -1 if backward
    phase: float  # part of a cycle by which this leg is ahead

    @property
    def bones(self) -> tuple[str, str, str, str]:
        """The names of its bones, from hip to toe."""
        return (f"{self.name}_upper", f"{self.name}_lower", f"{self.name}_cannon", f"{self.name}_paw")


def _front_leg(name: str, x: float, phase: float) -> Leg:
    root, knee, ankle = (x, 0.54, 0.25), (x, 0.345, 0.165), (x, 0.145, 0.225)
    return Leg(name, "chest", root, knee, ankle, (x, 0.045, 0.235), (x, 0.035, 0.295), -1, phase)


def _hind_leg(name: str, x: float, phase: float) -> Leg:
    root, knee, ankle = (x, 0.54, -0.31), (x, 0.345, -0.20), (x, 0.185, -0.375)
    return Leg(name, "pelvis", root, knee, ankle, (x, 0.045, -0.335), (x, 0.035, -0.27), 1, phase)


# A walk in lateral sequence: left hind, left front, right hind, right front.
LEGS = [
    _hind_leg("hind_left", 0.095, 0.0),
    _front_leg("front_left", 0.09, 0.75),
    _hind_leg("hind_right", -0.095, 0.5),
    _front_leg("front_right", -0.09, 0.25),
]

# Joints of the tail and its radii there, in m.
TAIL = [(0.0, y, z) for y, z in ((0.60, -0.42), (0.57, -0.54), (0.50, -0.69), (0.45, -0.85), (0.45, -1.02))]
TAIL_RADII = [0.045, 0.060, 0.085, 0.080, 0.022]

# Bones other than those of the legs: name, parent, joint at rest in m. Parents come first.
SPINE: list[tuple[str, str, Point]] = [
    ("pelvis", "", (0.0, 0.58, -0.30)),
    ("chest", "pelvis", (0.0, 0.58, -0.04)),
    ("neck", "chest", (0.0, 0.64, 0.30)),
    ("head", "neck", (0.0, 0.83, 0.44)),
    ("ear_left", "head", (0.055, 0.93, 0.44)),
    ("ear_right", "head", (-0.055, 0.93, 0.44)),
    *[(f"tail_{k}", "pelvis" if k == 0 else f"tail_{k - 1}", TAIL[k]) for k in range(4)],
]


def fox_parts() -> list[RoundCone]:
    """Return the round cones that make up the body, each with its bone."""
    parts = [
        RoundCone("pelvis", (0.0, 0.575, -0.32), (0.0, 0.590, -0.04), 0.118, 0.112, 0.02),
        RoundCone("chest", (0.0, 0.590, -0.04), (0.0, 0.560, 0.23), 0.112, 0.142, 0.02),
        RoundCone("neck", (0.0, 0.63, 0.28), (0.0, 0.83, 0.42), 0.105, 0.074, 0.08),
        RoundCone("head", (0.0, 0.875, 0.43), (0.0, 0.850, 0.52), 0.104, 0.078, 0.04),
        RoundCone("head", (0.0, 0.835, 0.53), (0.0, 0.805, 0.700), 0.055, 0.027, 0.05),
    ]
    parts += [
        RoundCone(f"tail_{k}", TAIL[k], TAIL[k + 1], TAIL_RADII[k], TAIL_RADII[k + 1], 0.02) for k in range(len(TAIL) - 1)
    ]
    for name, x in (("ear_left", 1.0), ("ear_right", -1.0)):
        parts.append(RoundCone(name, (0.060 * x, 0.935, 0.42), (0.098 * x, 1.09, 0.40), 0.050, 0.016, 0.03))
    for leg in LEGS:
        radii = (0.075, 0.052, 0.040, 0.036) if leg.knee_side < 0 else (0.105, 0.062, 0.038, 0.036)
        upper, lower, cannon, paw = leg.bones
        parts += [
            RoundCone(upper, leg.root, leg.knee, radii[0], radii[1], 0.06),
            RoundCone(lower, leg.knee, leg.ankle, radii[1], radii[2], 0.02),
            RoundCone(cannon, leg.ankle, leg.ball, radii[2], radii[3], 0.02),
            RoundCone(paw, leg.ball, leg.toe, 0.045, 0.035, 0.02),
        ]
    return parts
