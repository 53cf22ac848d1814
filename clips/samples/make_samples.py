"""Choreograph the sample dance and write it in two formats, with the flaws of real motion capture.

    python -m clips.samples.make_samples            # writes groove.bvh and groove.csv beside this file

Everything is computed: a hand-made stick figure, joint angles as functions of the beat, feet placed on a step plan
and reached by two-bone IK. Then the flaws: feet that slide while they stand, one foot sunk into the floor, jitter, and
(in the CSV, where a cell can be empty) a gap of three frames at one wrist. Nothing recorded went into it.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy import ndarray

from robot_models.maths import rotation as rot

FPS = 60.0
BEAT_S = 0.5  # 120 beats per minute
BEATS = 20
HERE = Path(__file__).parent

# name, parent, rest offset [m], z up, x forward, y left; T-pose. The person is 1.70 m tall.
JOINTS: tuple[tuple[str, str, tuple[float, float, float]], ...] = (
    ("Hips", "", (0.0, 0.0, 0.92)),
    ("Spine", "Hips", (0.0, 0.0, 0.12)),
    ("Chest", "Spine", (0.0, 0.0, 0.18)),
    ("Neck", "Chest", (0.0, 0.0, 0.22)),
    ("Head", "Neck", (0.02, 0.0, 0.10)),
    *(
        joint
        for side, s in (("Left", 1.0), ("Right", -1.0))
        for joint in (
            (f"{side}UpLeg", "Hips", (0.0, 0.09 * s, -0.03)),
            (f"{side}Leg", f"{side}UpLeg", (0.0, 0.0, -0.41)),
            (f"{side}Foot", f"{side}Leg", (0.0, 0.0, -0.40)),
            (f"{side}Toe", f"{side}Foot", (0.14, 0.0, -0.06)),
            (f"{side}Shoulder", "Chest", (0.0, 0.06 * s, 0.18)),
            (f"{side}Arm", f"{side}Shoulder", (0.0, 0.12 * s, 0.0)),
            (f"{side}ForeArm", f"{side}Arm", (0.0, 0.27 * s, 0.0)),
            (f"{side}Hand", f"{side}ForeArm", (0.0, 0.25 * s, 0.0)),
        )
    ),
)
NAMES = [j[0] for j in JOINTS]
ANKLE = 0.08  # height of the ankle over the floor while the foot stands flat [m]


def bump(t: ndarray) -> ndarray:
    """0 -> 1 -> 0 over t in [0, 1], smooth at both ends."""
    return np.where((t > 0) & (t < 1), np.sin(np.pi * np.clip(t, 0, 1)) ** 2, 0.0)


def ease(t: ndarray) -> ndarray:
    """0 -> 1 over t in [0, 1], minimum jerk."""
    t = np.clip(t, 0.0, 1.0)
    return t**3 * (10 - 15 * t + 6 * t * t)


def steps(beat: ndarray, plan: Sequence[tuple[float, float, float]], start: tuple[float, float]) -> ndarray:
    """Ankle paths (T, 3) from a plan of (beat at which a step begins, x, y); a step takes 0.8 beats."""
    path = np.tile([*start, ANKLE], (len(beat), 1))
    for when, x, y in plan:
        part = (beat - when) / 0.8
        path[:, :2] += ease(part)[:, None] * (np.array([x, y]) - path[:, :2])
        path[:, 2] += 0.09 * bump(part)
    return path


def choreography() -> tuple[ndarray, dict[str, ndarray], dict[str, ndarray]]:
    """Hips path (T, 3), local rotations by joint and ankle paths by side, over the whole dance."""
    beat = np.arange(int(BEATS * BEAT_S * FPS) + 1) / FPS / BEAT_S
    envelope = ease(beat) * ease(BEATS - beat)  # still at both ends
    left = [(4, 0.0, 0.24), (6, 0.16, 0.14), (8, 0.0, 0.12), (12, -0.10, 0.20), (14, 0.05, 0.12), (18, 0.0, 0.11)]
    right = [(5, 0.0, 0.02), (7, 0.12, -0.10), (9, 0.0, -0.12), (13, 0.06, -0.22), (15, 0.0, -0.12), (17, 0.02, -0.11)]
    ankles = {"Left": steps(beat, left, (0.0, 0.11)), "Right": steps(beat, right, (0.0, -0.11))}
    sway = np.sin(np.pi * beat)  # one side per beat
    hips = np.zeros((len(beat), 3))
    hips[:, :2] = 0.5 * (ankles["Left"][:, :2] + ankles["Right"][:, :2])
    hips[:, 1] += 0.04 * envelope * sway * (beat < 4) + 0.025 * envelope * sway * (beat >= 4)
    hips[:, 2] = 0.875 - 0.025 * envelope * (1 - np.cos(2 * np.pi * beat)) - 0.02 * envelope

    def turn(axis: str, angle: ndarray) -> ndarray:
        return rot.exp(np.radians(angle)[:, None] * np.eye(3)["xyz".index(axis)])

    wave = envelope * np.sin(np.pi * beat)
    local = {
        "Hips": turn("z", 12 * wave),
        "Spine": turn("z", -14 * wave),
        "Chest": rot.multiply(turn("z", -10 * wave), turn("x", 6 * wave)),
        "Neck": turn("z", 12 * wave),
        "Head": turn("y", 8 * envelope * np.sin(2 * np.pi * beat)),
    }
    reach = bump((beat - 8) / 4) + bump((beat - 16) / 3)
    for side, s in (("Left", 1.0), ("Right", -1.0)):
        phase = envelope * np.sin(np.pi * beat + (0.0 if s > 0 else np.pi))
        drop = 68 - 60 * np.clip(reach, 0, 1) + 10 * phase  # from the T-pose down
        local[f"{side}Arm"] = rot.multiply(turn("z", -s * (18 + 16 * phase)), turn("x", -s * drop))
        local[f"{side}ForeArm"] = turn("z", -s * (55 + 25 * phase - 30 * np.clip(reach, 0, 1)))
    return hips, local, ankles


def pose(hips: ndarray, local: dict[str, ndarray], ankles: dict[str, ndarray]) -> tuple[ndarray, ndarray]:
    """World positions (T, K, 3) and rotations (T, K, 4); legs by two-bone IK to the ankles, feet level."""
    frames = len(hips)
    positions, turns = np.zeros((frames, len(JOINTS), 3)), np.tile(rot.IDENTITY, (frames, len(JOINTS), 1))
    for i, (name, parent, offset) in enumerate(JOINTS):
        if not parent:
            positions[:, i], turns[:, i] = hips, local[name]
            continue
        p = NAMES.index(parent)
        positions[:, i] = positions[:, p] + rot.rotate(turns[:, p], np.broadcast_to(offset, (frames, 3)))
        side = name.removesuffix("UpLeg")
        if name.endswith("UpLeg"):
            thigh, shin = leg(positions[:, i], ankles[side], turns[:, 0])
            turns[:, i], turns[:, i + 1] = thigh, shin
        elif name.endswith(("Foot", "Toe")):
            turns[:, i] = rot.from_yaw(rot.yaw(turns[:, 0]) * 0.5)
        elif not name.endswith("Leg"):
            turns[:, i] = rot.multiply(turns[:, p], local.get(name, np.broadcast_to(rot.IDENTITY, (frames, 4))))
    return positions, turns


def leg(hip: ndarray, ankle: ndarray, pelvis: ndarray) -> tuple[ndarray, ndarray]:
    """Rotations of thigh and shin (bones along -z at rest) that put the ankle where it shall be, knee forward."""
    thigh, shin = 0.41, 0.40
    down = ankle - hip
    distance = np.clip(np.linalg.norm(down, axis=1), 0.3, thigh + shin - 1e-3)
    bend = np.arccos((thigh**2 + distance**2 - shin**2) / (2 * thigh * distance))
    fold = np.arccos((thigh**2 + shin**2 - distance**2) / (2 * thigh * shin))
    forward = rot.rotate(pelvis, np.broadcast_to([1.0, 0.0, 0.0], hip.shape))
    x = rot.unit(forward - np.sum(forward * rot.unit(down), axis=1, keepdims=True) * rot.unit(down))
    base = rot.from_axes(x, np.cross(-rot.unit(down), x))
    upper = rot.multiply(base, rot.exp(-bend[:, None] * np.array([0.0, 1.0, 0.0])))
    return upper, rot.multiply(upper, rot.exp((np.pi - fold)[:, None] * np.array([0.0, 1.0, 0.0])))


def with_flaws(
    hips: ndarray, ankles: dict[str, ndarray], rng: np.random.Generator
) -> tuple[ndarray, dict[str, ndarray]]:
    """What cameras do: standing feet creep, one foot sinks, everything trembles a little."""
    time = np.arange(len(hips)) / FPS
    creep = 0.012 * np.stack((np.sin(1.1 * time), np.cos(0.8 * time), 0 * time), axis=1)
    sunk = -0.022 * bump((time - 2.0) / 3.0)
    flawed = {s: a + creep * (1 if s == "Left" else -0.8) for s, a in ankles.items()}
    flawed["Right"][:, 2] += sunk
    noise = rng.normal(scale=0.0012, size=(3, len(hips), 3))
    return hips + noise[0], {"Left": flawed["Left"] + noise[1], "Right": flawed["Right"] + noise[2]}


def write_bvh(path: Path, positions: ndarray, turns: ndarray) -> None:
    """BVH in the field's custom: cm, y up, root with six channels, Z Y X Euler angles."""
    y_up = rot.exp(np.radians(-90.0) * np.array([1.0, 0.0, 0.0]))  # z up -> y up
    front = rot.exp(np.radians(-90.0) * np.array([0.0, 1.0, 0.0]))  # x forward -> z forward
    file_from_world = rot.multiply(front, y_up)
    lines, columns = ["HIERARCHY"], []

    def convert(v: ndarray) -> ndarray:
        return 100.0 * rot.rotate(np.broadcast_to(file_from_world, (*np.shape(v)[:-1], 4)), np.asarray(v, dtype=float))

    def visit(index: int, depth: int) -> None:
        name, parent, offset = JOINTS[index]
        pad = "  " * depth
        x, y, z = convert(np.array(offset)) if parent else (0.0, 0.0, 0.0)
        lines.extend(
            [f"{pad}{'JOINT' if parent else 'ROOT'} {name}", f"{pad}{{", f"{pad}  OFFSET {x:.4f} {y:.4f} {z:.4f}"]
        )
        channels = "Zrotation Yrotation Xrotation"
        if parent:
            lines.append(f"{pad}  CHANNELS 3 {channels}")
            above = turns[:, NAMES.index(parent)]
            relative = rot.multiply(rot.conjugate(above), turns[:, index])
        else:
            lines.append(f"{pad}  CHANNELS 6 Xposition Yposition Zposition {channels}")
            columns.append(convert(positions[:, index]))
            relative = turns[:, index]
        same = np.broadcast_to(file_from_world, relative.shape)
        columns.append(np.degrees(euler_zyx(rot.multiply(rot.multiply(same, relative), rot.conjugate(same)))))
        children = [i for i, j in enumerate(JOINTS) if j[1] == name]
        for child in children:
            visit(child, depth + 1)
        if not children:
            lines.extend([f"{pad}  End Site", f"{pad}  {{", f"{pad}    OFFSET 0.0 0.0 0.0", f"{pad}  }}"])
        lines.append(f"{pad}}}")

    visit(0, 0)
    values = np.concatenate(columns, axis=1)
    lines += ["MOTION", f"Frames: {len(values)}", f"Frame Time: {1 / FPS:.8f}"]
    lines += [" ".join(f"{v:.3f}" for v in row) for row in values]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def euler_zyx(q: ndarray) -> ndarray:
    """Intrinsic Z, Y, X angles [rad]."""
    m = rot.to_matrix(q)
    return np.stack(
        (
            np.arctan2(m[..., 1, 0], m[..., 0, 0]),
            np.arcsin(np.clip(-m[..., 2, 0], -1.0, 1.0)),
            np.arctan2(m[..., 2, 1], m[..., 2, 2]),
        ),
        axis=-1,
    )


POINT_NAMES = {
    "Hips": "pelvis", "Chest": "chest", "Neck": "neck", "Head": "head",
    **{f"{s}{a}": f"{s.lower()}_{b}" for s in ("Left", "Right") for a, b in (
        ("UpLeg", "hip"), ("Leg", "knee"), ("Foot", "ankle"), ("Toe", "toe"), ("Arm", "shoulder"), ("ForeArm", "elbow"),
        ("Hand", "wrist"))},
}  # fmt: skip


def write_csv(path: Path, positions: ndarray) -> None:
    """Named points in metres, z up, with a time column; the left wrist is lost for three frames."""
    columns = [f"{p}_{axis}" for p in POINT_NAMES.values() for axis in "xyz"]
    lines = [
        "# the sample dance of dance-retarget, made by clips/samples/make_samples.py",
        ",".join(["time", *columns]),
    ]
    lost = slice(300, 303)
    for t, row in enumerate(positions[:, [NAMES.index(n) for n in POINT_NAMES]]):
        cells = [f"{v:.5f}" for v in row.ravel()]
        if lost.start <= t < lost.stop:
            at = 3 * list(POINT_NAMES).index("LeftHand")
            cells[at : at + 3] = ["", "", ""]
        lines.append(",".join([f"{t / FPS:.6f}", *cells]))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def main() -> None:
    """Write both files."""
    rng = np.random.default_rng(7)
    hips, local, ankles = choreography()
    hips, ankles = with_flaws(hips, ankles, rng)
    positions, turns = pose(hips, local, ankles)
    write_bvh(HERE / "groove.bvh", positions, turns)
    write_csv(HERE / "groove.csv", positions)


if __name__ == "__main__":
    main()
