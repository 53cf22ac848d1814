"""MuJoCo-Warp: MuJoCo's physics on a CUDA device, thousands of worlds at once; on the CPU for tests, where it is slow.

One graph per control period: states and targets go up, the steps run, states come down. The arithmetic is single
precision: a second of dancing stays within a few micrometres of MuJoCo's.
"""

from __future__ import annotations

import copy
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from tracking.errors import TrackingError
from tracking.physics import PhysicsBatch

if TYPE_CHECKING:
    import mujoco

# What `draw_robots` draws anew for every robot; everything else is one model's for all worlds.
_DRAWN = ("geom_friction", "body_mass", "body_inertia", "body_ipos", "actuator_gainprm", "actuator_biasprm")
_PER_CONTACT = 4  # rows of a pyramidal friction cone


class WarpBatch(PhysicsBatch):
    """N robots in MuJoCo-Warp, at the step of their models.

    Args:
        models: MuJoCo models of one robot, which differ in nothing but friction, masses and gains.
        control_dt: control period [s].
        delay: as in `PhysicsBatch`.
        threads: not used.
        device: `cuda:0`, `cpu`, ...; by default a CUDA device, each process of a team its own.

    Raises:
        TrackingError: MuJoCo-Warp is not installed, or there is no CUDA device and none was named.
    """

    def __init__(
        self,
        models: Sequence[mujoco.MjModel],
        *,
        control_dt: float,
        delay: Float[ndarray, "N"] | None = None,
        threads: int = 0,
        device: str | None = None,
    ) -> None:
        import mujoco

        del threads
        super().__init__(models, control_dt=control_dt, physics_dt=models[0].opt.timestep, delay=delay)
        self._wp, self._mjw = _warp()
        self.device = self._wp.get_device(device or _cuda(self._wp))
        base, n = copy.copy(self.models[0]), self.count
        base.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)  # here nothing is ever reset
        soles = int(((base.geom_contype | base.geom_conaffinity) > 0).sum())
        rows = _PER_CONTACT * soles + 2 * base.njnt + base.nv
        with self._wp.ScopedDevice(self.device):
            self._model = self._mjw.put_model(base, batch_sizes=dict.fromkeys(_DRAWN, n))
            for name in _DRAWN:
                each = np.stack([getattr(m, name) for m in self.models]).astype(np.float32)
                getattr(self._model, name).assign(each)
            self._data = self._mjw.make_data(base, nworld=n, nconmax=soles, njmax=rows)
            self._asked = self._wp.zeros((self.substeps, n, base.nu), dtype=float)
            self._graph = self._captured()

    def _captured(self) -> Any:
        """The kernels of one control period, launched as one; None on the CPU, where they are launched one by one."""
        self._simulate()  # compiles them
        self._data.overflow.zero_()
        if not self.device.is_cuda:
            return None
        with self._wp.ScopedCapture() as capture:
            self._simulate()
        return capture.graph

    def _simulate(self) -> None:
        # As in MuJoCo's rollouts: a period depends on its state alone, so that a resumed run goes on as it would have.
        self._data.qacc_warmstart.zero_()
        for step in range(self.substeps):
            self._wp.copy(self._data.ctrl, self._asked[step])
            self._mjw.step(self._model, self._data)

    def _advance(self, targets: Float[ndarray, "N S J"]) -> None:
        with self._wp.ScopedDevice(self.device):
            self._data.qpos.assign(self.qpos.astype(np.float32))
            self._data.qvel.assign(self.qvel.astype(np.float32))
            self._asked.assign(np.ascontiguousarray(targets.swapaxes(0, 1), dtype=np.float32))
            if self._graph is None:
                self._simulate()
            else:
                self._wp.capture_launch(self._graph)
            self.qpos[:], self.qvel[:] = self._data.qpos.numpy(), self._data.qvel.numpy()
            lost = int((self._data.overflow.numpy() != 0).sum())
        self.state[:, 0] += self.substeps * self.physics_dt
        if lost:
            raise TrackingError(
                "MuJoCo-Warp", found=f"contacts or constraints that did not fit in {lost} worlds", expected="room for all",
                cure="this is a fault of tracking/warp_batch.py: its count of rows is too small for this robot",
            )  # fmt: skip


def _cuda(warp: Any) -> str:
    count = warp.get_cuda_device_count()
    if not count:
        raise TrackingError(
            "--engine warp", found="no CUDA device", expected="one", cure="train on the processor",
            option="engine", suggestion="mujoco",
        )  # fmt: skip
    return f"cuda:{int(os.environ.get('LOCAL_RANK', '0')) % count}"


def _warp() -> tuple[Any, Any]:
    try:
        import warp

        warp.config.log_level = warp.LOG_WARNING  # it would name every kernel that it loads
        import mujoco_warp
    except ImportError as e:
        raise TrackingError(
            "physics on a GPU",
            found="no MuJoCo-Warp",
            expected="it installed",
            cure="pip install 'dance-retarget[gpu]'",
        ) from e
    return warp, mujoco_warp
