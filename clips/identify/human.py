"""From raw points in a file's own axes and units to a checked `HumanClip`: up axis, unit, handedness, landmarks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.checks import knees_ahead
from clips.clip import REQUIRED, HumanClip
from clips.config import IDENTIFY
from clips.edit import exchanged_everywhere, without_gaps
from clips.errors import ClipError
from clips.identify.landmark_geometry import estimate_landmarks, off_bones_deg, without_extra_bones
from clips.identify.landmark_names import find_landmarks, find_unit, leg_lengths, stature
from clips.identify.mapping import ExchangedSidesError, UnknownSkeletonError, read_mapping
from clips.provenance import UNITS, Finding, RawFile, ReadOptions, Repair
from robot_models.maths import rotation as rot

_SOME = 500  # frames that sides are told by
# Rotations (determinant +1, so nothing is mirrored) that bring a file's up axis to z.
_Z_FROM_UP = {
    "z": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "-z": [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
    "y": [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
    "-y": [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
    "x": [[0, 0, -1], [0, 1, 0], [1, 0, 0]],
    "-x": [[0, 0, 1], [0, 1, 0], [-1, 0, 0]],
}


def human_clip(
    raw: RawFile,
    *,
    dialect: str,
    fps: float,
    names: Sequence[str],
    positions: Float[ndarray, "T K 3"],
    orientations: Float[ndarray, "T K 4"] | None,
    parents: Sequence[int],
    options: ReadOptions,
    findings: Sequence[Finding] = (),
    repairs: Sequence[Repair] = (),
    unit: Finding | None = None,
    landmarks: Mapping[str, str] | None = None,
) -> HumanClip:
    """Bring points to metres in a right-handed, z-up world and check that they are a person.

    Args:
        raw: the file, for messages and provenance.
        dialect: what was recognised.
        fps: frames per second.
        names: K point names.
        positions: in the file's axes and unit; NaN marks a lost sample.
        orientations: wxyz in the file's axes, or None.
        parents: index of each point's parent, -1 for roots.
        options: what the user states.
        findings: what the reader decided before.
        repairs: what the reader mended before.
        unit: where the file states it and the reader has brought the positions to metres.
        landmarks: landmark -> point name where the dialect knows it; by default found by name.

    Raises:
        ClipError: landmarks missing, long gaps, mirrored or impossible points.
    """
    raw.check_rate(fps)
    if not (np.abs(np.nan_to_num(positions, posinf=np.inf)) < IDENTIFY.absurd).all():
        raise ClipError(raw.name, found="places that are not finite, or absurd", expected="where somebody was")
    known, limbs = _landmarks_of(raw, names, parents, positions, options, landmarks)
    whole = without_gaps(positions, names, [known[k] for k in REQUIRED], fps, raw.name)
    positions, kept = whole.positions, list(whole.points)
    names, parents = [names[k] for k in kept], [kept.index(p) if p in kept else -1 for p in (parents[k] for k in kept)]
    known = {k: n for k, n in known.items() if n in names}
    if orientations is not None:
        orientations = orientations[whole.frames][:, kept]
    up, up_finding = _find_up(positions, names, known, options, raw.name)
    turn = rot.from_matrix(np.array(_Z_FROM_UP[up], dtype=float))
    scale, unit_finding = (
        find_unit(leg_lengths(positions, names, known), options, raw.name) if unit is None else (1.0, unit)
    )
    points, turns = _in_our_axes(positions, orientations, turn, scale)
    height = stature(leg_lengths(points, names, known))
    _check_height(height, scale, unit_finding, raw.name)
    done = [f"unit -> m (x {scale:.6g})"] if scale != 1.0 else []
    done += [f"up {up} -> z"] if up != "z" else []
    source = raw.source(dialect, [*findings, *limbs, up_finding, unit_finding], done, [*repairs, *whole.repairs])
    clip = HumanClip(
        fps=fps, names=tuple(names), positions=points[:: max(1, len(points) // _SOME)], orientations=None,
        parents=tuple(parents), landmarks=known, height=options.stature or height, source=source,
    )  # fmt: skip
    exchanged = exchanged_everywhere(clip)
    if exchanged:
        raise ExchangedSidesError(raw.name, names, exchanged, known)
    facing = _check_handedness(clip)
    source = replace(source, findings=(*source.findings, facing))
    return replace(clip, positions=points, orientations=turns, source=source)


def _landmarks_of(
    raw: RawFile,
    names: Sequence[str],
    parents: Sequence[int],
    positions: Float[ndarray, "T K 3"],
    options: ReadOptions,
    told: Mapping[str, str] | None,
) -> tuple[dict[str, str], list[Finding]]:
    """Landmark -> point name: as the user says, else as the dialect knows, else by name; or a draft to be confirmed.

    With how far the limbs, so named, are from the bones that end in them.
    """
    some = np.nan_to_num(positions[:: max(1, len(positions) // IDENTIFY.probe_frames)])
    if options.mapping is not None:
        known, moved = read_mapping(Path(options.mapping), names), list[str]()
    else:
        known = dict(told or find_landmarks(names))
        missing = [k for k in REQUIRED if k not in known]
        if missing:
            guess = estimate_landmarks(names, parents, some) | known
            if set(REQUIRED) <= set(guess):
                guess, _ = without_extra_bones(guess, names, parents, some)
            raise UnknownSkeletonError(raw.name, names, missing, guess)
        known, moved = without_extra_bones(known, names, parents, some)
    off = off_bones_deg(known, names, parents, some)
    if off is None:
        return known, []
    why = "; ".join((f"worst {off[1]}, against the bone that ends in it", *moved))
    return known, [
        Finding(
            what="limbs", value=f"along their bones within {off[0]:.1f} deg", why=why,
            confidence="measured" if off[0] < IDENTIFY.bends_deg else "assumed", option="mapping",
        )
    ]  # fmt: skip


def _in_our_axes(
    positions: Float[ndarray, "T K 3"],
    orientations: Float[ndarray, "T K 4"] | None,
    turn: Float[ndarray, "4"],
    scale: float,
) -> tuple[ndarray, ndarray | None]:
    """Points turned and scaled, orientations turned; point by point, since an hour has no room for copies of everything."""
    points, turns = np.empty_like(positions), None if orientations is None else np.empty_like(orientations)
    for k in range(positions.shape[1]):
        points[:, k] = scale * rot.rotate(turn, positions[:, k])
        if turns is not None and orientations is not None:
            turns[:, k] = rot.continuous(rot.normalise(rot.multiply(turn, orientations[:, k])))
    return points, turns


def _check_height(height: float, scale: float, unit: Finding, where: str) -> None:
    """A stated unit that makes a dwarf or a giant is wrong."""
    if IDENTIFY.shortest < height < IDENTIFY.tallest:
        return
    fits = next((u for u, s in UNITS.items() if IDENTIFY.shortest < height / scale * s < IDENTIFY.tallest), "")
    raise ClipError(
        where, found=f"a person {height:.3g} m tall, with unit {unit.value} ({unit.why})",
        expected=f"{IDENTIFY.shortest} to {IDENTIFY.tallest} m", cure="state the right unit", option="unit", suggestion=fits,
    )  # fmt: skip


def _find_up(
    positions: ndarray, names: Sequence[str], known: Mapping[str, str], options: ReadOptions, where: str
) -> tuple[str, Finding]:
    """The axis along which the shoulders stand over the ankles."""
    if options.up is not None:
        return options.up, Finding(what="up axis", value=options.up, why="given", confidence="stated", option="up")
    at = {k: positions[:, list(names).index(n)] for k, n in known.items()}
    rise = at["left_shoulder"] + at["right_shoulder"] - at["left_ankle"] - at["right_ankle"]
    share = np.median(rot.unit(rise), axis=0)
    axis = int(np.argmax(np.abs(share)))
    second = float(np.sort(np.abs(share))[-2])
    if abs(share[axis]) < 0.5 or abs(share[axis]) < 1.3 * second:
        raise ClipError(
            where,
            found=f"shoulders over ankles along x, y, z by {share[0]:.2f}, {share[1]:.2f}, {share[2]:.2f}",
            expected="one axis that is clearly up",
            cure="state it",
            option="up",
            suggestion="z",
        )
    name = ("-" if share[axis] < 0 else "") + "xyz"[axis]
    why = (
        f"shoulders lie over ankles along it by {abs(share[axis]):.2f} of their distance, {second:.2f} on the next axis"
    )
    return name, Finding(what="up axis", value=name, why=why, confidence="measured", option="up")


def _check_handedness(clip: HumanClip) -> Finding:
    """Left must be left: the hips' forward (left x up) has to agree with where knees bend and toes point."""
    ahead = float(np.mean(knees_ahead(clip)))
    if abs(ahead) < 0.01:
        why = f"knees and toes lie only {1000 * ahead:.0f} mm ahead of the hips' front: straight legs without toes cannot tell"
        return Finding(what="handedness", value="right-handed", why=why, confidence="assumed")
    if ahead < 0.0:
        raise ClipError(
            clip.source.file,
            found=f"knees and toes {-1000 * ahead:.0f} mm behind the hips' front",
            expected="them in front: left and right are swapped, or the file is mirrored (a left-handed world)",
            cure="export it again right-handed, or swap the names",
        )
    why = f"knees and toes lie {1000 * ahead:.0f} mm ahead of the hips' front (left x up)"
    return Finding(what="handedness", value="right-handed", why=why, confidence="measured")
