"""A bundle in the field's own forms: BeyondMimic's ONNX with metadata, and Unitree's `deploy.yaml`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from clips import write_whole
from tracking.errors import TrackingError
from tracking.policy.bundle import POLICY, Bundle
from tracking.policy.contract import FROM_REFERENCE, Row
from tracking.policy.observation_terms import TERMS

# What BeyondMimic's deployers put together for a policy without state estimation, in this order.
_THEIRS = ("command", "motion_anchor_ori_b", "base_ang_vel", "joint_pos", "joint_vel", "actions")


def write_beyondmimic(path: Path, bundle: Bundle) -> None:
    """One ONNX that BeyondMimic's deployers run as one of theirs: `obs`, `time_step` in, actions and motion out.

    They add scaled actions to the default pose and show only the present frame of the motion. So the reference goes into
    the graph: the frames ahead, and the servo targets that our actions are residuals to. Joints stay in the robot's
    order, which the metadata tell.

    Raises:
        TrackingError: the policy sees something that these deployers do not give it.
    """
    import onnx
    from onnx import TensorProto, compose, helper, numpy_helper

    runner, reference = bundle.runner, bundle.reference
    graph = _Graph(frames=reference.frames, joints=len(runner.contract.joint_names))
    inner = graph.join([_part(graph, row, bundle) for row in runner.contract.observation])
    graph.add("Identity", [inner], "policy/obs")
    graph.table("prior", _prior(bundle))
    graph.add("Add", ["policy/actions", graph.row("prior", 1)], "actions")
    outputs = ["joint_pos", "joint_vel", "body_pos_w", "body_quat_w", "body_lin_vel_w", "body_ang_vel_w"]
    tracked = [reference.body_names.index(name) for name in bundle.robot.profile.tracked]
    for name in outputs:
        values = np.asarray(getattr(reference, name))
        graph.table(f"motion/{name}", values if name.startswith("joint") else values[:, tracked])
        graph.add("Identity", [graph.row(f"motion/{name}", 0)], name)
    policy = compose.add_prefix(onnx.load(str(bundle.folder / POLICY)), "policy/")
    nodes = graph.before("policy/actions") + list(policy.graph.node) + graph.after("policy/actions")
    whole = helper.make_graph(
        nodes,
        "policy",
        [
            helper.make_tensor_value_info("obs", TensorProto.FLOAT, [1, graph.size]),
            helper.make_tensor_value_info("time_step", TensorProto.FLOAT, [1, 1]),
        ],
        [
            helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, *graph.constants[table].shape[1:]])
            for name, table in (("actions", "prior"), *((name, f"motion/{name}") for name in outputs))
        ],
        [numpy_helper.from_array(v, k) for k, v in graph.constants.items()] + list(policy.graph.initializer),
    )
    model = helper.make_model(whole, opset_imports=policy.opset_import, ir_version=policy.ir_version)
    helper.set_model_props(model, _metadata(bundle))
    onnx.checker.check_model(model)
    with write_whole(path) as stream:
        stream.write(model.SerializeToString())


def write_unitree(path: Path, bundle: Bundle) -> None:
    """The bundle's numbers in the layout of unitree_rl_lab's `deploy.yaml`, at full precision.

    Its observations keep our names: a deployer has to register the ones that Unitree's does not have, those of the
    reference ahead, and to add actions to the reference's servo targets; `target` says so.
    """
    import yaml

    c = bundle.contract
    told: dict[str, Any] = {
        "joint_ids_map": list(range(len(c.joint_names))),
        "joint_names": list(c.joint_names),
        "step_dt": c.control_dt,
        "stiffness": c.kp.tolist(),
        "damping": c.kd.tolist(),
        "default_joint_pos": c.default_joint_pos.tolist(),
        "commands": {},
        "actions": {
            "JointPositionAction": {
                "clip": None, "joint_names": [".*"], "scale": c.action_scale.tolist(),
                "offset": c.default_joint_pos.tolist(), "joint_ids": None, "target": c.target,
            }
        },
        "observations": {
            row.name: {
                "params": {"kind": row.kind, "at": row.at}, "clip": None, "scale": [row.scale] * row.size,
                "history_length": 1,
            }
            for row in c.observation
        },
    }  # fmt: skip
    with write_whole(path) as stream:
        stream.write(yaml.safe_dump(told, sort_keys=False, width=120).encode())


class _Graph:
    """ONNX nodes in the making, with the reference's tables as constants."""

    def __init__(self, frames: int, joints: int) -> None:
        self._frames, self.nodes = frames, list[Any]()
        sizes = (2 * joints, 6, 3, joints, joints, joints)
        ends = np.cumsum(sizes).tolist()
        self.size = ends[-1]
        self._slices = {n: (e - s, e) for n, s, e in zip(_THEIRS, sizes, ends, strict=True)}
        self.constants: dict[str, ndarray] = {"one-row": np.array([1]), "axis": np.array([1])}
        self.add("Cast", ["time_step"], "time/int", to=7)
        self.add("Reshape", ["time/int", "one-row"], "time")

    def add(self, kind: str, inputs: list[str], output: str, **attributes: Any) -> str:
        """A node; returns its output's name."""
        from onnx import helper

        self.nodes.append(helper.make_node(kind, inputs, [output], **attributes))
        return output

    def table(self, name: str, values: ndarray) -> None:
        """A constant by frame."""
        self.constants[name] = np.asarray(values, dtype=np.float32)

    def row(self, table: str, ahead: int) -> str:
        """The table's row some frames on; the last one holds."""
        at = f"time+{ahead}"
        if not any(at in node.output for node in self.nodes):
            self.constants[f"ahead/{ahead}"] = np.array([ahead])
            self.constants["last"] = np.array([self._frames - 1])
            self.add("Add", ["time", f"ahead/{ahead}"], f"{at}/free")
            self.add("Min", [f"{at}/free", "last"], at)
        return self.add("Gather", [table, at], f"{table}@{ahead}", axis=0)

    def given(self, name: str) -> str:
        """The part of `obs` that holds one of their terms."""
        begin, end = self._slices[name]
        self.constants[f"{name}/begin"], self.constants[f"{name}/end"] = np.array([begin]), np.array([end])
        return self.add("Slice", ["obs", f"{name}/begin", f"{name}/end", "axis"], f"obs/{name}")

    def scaled(self, value: str, scale: float) -> str:
        """A value times a number."""
        self.constants[f"{value}/scale"] = np.array([scale], dtype=np.float32)
        return self.add("Mul", [value, f"{value}/scale"], f"{value}/scaled")

    def join(self, parts: list[str]) -> str:
        """Values side by side."""
        return self.add("Concat", parts, "inner", axis=1)

    def before(self, name: str) -> list[Any]:
        """Nodes that do not wait for a value."""
        late = self.after(name)
        return [node for node in self.nodes if node not in late]

    def after(self, name: str) -> list[Any]:
        """Nodes that wait for a value, directly or not."""
        waiting, late = {name}, []
        for node in self.nodes:
            if waiting & set(node.input):
                waiting |= set(node.output)
                late.append(node)
        return late


def _part(graph: _Graph, row: Row, bundle: Bundle) -> str:
    """One row of our table from what their deployers give."""
    motion, default = bundle.runner.motion, bundle.contract.default_joint_pos
    if row.kind in ("reference_joint_pos", "reference_joint_vel"):
        name = f"{row.kind}/{row.at}"
        graph.table(name, row.scale * (motion.joint_pos - default if row.kind.endswith("pos") else motion.joint_vel))
        return graph.row(name, row.at)
    if row.kind == "last_action" and row.at == 0:
        # They show the whole last action; ours is what it was beyond the prior. Before the first there was none.
        graph.table("prior-of-last", np.concatenate((np.zeros_like(_prior(bundle)[:1]), _prior(bundle)[1:])))
        return graph.add("Sub", [graph.given("actions"), graph.row("prior-of-last", 0)], "last-residual")
    given = next((alias for alias in TERMS[row.kind].aliases if alias in _THEIRS), None)
    if row.at != 0 or given is None:
        raise TrackingError(
            f"observation {row.name}", found="a term that BeyondMimic's deployers do not give",
            expected=f"of {', '.join(_THEIRS)}",
        )  # fmt: skip
    return graph.scaled(graph.given(given), row.scale)


def _prior(bundle: Bundle) -> ndarray:
    """The servo targets that our actions are residuals to, as actions of theirs."""
    c = bundle.contract
    base = bundle.runner.motion.targets if c.target == FROM_REFERENCE else c.default_joint_pos
    return np.asarray((base - c.default_joint_pos) / c.action_scale)


def _metadata(bundle: Bundle) -> dict[str, str]:
    """BeyondMimic's keys. Theirs are rounded to three decimals; these are exact."""
    c, robot = bundle.contract, bundle.robot
    lists = {
        "joint_names": c.joint_names,
        "joint_stiffness": c.kp.tolist(),
        "joint_damping": c.kd.tolist(),
        "default_joint_pos": c.default_joint_pos.tolist(),
        "command_names": ("motion",),
        "observation_names": _THEIRS,
        "observation_history_lengths": (1,) * len(_THEIRS),
        "action_scale": c.action_scale.tolist(),
        "body_names": robot.profile.tracked,
    }
    told = {name: ",".join(map(str, values)) for name, values in lists.items()}
    told |= {"run_path": "", "anchor_body_name": c.anchor, "total_time_steps": str(bundle.reference.frames)}
    return told
