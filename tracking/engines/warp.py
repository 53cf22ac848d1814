"""MuJoCo-Warp: MuJoCo's physics on a CUDA device, thousands of worlds at once; on the CPU for tests, where it is slow.

States stay on the device, as torch's tensors on the memory of warp's arrays; the task computes there too. Two graphs per
control period: the steps, and the reading of the bodies. The arithmetic is single precision: a second of dancing stays
within a few micrometres of MuJoCo's.
"""

from __future__ import annotations

import copy
import os
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models import BodyStates, RobotModel, import_or_refuse
from robot_models.maths import Array
from robot_models.maths import rotation as rot
from tracking.engines.mujoco import floor_geoms
from tracking.engines.physics import BodyReader, EngineOptions, PhysicsBatch
from tracking.engines.random import Rng, TorchRng
from tracking.errors import TrackingError

if TYPE_CHECKING:
    import mujoco

# What `draw_robots` draws anew for every robot; everything else is one model's for all worlds.
_DRAWN = ("geom_friction", "body_mass", "body_inertia", "body_ipos", "actuator_gainprm", "actuator_biasprm")
_PER_CONTACT = 4  # rows of a pyramidal friction cone
_LAST_BITS = ("ITERATIONS", "LS_ITERATIONS")  # a solver that was stopped on purpose, as MuJoCo's is: nothing is missing


class WarpBatch(PhysicsBatch):
    """N robots in MuJoCo-Warp, at the step of their models.

    Args:
        models: MuJoCo models of one robot, which differ in nothing but friction, masses and gains.
        device: `cuda:0`, `cpu`, ...; by default a CUDA device, each process of a team its own.
        options: as in `PhysicsBatch`; threads are not used.

    Raises:
        TrackingError: MuJoCo-Warp is not installed, or there is no CUDA device and none was named.
    """

    def __init__(
        self, models: Sequence[mujoco.MjModel], *, device: str | None = None, **options: Unpack[EngineOptions]
    ) -> None:
        import mujoco
        import torch

        self._torch, (self._wp, self._mjw) = torch, _warp()
        self._on = self._wp.get_device(device or _cuda(self._wp))
        self.device = str(self._wp.device_to_torch(self._on))
        super().__init__(models, physics_dt=models[0].opt.timestep, **options)
        base, n = copy.copy(self.models[0]), self.count
        base.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)  # here nothing is ever reset
        contacts = _most_contacts(base)
        rows = _PER_CONTACT * contacts + 2 * base.njnt + base.nv
        with self._wp.ScopedDevice(self._on):
            self._model = self._mjw.put_model(base, batch_sizes=dict.fromkeys(_DRAWN, n))
            kinds = self._mjw.OverflowType
            self._missing = int(kinds.ALL) & ~sum(int(kinds[name]) for name in _LAST_BITS)
            self._model.opt.warn_overflow = self._missing
            self._model.opt.graph_conditional = self._wp.is_conditional_graph_supported()
            for name in _DRAWN:
                each = np.stack([getattr(m, name) for m in self.models]).astype(np.float32)
                getattr(self._model, name).assign(each)
            self._data = self._mjw.make_data(base, nworld=n, nconmax=contacts, njmax=rows)
            self._asked = self._wp.zeros((self.substeps, n, base.nu), dtype=float)
        names = ("qpos", "qvel", "xpos", "xquat", "cvel", "subtree_com", "overflow")
        self.tensors = {name: self._wp.to_torch(getattr(self._data, name)) for name in names}
        self._targets = self._wp.to_torch(self._asked)
        self._simulated, self._placed = self._launcher(self._simulate), self._launcher(self._place)
        self.tensors["overflow"].zero_()

    def to_device(self, values: ndarray) -> Array:
        """The values as a tensor on the device, in single precision if they are real numbers."""
        precision = self._torch.float32 if np.issubdtype(values.dtype, np.floating) else None
        return self._torch.asarray(values, device=self.device, dtype=precision)

    def make_rng(self, rng: np.random.Generator) -> Rng:
        """A generator on the device."""
        return TorchRng(int(rng.integers(2**31)), self._torch.device(self.device))

    def body_sensors(self, robot: RobotModel, bodies: list[int], threads: int) -> BodyReader:
        """The bodies as the engine places them."""
        del threads  # the GPU has its own
        return _Bodies(self, [robot.body_ids[b] for b in bodies])

    def _launcher(self, kernels: Callable[[], None]) -> Callable[[], None]:
        """Some kernels as one graph, launched in torch's order of work; on the CPU they are launched one by one."""

        def one_by_one() -> None:
            with self._wp.ScopedDevice(self._on):
                kernels()

        one_by_one()  # compiles them
        if not self._on.is_cuda:
            return one_by_one
        with self._wp.ScopedDevice(self._on), self._wp.ScopedCapture() as capture:
            kernels()
        self._wp.synchronize_device(self._on)

        def as_graph() -> None:
            stream = self._wp.stream_from_torch(self._torch.cuda.current_stream(self.device))
            self._wp.capture_launch(capture.graph, stream=stream)

        return as_graph

    def place_bodies(self) -> None:
        """Let `tensors` tell where the bodies are and how they move in the present state."""
        self._put()
        self._placed()

    def _simulate(self) -> None:
        # As in MuJoCo's rollouts: a period depends on its state alone, so that a resumed run goes on as it would have.
        self._data.qacc_warmstart.zero_()
        for step in range(self.substeps):
            self._wp.copy(self._data.ctrl, self._asked[step])
            self._mjw.step(self._model, self._data)

    def _place(self) -> None:
        self._mjw.kinematics(self._model, self._data)
        self._mjw.com_pos(self._model, self._data)
        self._mjw.com_vel(self._model, self._data)

    def _put(self) -> None:
        self.tensors["qpos"][:], self.tensors["qvel"][:] = self.qpos, self.qvel

    def _advance(self, targets: Float[Array, "N S J"]) -> None:
        self._put()
        self._targets[:] = targets.swapaxes(0, 1)
        self._simulated()
        self.qpos[:], self.qvel[:] = self.tensors["qpos"], self.tensors["qvel"]
        self.state[:, 0] += self.substeps * self.physics_dt
        lost = int(((self.tensors["overflow"] & self._missing) != 0).sum())
        if lost:
            raise TrackingError(
                "MuJoCo-Warp", found=f"contacts or constraints that did not fit in {lost} worlds", expected="room for all",
                cure="this is a fault of tracking/engines/warp.py: its count of rows is too small for this robot",
            )  # fmt: skip


def _most_contacts(model: mujoco.MjModel) -> int:
    """With the floor, of a robot that lies on it with all it has: ends of capsules, corners of boxes."""
    import mujoco

    kind = mujoco.mjtGeom
    several = {kind.mjGEOM_CAPSULE: 2, kind.mjGEOM_BOX: 4, kind.mjGEOM_CYLINDER: 4}
    return sum(several.get(kind(int(model.geom_type[g])), 1) for g in floor_geoms(model))


class _Bodies:
    """What `BodySensors` are, of the worlds in a `WarpBatch`: always of its present state, and of all of them."""

    def __init__(self, batch: WarpBatch, body_ids: list[int]) -> None:
        self._batch, self._bodies = batch, batch.to_device(np.array(body_ids))
        self._roots = batch.to_device(batch.models[0].body_rootid[body_ids])
        batch.place_bodies()

    @property
    def states(self) -> BodyStates:
        """World poses and velocities as they were last read."""
        told = self._batch.tensors
        pos, velocity = told["xpos"][:, self._bodies], told["cvel"][:, self._bodies]
        ang_vel, at_centre = velocity[..., :3], velocity[..., 3:]
        # MuJoCo's cvel is the velocity of the point of the body that is at the whole robot's centre of mass.
        arm = pos - told["subtree_com"][:, self._roots]
        return BodyStates(
            pos=pos,
            quat=told["xquat"][:, self._bodies],
            lin_vel=at_centre + rot.cross(ang_vel, arm),
            ang_vel=ang_vel,
        )

    def read(self, state: Array) -> None:
        """Read the bodies of all robots."""
        del state  # the engine holds it
        self._batch.place_bodies()

    def read_some(self, ids: Array, state: Array) -> None:
        """The same: a graph of all robots is launched as quickly as of some."""
        del ids, state
        self._batch.place_bodies()

    def close(self) -> None:
        """Nothing is running."""


def _cuda(warp: Any) -> str:
    import torch

    count = warp.get_cuda_device_count()
    if not count:
        raise TrackingError(
            "MuJoCo-Warp", found="no CUDA device", expected="one", cure="train on the processor",
            option="engine", suggestion="mujoco",
        )  # fmt: skip
    if not torch.cuda.is_available():
        raise TrackingError(
            "MuJoCo-Warp", found=f"torch {torch.__version__}, which was built for the processor", expected="CUDA's torch",
            cure="install torch with CUDA (pytorch.org says how), or train on the processor",
            option="engine", suggestion="mujoco",
        )  # fmt: skip
    return f"cuda:{int(os.environ.get('LOCAL_RANK', '0')) % count}"


def _warp() -> tuple[Any, Any]:
    cure = "pip install 'dance-retarget[gpu]'"
    refusal = TrackingError("physics on a GPU", found="no MuJoCo-Warp", expected="it installed", cure=cure)
    warp = import_or_refuse("warp", refusal)
    warp.config.log_level = warp.LOG_WARNING  # it would name every kernel that it loads
    return warp, import_or_refuse("mujoco_warp", refusal)
