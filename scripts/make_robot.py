"""Write the tree of a built-in robot from its maker's file: `python scripts/make_robot.py MODEL.urdf NAME "where from, licence"`.

Tree, joints' axes and ranges, masses and inertias are facts of the maker's file, links that are welded merged into their
parents; what a robot looks like, its soles and its capsules stand in the profile. Writes robot_models/assets/NAME.xml.
"""

from __future__ import annotations

import sys
from pathlib import Path

import mujoco
import numpy as np

from robot_models import open_spec

ASSETS = Path(__file__).parents[1] / "robot_models" / "assets"


def tree(path: Path, name: str, credit: str) -> str:
    """MJCF of a robot without surfaces, its root free."""
    model = open_spec(path, repair=True).compile()
    joints = model.njnt - 1
    lines = [
        f'<mujoco model="{name}">',
        "  <!--",
        f"  {credit}: kinematic tree, joint ranges, masses and inertias of {joints} joints,",
        "  welded links merged into their parents. Written by scripts/make_robot.py: edit that, not this file.",
        "-->",
        '  <compiler angle="radian" autolimits="true" />',
        "  <worldbody>",
        *_body(model, 1, 2),
        "  </worldbody>",
        "</mujoco>",
    ]
    return "\n".join(lines) + "\n"


def _body(model: mujoco.MjModel, body: int, depth: int) -> list[str]:
    pad, inner = "  " * depth, "  " * (depth + 1)
    quat = model.body_quat[body]
    turned = "" if np.allclose(quat, [1, 0, 0, 0]) else f' quat="{_numbers(quat, 10)}"'
    place = "" if body == 1 else f' pos="{_numbers(model.body_pos[body])}"{turned}'
    lines = [f'{pad}<body name="{model.body(body).name}"{place}>']
    if body == 1:
        lines.append(f'{inner}<freejoint name="root" />')
    else:
        joint = int(model.body_jntadr[body])
        if model.body_jntnum[body]:
            at = model.jnt_pos[joint]
            pos = f' pos="{_numbers(at)}"' if at.any() else ""
            lines.append(
                f'{inner}<joint name="{model.joint(joint).name}"{pos} axis="{_numbers(model.jnt_axis[joint], 7)}" '
                f'range="{_numbers(model.jnt_range[joint])}" />'
            )
    lines.append(
        f'{inner}<inertial pos="{_numbers(model.body_ipos[body])}" quat="{_numbers(model.body_iquat[body], 8)}" '
        f'mass="{_numbers([model.body_mass[body]])}" diaginertia="{_numbers(model.body_inertia[body])}" />'
    )
    for child in range(body + 1, model.nbody):
        if model.body_parentid[child] == body:
            lines += _body(model, child, depth + 1)
    return [*lines, f"{pad}</body>"]


def _numbers(values: np.ndarray | list[float], digits: int = 6) -> str:
    return " ".join(f"{v:.{digits}g}" if abs(v) > 1e-9 else "0" for v in values)


if __name__ == "__main__":
    source, name, credit = sys.argv[1:]
    (ASSETS / f"{name}.xml").write_text(tree(Path(source), name, credit))
