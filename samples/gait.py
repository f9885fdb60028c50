"""The walk of the fox: the rotation of each bone and the position of its joint, in each frame.

Trunk, neck, head, ears and tail follow sine waves of the step. Paws follow footprints on the ground, so that a paw that carries
weight stays in place. Legs reach their paws by two-bone inverse kinematics.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from fox import LEGS, SPINE, Leg

Floats = npt.NDArray[np.float64]
Poses = dict[str, tuple[Floats, Floats, Floats]]

FPS = 30.0
N_CYCLES = 3
FRAMES_PER_CYCLE = 34
STRIDE = 0.52  # m per cycle
DUTY = 0.64  # part of a cycle for which a paw carries weight
LIFT = 0.055  # m, height of a paw's swing


def pose_fox() -> Poses:
    """Return for each bone: joint at rest (3,), m; rotation from rest (F, 3, 3); joint (F, 3), m."""
    cycle = np.arange(N_CYCLES * FRAMES_PER_CYCLE) / FRAMES_PER_CYCLE  # time in cycles, (F,)
    poses = pose_spine(cycle)
    for leg in LEGS:
        poses |= pose_leg(leg, cycle, poses[leg.parent])
    return poses


def body_advance(cycle: Floats) -> Floats:
    """Return the distance (F,), m, that the trunk has walked along z; 0 in the middle of the clip."""
    return STRIDE * (cycle - N_CYCLES / 2)


def pose_spine(cycle: Floats) -> Poses:
    """Return the poses of trunk, neck, head, ears and tail, by forward kinematics."""
    step = 2 * np.pi * cycle  # one turn per stride
    whole = 2 * np.pi * cycle / N_CYCLES  # one turn per clip
    still = np.zeros_like(cycle)
    # Angles in rad: yaw to the left, pitch nose down, roll to the right.
    look = 0.02 * np.sin(step) + 0.26 * np.sin(whole - 0.3)
    angles = {
        "pelvis": (0.050 * np.sin(step + 0.6), 0.015 * np.sin(2 * step), 0.050 * np.sin(step - 0.4)),
        "chest": (-0.090 * np.sin(step + 0.6), 0.020 * np.sin(2 * step + 1.2), -0.085 * np.sin(step - 0.4)),
        "neck": (0.050 * np.sin(step + 0.6) + 0.16 * np.sin(whole), 0.060 * np.sin(2 * step + 2.0), still),
        "head": (look, -0.050 * np.sin(2 * step + 1.6), 0.10 * np.sin(whole)),
        "ear_left": (still, 0.07 * np.sin(2 * step + 0.5), 0.05 * np.sin(2 * step)),
        "ear_right": (still, 0.07 * np.sin(2 * step + 0.8), -0.05 * np.sin(2 * step + 0.4)),
    }
    for k in range(4):
        yaw = (0.07 + 0.05 * k) * np.sin(step - 0.85 * k)
        angles[f"tail_{k}"] = (yaw, 0.045 * np.sin(2 * step - 0.8 * k) - 0.03 * np.sin(whole + k), still)
    poses: Poses = {}
    for bone, parent, joint in SPINE:
        rest, turn = np.array(joint), rotation(*angles[bone])
        if parent:
            parent_rest, parent_turn, parent_joint = poses[parent]
            poses[bone] = (rest, parent_turn @ turn, parent_joint + parent_turn @ (rest - parent_rest))
        else:
            sway, bob = 0.010 * np.sin(step - 0.4), 0.009 * np.cos(2 * step - 0.9) - 0.008
            poses[bone] = (rest, turn, rest + np.stack([sway, bob, body_advance(cycle)], axis=1))
    return poses


def pose_leg(leg: Leg, cycle: Floats, parent: tuple[Floats, Floats, Floats]) -> Poses:
    """Return the poses of the four bones of one leg, from the pose of its parent."""
    rest = [np.array(point) for point in (leg.root, leg.knee, leg.ankle, leg.ball, leg.toe)]
    parent_rest, parent_turn, parent_joint = parent
    root = parent_joint + parent_turn @ (rest[0] - parent_rest)
    ball, swing = follow_footprints(leg, cycle)
    # The cannon bone leans with the leg, and more while the paw swings: heel up behind, toes up in front.
    lean = 0.75 * np.arctan2((ball - root)[:, 2] - (rest[3] - rest[0])[2], (root - ball)[:, 1])
    flex = np.where(swing > 0, np.sin(np.pi * swing) ** 2 * (1.35 - 1.1 * swing), 0.0)
    cannon_turn = rotation(0.0 * lean, flex * (0.9 if leg.knee_side < 0 else 0.45) - lean * 0.9, 0.0 * lean)
    ankle = ball + cannon_turn @ (rest[2] - rest[3])
    knee = bend_knee(root, ankle, _length(rest[1] - rest[0]), _length(rest[2] - rest[1]), leg.knee_side)
    paw_turn = rotation(0.0 * lean, 0.85 * flex, 0.0 * lean)
    upper, lower, cannon, paw = leg.bones
    return {
        upper: (rest[0], turn_between(rest[1] - rest[0], knee - root), root),
        lower: (rest[1], turn_between(rest[2] - rest[1], ankle - knee), knee),
        cannon: (rest[2], turn_between(rest[3] - rest[2], ball - ankle), ankle),
        paw: (rest[3], paw_turn, ball),
    }


def follow_footprints(leg: Leg, cycle: Floats) -> tuple[Floats, Floats]:
    """Return the path (F, 3), m, of the ball of a paw, and the part of its swing that is done (F,), 0 on the ground."""
    phase = cycle + leg.phase
    n_steps, within = np.floor(phase), phase % 1.0
    # A footprint lies where the paw is at rest under the trunk in the middle of its stance.
    print_now = body_advance(n_steps + DUTY / 2 - leg.phase) + leg.ball[2]
    swing = np.clip((within - DUTY) / (1.0 - DUTY), 0.0, 1.0)
    ease = swing**3 * (10.0 - 15.0 * swing + 6.0 * swing**2)
    height = LIFT * 16.0 * (swing * (1.0 - swing)) ** 2 * (1.25 - 0.5 * swing)
    x = np.full_like(cycle, leg.ball[0])
    return np.stack([x, leg.ball[1] + height, print_now + STRIDE * ease], axis=1), swing


def bend_knee(root: Floats, ankle: Floats, upper: float, lower: float, side: int) -> Floats:
    """Return the knee (F, 3), m, between hip and ankle, for bone lengths, m; it bends forward if side is +1."""
    reach = ankle - root
    distance = np.linalg.norm(reach, axis=1)
    along = reach / distance[:, None]
    # A leg that is asked for more than its length stays just short of straight.
    distance = np.clip(distance, abs(upper - lower) * 1.02, (upper + lower) * 0.998)
    cosine = (upper**2 + distance**2 - lower**2) / (2 * upper * distance)
    bend = np.cross(along, _across(along)) * side
    offset: Floats = upper * (cosine[:, None] * along + np.sqrt(1 - cosine**2)[:, None] * bend)
    return root + offset


def rotation(yaw: Floats, pitch: Floats, roll: Floats) -> Floats:
    """Return rotations (F, 3, 3) by angles (F,), rad: roll about z, then pitch about x, then yaw about y."""
    return _axis_turn(yaw, 1) @ _axis_turn(pitch, 0) @ _axis_turn(roll, 2)


def turn_between(rest: Floats, posed: Floats) -> Floats:
    """Return rotations (F, 3, 3) from a bone's rest direction (3,) to directions (F, 3), without twist."""
    return _frames(posed) @ _frames(rest[None]).transpose(0, 2, 1)


def _frames(direction: Floats) -> Floats:
    along = direction / np.linalg.norm(direction, axis=1, keepdims=True)
    across = _across(along)
    return np.stack([across, along, np.cross(across, along)], axis=2)


def _across(along: Floats) -> Floats:
    """Return the unit vectors (F, 3) at right angles to `along` that are closest to +x."""
    across = np.array([1.0, 0.0, 0.0]) - along[:, :1] * along
    unit: Floats = across / np.linalg.norm(across, axis=1, keepdims=True)
    return unit


def _axis_turn(angle: Floats, axis: int) -> Floats:
    u, v = (axis + 1) % 3, (axis + 2) % 3
    turn = np.zeros((len(angle), 3, 3))
    turn[:, axis, axis] = 1.0
    turn[:, u, u] = turn[:, v, v] = np.cos(angle)
    turn[:, v, u] = np.sin(angle)
    turn[:, u, v] = -turn[:, v, u]
    return turn


def _length(vector: Floats) -> float:
    return float(np.linalg.norm(vector))
