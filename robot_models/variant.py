"""Variants of a robot: the same profile with some joints locked (`g1@without_wrists`)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from robot_models.errors import RobotError
from robot_models.model_file import read_spec
from robot_models.profile import FEET, RobotProfile

SIGN = "@"  # between a robot's name and its variant's
_PLACES = ("hip", "knee", "foot", "shoulder", "elbow", "wrist")  # landmarks whose place counts, and not only their turn


def variant_of(profile: RobotProfile, name: str) -> RobotProfile:
    """The profile of a robot that lacks the joints of one of its variants: what they carry stands still at zero.

    A landmark, a tracked body or the anchor on a body that does not move any more goes to the body that carries it.

    Raises:
        RobotError: no such variant, one that leaves nothing of a joint pattern, or one that locks a foot.
    """
    if name not in profile.variants:
        raise RobotError(
            f"robot '{profile.name}{SIGN}{name}'", found="no variant of that name",
            expected=f"one of {', '.join(profile.variants) or 'none: the profile has no [variants]'}",
        )  # fmt: skip
    import mujoco

    model = read_spec(profile).compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    joints = [model.joint(j).name for j in range(1, model.njnt)]
    gone = [j for j in joints if any(re.fullmatch(p, j) for p in profile.variants[name])]
    kept = [j for j in joints if j not in gone]

    def carrier(body: str) -> str:
        """The body that moves it: itself, or the first above it with a joint that is kept."""
        at = model.body(body).id
        while at > 1 and not (model.body_jntnum[at] and model.joint(int(model.body_jntadr[at])).name in kept):
            at = int(model.body_parentid[at])
        return str(model.body(at).name)

    for side in FEET:
        if carrier(profile.soles[side].body) != profile.soles[side].body:
            raise RobotError(
                f"robot '{profile.name}', variant '{name}'", found="a foot that is locked", expected="free ankles"
            )
    ends = dict(profile.ends)
    for mark, body in profile.landmarks.items():
        above = data.body(carrier(body))
        if above.name != body and mark.rpartition("_")[2] in _PLACES:
            frame = data.body(body)
            place = frame.xpos + frame.xmat.reshape(3, 3) @ np.array(profile.ends.get(mark, (0.0, 0.0, 0.0)))
            x, y, z = (round(float(v), 6) for v in above.xmat.reshape(3, 3).T @ (place - above.xpos))
            ends[mark] = x, y, z
    tables: dict[str, Any] = {key: _of(getattr(profile, key), kept) for key in _TABLES}
    return replace(
        profile,
        name=f"{profile.name}{SIGN}{name}",
        title=f"{profile.title}, {name.replace('_', ' ')}: {len(kept)} joints",
        freeze=(*profile.freeze, *map(re.escape, gone)),
        **tables,
        motor_pairs=tuple(pair for pair in profile.motor_pairs if set(pair) <= set(kept)),
        landmarks={mark: carrier(body) for mark, body in profile.landmarks.items()},
        ends=ends,
        anchor=carrier(profile.anchor),
        tracked=tuple(dict.fromkeys(map(carrier, profile.tracked))),
        csv_columns=(),
        variants={},
    )


_TABLES = ("kp", "kd", "armature", "effort", "velocity", "damping", "default_pose", "kp_band", "kd_band")


def _of(table: Mapping[str, Any], kept: list[str]) -> dict[str, Any]:
    """The patterns that any joint is left for."""
    return {pattern: value for pattern, value in table.items() if any(re.fullmatch(pattern, j) for j in kept)}
