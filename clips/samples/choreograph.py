"""Dances that nobody danced, for trackers to learn from: python -m clips.samples.choreograph FOLDER COUNT.

The sample dance's stick figure steps, turns, hops, kicks, squats and lunges at random, its arms and trunk moving to a beat of its
own; every dance is a BVH for dance-retarget. The same seed gives the same dances. Nothing recorded goes into them.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy import ndarray

from clips.samples.make_samples import ANKLE, FPS, JOINTS, NAMES, bump, ease, leg, write_bvh
from robot_models.maths import rotation as rot

DRILL_S, DRILL_SEED = 10.0, 290  # of its hands and heights: knees 29 cm down, hops of 10 cm, turns of 100 degrees
GRAVITY = 9.81  # [m/s^2]
HIPS = 0.86  # height of the hips while dancing [m]
STEP = 0.8  # of a beat that a foot is in the air
SIDES = (("Left", 1.0), ("Right", -1.0))
DRILL = ("turn", "squat", "hop", "kick", "turn", "lunge", "hop", "step")  # what a robot is tried out on
MOVES = {"step": 6.0, "turn": 3.0, "kick": 2.0, "hop": 1.5, "squat": 1.5, "lunge": 1.5, "sway": 2.0}  # how often each


class Dance:
    """Paths of hips and feet, written move by move.

    Args:
        seconds: about how long.
        rng: of everything.
    """

    def __init__(self, seconds: float, rng: np.random.Generator) -> None:
        self.rng, self.beat_s = rng, float(rng.uniform(0.42, 0.7))
        self.beats = int(seconds / self.beat_s)
        self.beat = np.arange(int(self.beats * self.beat_s * FPS) + 1) / FPS / self.beat_s
        frames = len(self.beat)
        self.feet = {side: np.tile([0.0, 0.11 * s, ANKLE], (frames, 1)) for side, s in SIDES}
        self.feet_yaw = {side: np.zeros(frames) for side, _ in SIDES}
        self.lowered, self.raised, self.lean = np.zeros(frames), np.zeros(frames), np.zeros((frames, 2))
        self.place, self.yaw = np.zeros(2), 0.0

    def choreograph(self, moves: Sequence[str] = ()) -> None:
        """One move after another, from a beat of standing to two of it; the moves given, or any."""
        at, names, weights = 1.0, list(MOVES), np.array(list(MOVES.values()))
        following = iter(moves)
        while at < self.beats - 5:
            move = next(following, "sway") if moves else self.rng.choice(names, p=weights / weights.sum())
            at += getattr(self, f"_{move}")(at)

    def _step(self, at: float, turn: float = 0.0) -> float:
        self.yaw += turn
        way = self.rng.normal(scale=(0.16, 0.14)) * (0.4 if turn else 1.0)
        self.place += rot.rotate(rot.from_yaw(np.array(self.yaw)), np.array([*way, 0.0]))[:2]
        first = way[1] > 0.0 if not turn else turn > 0.0  # the left foot opens a way to the left
        for k, (side, s) in enumerate(SIDES if first else SIDES[::-1]):
            self._put(side, at + k, np.array([self.rng.normal(scale=0.03), s * self.rng.uniform(0.1, 0.15)]))
        return 2.0

    def _turn(self, at: float) -> float:
        return self._step(at, float(self.rng.choice([-1, 1]) * self.rng.uniform(0.4, 1.2)))

    def _lunge(self, at: float) -> float:
        side, s = SIDES[self.rng.integers(2)]
        self._put(side, at, np.array([self.rng.uniform(-0.1, 0.35), s * self.rng.uniform(0.15, 0.35)]))
        self.lowered += self.rng.uniform(0.05, 0.15) * bump((self.beat - at) / 3.0)
        self._put(side, at + 2.0, np.array([0.0, 0.12 * s]))
        return 3.0

    def _kick(self, at: float) -> float:
        side, s = SIDES[self.rng.integers(2)]
        lift = bump((self.beat - at) / 2.0)[:, None]
        way = np.array([self.rng.uniform(0.1, 0.5), s * self.rng.uniform(0.0, 0.25), 0.0])
        reach = rot.rotate(rot.from_yaw(np.array(self.yaw)), way + np.array([0.0, 0.0, self.rng.uniform(0.1, 0.4)]))
        self.feet[side] += lift * reach
        self.lean += lift * (self._foot("Right" if s > 0 else "Left") - self.place)  # over the foot that stands
        return 2.0

    def _hop(self, at: float) -> float:
        height = self.rng.uniform(0.03, 0.1)
        flight = np.sqrt(8.0 * height / GRAVITY) / self.beat_s  # in beats
        part = np.clip((self.beat - at - 0.5) / flight, 0.0, 1.0)
        self.raised += 4.0 * height * part * (1.0 - part)
        for begin in (at - 0.2, at + 0.4 + flight):  # to jump off, and to land
            self.lowered += 0.08 * bump((self.beat - begin) / 0.8)
        return 2.0

    def _squat(self, at: float) -> float:
        self.lowered += self.rng.uniform(0.1, 0.3) * bump((self.beat - at) / 3.0)
        return 3.0

    def _sway(self, at: float) -> float:
        self.lean[:, 1] += 0.05 * np.sin(np.pi * self.beat) * bump((self.beat - at) / 4.0)
        return 2.0

    def _foot(self, side: str) -> ndarray:
        """Where a foot stands in the end."""
        return self.feet[side][-1, :2].copy()

    def _put(self, side: str, at: float, offset: ndarray) -> None:
        """A step of one foot to a place beside the dancer."""
        part = (self.beat - at) / STEP
        goal = self.place + rot.rotate(rot.from_yaw(np.array(self.yaw)), np.array([*offset, 0.0]))[:2]
        self.feet[side][:, :2] += ease(part)[:, None] * (goal - self._foot(side))
        self.feet[side][:, 2] += self.rng.uniform(0.05, 0.12) * bump(part)
        self.feet_yaw[side] += ease(part) * (self.yaw - self.feet_yaw[side][-1])

    def hips(self) -> tuple[ndarray, ndarray]:
        """Path (T, 3) and heading (T,): between the feet, lower where a leg would not reach."""
        middle = 0.5 * (self.feet["Left"][:, :2] + self.feet["Right"][:, :2])
        kicks = np.abs(self.lean).max(axis=1, keepdims=True) > 0.0
        path = np.where(kicks, smooth(middle), middle) + self.lean
        height = HIPS - np.minimum(self.lowered, 0.4) + self.raised
        for side, _ in SIDES:
            away = np.linalg.norm(self.feet[side][:, :2] - path, axis=1)
            height = np.minimum(height, self.feet[side][:, 2] + np.sqrt(np.maximum(0.79**2 - away**2, 0.1)) + 0.03)
        return np.column_stack((smooth(path), smooth(height))), 0.5 * (self.feet_yaw["Left"] + self.feet_yaw["Right"])

    def gestures(self) -> dict[str, ndarray]:
        """Local rotations of trunk, head and arms: other keys every beat or two, smoothly between them."""
        still = ease(self.beat / 2.0) * ease((self.beats - self.beat) / 2.0)

        def keys(width: float, mean: float = 0.0) -> ndarray:
            every = self.rng.choice([1.0, 1.0, 2.0])
            at = np.arange(0.0, self.beats + every, every)
            values = mean + width * self.rng.uniform(-1.0, 1.0, size=len(at))
            k = np.clip((self.beat / every).astype(int), 0, len(at) - 2)
            return np.radians(values[k] + ease(self.beat / every - k) * (values[k + 1] - values[k]))

        def turn(axis: str, angle: ndarray) -> ndarray:
            return rot.exp(angle[:, None] * np.eye(3)["xyz".index(axis)])

        local = {
            "Spine": rot.multiply(turn("z", still * keys(18)), turn("y", still * keys(10, 6.0))),
            "Chest": rot.multiply(turn("z", still * keys(12)), turn("x", still * keys(8))),
            "Head": rot.multiply(turn("z", still * keys(25)), turn("y", still * keys(12))),
        }
        for side, s in SIDES:
            down = np.radians(70.0) * (1.0 - still) + still * keys(75, 25.0)  # from the T-pose
            local[f"{side}Arm"] = rot.multiply(turn("z", -s * still * keys(45, 30.0)), turn("x", -s * down))
            local[f"{side}ForeArm"] = turn("z", -s * still * keys(50, 55.0))
        return local


def smooth(path: ndarray, half_s: float = 0.12) -> ndarray:
    """Mean over a short while around every frame."""
    half = round(half_s * FPS)
    kernel = np.hanning(2 * half + 3)[1:-1]
    padded = np.pad(path, ((half, half), *((0, 0) for _ in path.shape[1:])), mode="edge")
    return np.apply_along_axis(lambda x: np.convolve(x, kernel / kernel.sum(), "valid"), 0, padded)


def pose(dance: Dance) -> tuple[ndarray, ndarray]:
    """World positions (T, K, 3) and rotations (T, K, 4) of the stick figure."""
    path, heading = dance.hips()
    local, frames = dance.gestures(), len(path)
    positions, turns = np.zeros((frames, len(JOINTS), 3)), np.tile(rot.IDENTITY, (frames, len(JOINTS), 1))
    for i, (name, parent, offset) in enumerate(JOINTS):
        if not parent:
            positions[:, i], turns[:, i] = path, rot.from_yaw(heading)
            continue
        p, side = NAMES.index(parent), name.removesuffix("UpLeg")
        positions[:, i] = positions[:, p] + rot.rotate(turns[:, p], np.broadcast_to(offset, (frames, 3)))
        if name.endswith("UpLeg"):
            ankle = dance.feet[side] + np.column_stack((np.zeros((frames, 2)), dance.raised))
            turns[:, i], turns[:, i + 1] = leg(positions[:, i], ankle, turns[:, 0])
        elif name.endswith(("Foot", "Toe")):
            turns[:, i] = rot.from_yaw(dance.feet_yaw["Left" if name.startswith("Left") else "Right"])
        elif not name.endswith("Leg"):
            turns[:, i] = rot.multiply(turns[:, p], local.get(name, np.broadcast_to(rot.IDENTITY, (frames, 4))))
    return positions, turns


def drill() -> Dance:
    """Turns, a deep knee bend, hops, a kick and raised arms in ten seconds: what a robot is tried out on."""
    dance = Dance(DRILL_S, np.random.default_rng(DRILL_SEED))
    dance.choreograph(DRILL)
    return dance


def main() -> None:
    """Write the dances; without arguments the drill."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("count", type=int, nargs="?", default=60)
    parser.add_argument("seconds", type=float, nargs="?", default=20.0)
    parser.add_argument("seed", type=int, nargs="?", default=0)
    args = parser.parse_args()
    if args.folder is None:
        write_bvh(Path(__file__).with_name("drill.bvh"), *pose(drill()))
        return
    args.folder.mkdir(parents=True, exist_ok=True)
    for k in range(args.count):
        dance = Dance(args.seconds, np.random.default_rng((args.seed, k)))
        dance.choreograph()
        write_bvh(args.folder / f"dance_{args.seed}_{k:03d}.bvh", *pose(dance))


if __name__ == "__main__":
    main()
