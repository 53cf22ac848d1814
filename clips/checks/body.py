"""Whether points keep a body's shape: bones of one length, hips and shoulders that face as knees and toes do."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.checks.check import Check, Verdict
from clips.clip import Clip, HumanClip
from clips.config import BODY
from robot_models.maths import rotation as rot

_BONES = tuple(
    (f"{side}_{a}", f"{side}_{b}")
    for side in ("left", "right")
    for a, b in (("hip", "knee"), ("knee", "ankle"), ("ankle", "toe"), ("shoulder", "elbow"), ("elbow", "wrist"))
)


def check_bones(clip: Clip) -> Check:
    """How far each bone's length leaves its median, in the worst twentieth of all frames."""
    what, limit = "bones keep their length", f"within {100 * BODY.bone_changes:.0f} %"
    if not isinstance(clip, HumanClip):
        return Check(what=what, value="a robot's do", limit=limit, verdict="holds")
    off = {}
    for a, b in _BONES:
        if {a, b} <= set(clip.landmarks):
            length = np.linalg.norm(clip.point(b) - clip.point(a), axis=1)
            if np.median(length) > BODY.no_length:
                off[f"{a} to {b}"] = np.abs(length / np.median(length) - 1.0)
    if not off:
        return Check(what=what, value="no bone has a length", limit=limit, verdict="cannot tell")
    changes = {bone: float(np.percentile(o, 95.0)) for bone, o in off.items()}
    worst = max(changes, key=lambda bone: changes[bone])
    share = float((off[worst] > BODY.no_bone).mean())
    value = f"{worst} changes by {100 * changes[worst]:.0f} % in a twentieth of the frames"
    verdict: Verdict = "holds" if changes[worst] <= BODY.bone_changes else "doubtful"
    if share <= BODY.no_body:
        return Check(what=what, value=value, limit=limit, verdict=verdict, where=f"worst at {_time(clip, off[worst])}")
    return Check(
        what=what, value=f"{worst} off its length by over {100 * BODY.no_bone:.0f} % in {100 * share:.0f} % of the frames",
        limit=f"{limit}: these points are no body's", verdict="refused", where=f"worst at {_time(clip, off[worst])}",
        cure="are points exchanged, or of several people? name them anew, or state a mapping", option="mapping",
    )  # fmt: skip


def check_facing(clip: Clip) -> Check:
    """In how many frames hips and shoulders face against each other, or knees and toes lie behind the hips."""
    what, limit = "hips, shoulders, knees and toes face one way", f"in all but {100 * BODY.turned_away:.0f} % of frames"
    if not isinstance(clip, HumanClip):
        return Check(what=what, value="a robot's do", limit=limit, verdict="holds")
    hips, shoulders = (rot.unit(clip.point(f"left_{p}") - clip.point(f"right_{p}")) for p in ("hip", "shoulder"))
    against = np.sum(hips * shoulders, axis=1) < -BODY.against
    behind = knees_ahead(clip) < -BODY.behind
    away = against | behind
    value = f"against each other in {100 * against.mean():.1f} %, knees and toes behind in {100 * behind.mean():.1f} % of frames"
    verdict: Verdict = "holds" if away.mean() <= BODY.turned_away else "doubtful"
    where = f"first at {np.argmax(away) / clip.fps:.2f} s" if away.any() else ""
    return Check(what=what, value=value, limit=limit, verdict=verdict, where=where)


def knees_ahead(clip: HumanClip) -> Float[ndarray, "T"]:
    """How far knees and toes lie ahead of the hips' own front [m], on the mean of what the clip has."""
    left = rot.unit(clip.point("left_hip") - clip.point("right_hip"))
    up = rot.unit(
        clip.point("left_shoulder") + clip.point("right_shoulder") - clip.point("left_hip") - clip.point("right_hip")
    )
    front = rot.unit(np.cross(left, up))
    votes = []
    for side in ("left", "right"):
        hip, knee, ankle = (clip.point(f"{side}_{p}") for p in ("hip", "knee", "ankle"))
        votes.append(np.sum(front * (knee - 0.5 * (hip + ankle)), axis=1))
        if f"{side}_toe" in clip.landmarks:
            votes.append(np.sum(front * (clip.point(f"{side}_toe") - ankle), axis=1))
    return np.asarray(np.mean(votes, axis=0))


def _time(clip: Clip, off: Float[ndarray, "T"]) -> str:
    return f"{int(off.argmax()) / clip.fps:.2f} s"
