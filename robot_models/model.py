"""`RobotModel`: one compiled robot with everything addressed by name."""

from __future__ import annotations

import difflib
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from robot_models.errors import RobotError
from robot_models.maths import rotation as rot
from robot_models.profile import FEET, RobotProfile, Sole

if TYPE_CHECKING:
    import mujoco

CONTACT_NAMES = tuple(f"{side}_{edge}" for side in FEET for edge in ("heel", "toe"))
PART_NAMES = ("pelvis", *(f"{side}_{part}" for side in FEET for part in ("knee", "hand", "elbow", "shoulder")))
"""What else of a body may be on the floor. A part is its landmark; a hand is what hangs on the wrist."""
_SEGMENT = {"hip": "thigh", "knee": "shin", "shoulder": "upper arm", "elbow": "forearm", "wrist": "hand"}


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class RobotModel:
    """A robot ready for kinematics and physics. J joints, B bodies (the root and every body with a joint).

    `model` is mesh-free: primitives, four contact points per sole, a floor, one position actuator per joint in
    joint order. qpos is [root xyz, root wxyz, joints in `joint_names` order].
    """

    profile: RobotProfile
    model: mujoco.MjModel
    joint_names: tuple[str, ...]
    body_names: tuple[str, ...]
    body_ids: tuple[int, ...]  # MuJoCo ids of `body_names`
    lower: Float[ndarray, "J"]  # [rad]
    upper: Float[ndarray, "J"]  # [rad]
    velocity: Float[ndarray, "J"]  # [rad/s]
    effort: Float[ndarray, "J"]  # [N m]
    kp: Float[ndarray, "J"]  # [N m/rad]
    kd: Float[ndarray, "J"]  # [N m s/rad]
    default_qpos: Float[ndarray, "nq"]  # soles on the floor, heading +x

    def __repr__(self) -> str:
        return f"RobotModel({self.name}, {len(self.joint_names)} joints)"

    @property
    def name(self) -> str:
        """Key in the robot catalogue."""
        return self.profile.name

    @property
    def nq(self) -> int:
        """Length of qpos: 7 + J."""
        return int(self.model.nq)

    @property
    def soles(self) -> Mapping[str, Sole]:
        """Flat patch per foot."""
        return self.profile.soles

    @property
    def default_joint_pos(self) -> Float[ndarray, "J"]:
        """Joint angles of the default pose [rad]."""
        return np.asarray(self.default_qpos[7:])

    @property
    def zero_qpos(self) -> Float[ndarray, "nq"]:
        """Every joint at zero, upright at the origin, facing +x."""
        return np.array([0.0, 0.0, 0.0, 1.0, *np.zeros(self.nq - 4)])

    def joint(self, name: str) -> int:
        """Place of a joint in every joint array."""
        return _place(name, self.joint_names, f"robot '{self.name}', joint")

    def body(self, name: str) -> int:
        """Place of a body in every (.., B, ..) array."""
        return _place(name, self.body_names, f"robot '{self.name}', body")

    def segment(self, body: str) -> str:
        """What a person calls a body: `left forearm`, `pelvis`; that of its nearest parent, where no landmark stands on it."""
        landmark_of = {
            b: landmark for landmark, b in reversed(list(self.profile.landmarks.items()))
        }  # torso before head
        k = self.model.body(body).id
        while k and self.model.body(k).name not in landmark_of:
            k = int(self.model.body_parentid[k])
        side, _, part = (landmark_of[self.model.body(k).name] if k else body).rpartition("_")
        return " ".join(filter(None, (side, _SEGMENT.get(part, part))))

    def landmark(self, name: str) -> int:
        """Place of the body that a landmark (pelvis, left_knee, ...) stands on."""
        return self.body(self.profile.landmarks[name])

    def landmark_pos(
        self, names: Sequence[str], body_pos_w: Float[ndarray, "*#T B 3"], body_quat_w: Float[ndarray, "*#T B 4"]
    ) -> Float[ndarray, "*#T L 3"]:
        """Where landmarks are: at their bodies' origins, or as far off as the profile's `ends` say [m]."""
        bodies = [self.landmark(name) for name in names]
        ends = np.array([self.profile.ends.get(name, (0.0, 0.0, 0.0)) for name in names])
        pos = body_pos_w[..., bodies, :]
        return np.asarray(pos + rot.rotate(body_quat_w[..., bodies, :], ends)) if ends.any() else np.asarray(pos)

    def on_its_feet(
        self, root_pos: Float[ndarray, "*#T 3"], root_quat: Float[ndarray, "*#T 4"]
    ) -> Bool[ndarray, "*#T"]:
        """Whether a pose may be of one who stands: who sits, lies or is on all fours is lower, or tilted by 73 degrees."""
        up = rot.rotate(root_quat, np.broadcast_to([0.0, 0.0, 1.0], root_pos.shape))[..., 2]
        return np.asarray((root_pos[..., 2] > 0.5 * self.default_qpos[2]) & (up > 0.3))

    @cached_property
    def hash(self) -> str:
        """SHA-256 of names, tree, axes and limits: equal hashes mean equal forward kinematics."""
        m, digest = self.model, hashlib.sha256()
        digest.update(" ".join((*self.joint_names, *self.body_names)).encode())
        for array in (m.body_parentid, m.body_pos, m.body_quat, m.jnt_axis, m.jnt_pos, m.jnt_range):
            # Rounded, so that another compiler's last bit does not make another robot; + 0.0 drops minus zeros.
            digest.update((np.round(np.asarray(array, dtype=float), 9) + 0.0).tobytes())
        return digest.hexdigest()

    def ranges(self, margin: float) -> tuple[Float[ndarray, "J"], Float[ndarray, "J"]]:
        """Position limits less a margin [rad], which is at most a tenth of a joint's range."""
        inside = np.minimum(margin, 0.1 * (self.upper - self.lower))
        return self.lower + inside, self.upper - inside

    def torque_share(self, torque: Float[ndarray, "*#T J"]) -> Float[ndarray, "*#T J"]:
        """What a joint's torque is of the most that its motors give.

        Of two joints that two motors move together (`motor_pairs`) the first has the sum of both shares: either may have
        all that the motors give, or each a half. For motors A and B on levers, tau_1 = r_1 (A + B) and tau_2 = r_2 (A - B):
        with |A| and |B| at most m, |tau_1| / (2 r_1 m) + |tau_2| / (2 r_2 m) is at most one.
        """
        return np.asarray(np.abs(torque) / self.effort @ self.sharing.T)

    @cached_property
    def sharing(self) -> Float[ndarray, "J J"]:
        """One where a joint's torque counts in the share of another's motors: in its own, and in its pair's first."""
        ones = np.eye(len(self.joint_names))
        for first, second in self.profile.motor_pairs:
            ones[self.joint(first), self.joint(second)] = 1.0
        return ones

    @cached_property
    def acceleration(self) -> Float[ndarray, "J"]:
        """What each motor can do with 0.8 of its effort against the inertia of the default pose [rad/s^2].

        The diagonal of the joint-space inertia, armature included; no more than 400, beyond which the light joints'
        numbers mean little.
        """
        import mujoco

        data, inertia = mujoco.MjData(self.model), np.zeros((self.model.nv, self.model.nv))
        data.qpos[:] = self.default_qpos
        mujoco.mj_forward(self.model, data)
        mujoco.mj_fullM(self.model, data, inertia)
        return np.minimum(0.8 * self.effort / np.diag(inertia)[6:], 400.0)

    @cached_property
    def place_of_body(self) -> Int[ndarray, "nbody"]:
        """For every body of the MuJoCo model its place in `body_names`: of the body it is fixed to; world: -1."""
        places = np.full(self.model.nbody, -1)
        own = {b: i for i, b in enumerate(self.body_ids)}
        for body in range(1, self.model.nbody):  # parents come first
            places[body] = own.get(body, places[self.model.body_parentid[body]])
        return places


def _place(name: str, names: Sequence[str], what: str) -> int:
    if name in names:
        return names.index(name)
    near = difflib.get_close_matches(name, names, n=3)
    raise RobotError(
        f"{what} '{name}'",
        found="no such name",
        expected=f"one of {', '.join(near or names)}",
        cure="check the spelling",
    )
