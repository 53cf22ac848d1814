"""Bundles in the field's forms play the same, and policies of other tools are read by their own files."""

import dataclasses

import numpy as np
import pytest

pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")

import mujoco
import onnx
import yaml
from damage import read_shared
from onnx import TensorProto, helper, numpy_helper

from clips import cut, full_qpos, load_reference, make_reference, resample
from robot_models import load_robot
from tracking import Measurement, TaskConfig, TrackingError, TrackingTask, evaluate, evaluation_task, load_bundle
from tracking.policy.bundle import SHIPPED
from tracking.policy.gains import with_gains
from tracking.policy.policy_export import write_beyondmimic, write_unitree
from tracking.policy.readers import read_beyondmimic, read_unitree


@pytest.fixture(scope="module")
def g1():
    return load_robot("g1")


@pytest.fixture(scope="module")
def reference(g1):
    return load_reference(SHIPPED / "groove-g1" / "reference.npz", g1)


def wandering(bundle, rng, frames):
    """Measurements somewhere near the motion."""
    motion = bundle.runner.motion
    for k in range(frames):
        joints = motion.joint_pos[k] + 0.05 * rng.normal(size=motion.joint_pos.shape[1])
        yield Measurement(
            quat=motion.root_quat[k][None], gyro=rng.normal(size=(1, 3)), joint_pos=joints[None],
            joint_vel=rng.normal(size=(1, len(joints))),
        )  # fmt: skip


@pytest.mark.parametrize("name", ["groove-dancer", "groove-g1"])
def test_a_bundle_in_beyondmimics_form_asks_for_the_same_targets(name, tmp_path, rng):
    ours = load_bundle(SHIPPED / name)
    write_beyondmimic(tmp_path / "policy.onnx", ours)
    theirs = load_bundle(tmp_path / "policy.onnx", robot=ours.robot.name)
    assert [row.kind for row in theirs.contract.observation] == [
        "command", "anchor_orientation", "gyro", "joint_pos", "joint_vel", "last_action"
    ]  # fmt: skip
    np.testing.assert_allclose(theirs.reference.joint_pos, ours.reference.joint_pos, atol=1e-6)
    for k, now in enumerate(wandering(ours, rng, 40)):
        if k == 0:
            ours.runner.start(now, 0)
            theirs.runner.start(now, 0)
        np.testing.assert_allclose(theirs.runner.act(now), ours.runner.act(now), atol=1e-5)


def network(path, size, joints, seed=0, motion=None, metadata=None):
    """A linear policy: actions = obs @ weights."""
    weights = (0.1 * np.random.default_rng(seed).normal(size=(size, joints))).astype(np.float32)
    nodes = [helper.make_node("MatMul", ["obs", "weights"], ["actions"])]
    constants, outputs = {"weights": weights}, {"actions": [1, joints]}
    inputs = [helper.make_tensor_value_info("obs", TensorProto.FLOAT, [1, size])]
    if motion is not None:
        last = len(motion["joint_pos"]) - 1
        inputs.append(helper.make_tensor_value_info("time_step", TensorProto.FLOAT, [1, 1]))
        constants |= {"one": np.array([1]), "last": np.array([last])}
        nodes += [
            helper.make_node("Cast", ["time_step"], ["t1"], to=7),
            helper.make_node("Reshape", ["t1", "one"], ["t2"]),
            helper.make_node("Min", ["t2", "last"], ["t"]),
        ]
        for name, values in motion.items():
            constants[f"motion/{name}"] = values.astype(np.float32)
            outputs[name] = [1, *values.shape[1:]]
            nodes.append(helper.make_node("Gather", [f"motion/{name}", "t"], [name], axis=0))
    graph = helper.make_graph(
        nodes, "g", inputs,
        [helper.make_tensor_value_info(k, TensorProto.FLOAT, shape) for k, shape in outputs.items()],
        [numpy_helper.from_array(v, k) for k, v in constants.items()],
    )  # fmt: skip
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=9)
    helper.set_model_props(model, metadata or {})
    onnx.save(model, str(path))
    return weights


def isaac_order(robot):
    """Breadth first, as Isaac Sim has it."""
    m, depth = robot.model, {}
    for b in range(1, m.nbody):
        depth[b] = depth.get(int(m.body_parentid[b]), 0) + 1
    joints = [(depth[int(m.jnt_bodyid[1 + i])], i) for i in range(len(robot.joint_names))]
    return [i for _, i in sorted(joints)]


WITH_STATE = tuple(
    [
        "command",
        "motion_anchor_pos_b",
        "motion_anchor_ori_b",
        "base_lin_vel",
        "base_ang_vel",
        "joint_pos",
        "joint_vel",
        "actions",
    ]
)
WITHOUT = tuple(n for n in WITH_STATE if n not in ("motion_anchor_pos_b", "base_lin_vel"))


def beyondmimic(path, robot, reference, terms=WITH_STATE, **changes):
    order = isaac_order(robot)
    tracked = [reference.body_names.index(n) for n in robot.profile.tracked]
    motion = {
        "joint_pos": reference.joint_pos[:, order],
        "joint_vel": reference.joint_vel[:, order],
        "body_pos_w": reference.body_pos_w[:, tracked],
        "body_quat_w": reference.body_quat_w[:, tracked],
    }

    def three(values):
        return ",".join(f"{v:.3f}" for v in values)

    metadata = {
        "joint_names": ",".join(robot.joint_names[i] for i in order),
        "joint_stiffness": three(robot.kp[order]),
        "joint_damping": three(robot.kd[order]),
        "default_joint_pos": three(robot.default_joint_pos[order]),
        "action_scale": three(0.25 * robot.effort[order] / robot.kp[order]),
        "observation_names": ",".join(terms),
        "anchor_body_name": "torso_link",
        "body_names": ",".join(robot.profile.tracked),
    } | changes
    size = {"command": 58, "motion_anchor_pos_b": 3, "motion_anchor_ori_b": 6, "base_lin_vel": 3, "base_ang_vel": 3}
    total = sum(size.get(t, 29) for t in terms)
    weights = network(path, total, 29, motion=motion, metadata={k: v for k, v in metadata.items() if v is not None})
    return order, weights, total


@pytest.mark.parametrize("terms", [WITH_STATE, WITHOUT], ids=["160", "154"])
def test_a_beyondmimic_policy_sees_what_its_trainer_would_show_it(tmp_path, g1, reference, terms):
    order, weights, total = beyondmimic(tmp_path / "p.onnx", g1, reference, terms)
    assert total == {8: 160, 6: 154}[len(terms)]
    runner, inside = read_beyondmimic(tmp_path / "p.onnx", g1)
    np.testing.assert_allclose(inside.joint_pos, reference.joint_pos, atol=1e-6)
    robot = with_gains(g1, runner.contract)
    np.testing.assert_allclose(robot.kp[order], runner.contract.kp)
    config = dataclasses.replace(evaluation_task(TaskConfig(), randomised=False))
    task = TrackingTask(robot=robot, reference=reference, envs=3, config=config, threads=1)
    task.reset(np.arange(3), np.full(3, 50))
    now = task.measured(noisy=False).picked(np.array(order))
    runner.start(now, 50)
    targets = runner.act(now)
    # By MuJoCo, not by the runner's own kinematics.
    default = np.round(g1.default_joint_pos[order], 3)
    for k in range(3):
        data = mujoco.MjData(g1.model)
        data.qpos[:], data.qvel[:] = task.physics.qpos[k], task.physics.qvel[k]
        mujoco.mj_forward(g1.model, data)
        torso, pelvis = data.body("torso_link"), data.body(g1.body_names[0])
        r, heading = torso.xmat.reshape(3, 3), np.zeros(9)
        mujoco.mju_quat2Mat(heading, runner.heading[k])
        heading, wanted = heading.reshape(3, 3), np.zeros(9)
        at = reference.body_names.index("torso_link")
        mujoco.mju_quat2Mat(wanted, reference.body_quat_w[50, at])
        off = reference.body_pos_w[50, at] - reference.body_pos_w[50, 0]
        there = heading @ off + np.array([*pelvis.xpos[:2], reference.body_pos_w[50, 0, 2]])
        base = pelvis.xmat.reshape(3, 3)
        parts = {
            "command": np.concatenate((reference.joint_pos[50, order], reference.joint_vel[50, order])),
            "motion_anchor_pos_b": r.T @ (there - torso.xpos),
            "motion_anchor_ori_b": (r.T @ heading @ wanted.reshape(3, 3))[:, :2].reshape(6),
            "base_lin_vel": base.T @ data.qvel[:3],
            "base_ang_vel": data.qvel[3:6],
            "joint_pos": data.qpos[7:][order] - default,
            "joint_vel": data.qvel[6:][order],
            "actions": np.zeros(29),
        }
        seen = np.concatenate([parts[t] for t in terms])
        np.testing.assert_allclose(runner.seen[k], seen, atol=2e-5)
        np.testing.assert_allclose(runner.last_action[k], seen @ weights, atol=1e-4)
        scale = np.round(0.25 * g1.effort[order] / g1.kp[order], 3)
        asked = np.clip(default + scale * (seen @ weights), runner.contract.target_lower, runner.contract.target_upper)
        np.testing.assert_allclose(targets[k], asked, atol=1e-4)
    task.close()


def test_a_foreign_policy_is_played_and_judged(tmp_path, g1, reference):
    beyondmimic(tmp_path / "p.onnx", g1, reference)
    bundle = load_bundle(tmp_path / "p.onnx")
    result = evaluate(
        bundle.runner, bundle.robot, bundle.reference, evaluation_task(TaskConfig()), rollouts=3, threads=1
    )
    assert 0.0 < result.survived_s < 5.0  # random weights fall, and the run says when


def test_histories_stand_oldest_first(tmp_path, g1, reference, rng):
    lengths = ",".join(["1", "1", "3", "1", "1", "2"])
    order = isaac_order(g1)
    terms = ("command", "motion_anchor_ori_b", "base_ang_vel", "joint_pos", "joint_vel", "actions")
    path = tmp_path / "p.onnx"
    with pytest.raises(TrackingError, match="189"):  # a network for 154 numbers does not take 154 + 6 + 29
        beyondmimic(path, g1, reference, terms, observation_history_lengths=lengths)
        read_beyondmimic(path, g1)
    beyondmimic(path, g1, reference, terms)
    model = onnx.load(str(path))
    network(path, 189, 29, motion={
        i.name.removeprefix("motion/"): numpy_helper.to_array(i) for i in model.graph.initializer if i.name.startswith("motion/")
    }, metadata={p.key: p.value for p in model.metadata_props} | {"observation_history_lengths": lengths})  # fmt: skip
    runner, _ = read_beyondmimic(path, g1)
    spins = rng.normal(size=(4, 3))
    for k, spin in enumerate(spins):
        now = Measurement(
            quat=np.array([[1.0, 0, 0, 0]]), gyro=spin[None], joint_pos=np.zeros((1, 29)), joint_vel=np.zeros((1, 29))
        )
        if k == 0:
            runner.start(now, 0)
        before = runner.actions[:]
        runner.act(now)
    np.testing.assert_allclose(runner.seen[0, 64:73], spins[1:].reshape(9), atol=1e-6)
    np.testing.assert_allclose(runner.seen[0, -58:], np.concatenate((before[1][0], before[0][0])), atol=1e-6)
    assert len(order) == 29


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"joint_names": None}, "BeyondMimic's metadata"),
        ({"observation_names": "command,joint_pos,wind"}, "wind"),
        ({"observation_names": ",".join(WITHOUT)}, "do not run it"),
        ({"observation_history_lengths": "1,2"}, "8 numbers from 1 on"),
        ({"joint_stiffness": "1,2,3"}, "one per joint"),
        ({"joint_damping": "a,b"}, "joint_damping"),
        ({"anchor_body_name": "head_link"}, "head_link"),
        ({"joint_names": ",".join(f"j{i}" for i in range(29))}, "joints of g1"),
    ],
)
def test_metadata_that_do_not_fit_are_refused_by_name(tmp_path, g1, reference, changes, said):
    beyondmimic(tmp_path / "p.onnx", g1, reference, **changes)
    with pytest.raises(Exception, match=said) as caught:
        read_beyondmimic(tmp_path / "p.onnx", g1)
    assert type(caught.value).__name__ in ("TrackingError", "RobotError")


SIDES = {"left": "right", "right": "left"}


def other_side(names, only=""):
    return ["_".join(SIDES.get(w, w) for w in n.split("_")) if only in n else n for n in names]


@pytest.fixture(params=["sample dance", "csv/g1moves/M_Move5.csv", "pkl/twist2_yanjie_walk_001.pkl"])
def moved(request, g1, reference):
    """References of three motions: ours, and two of others as they stand in their files."""
    if request.param == "sample dance":
        return reference
    clip = resample(cut(read_shared(request.getfixturevalue("shared"), request.param), 4.0, 9.0), 50.0)
    frames = clip.frames
    return make_reference(
        g1,
        full_qpos(clip, g1),
        50.0,
        contact=np.zeros((frames, 4), dtype=int),
        segments=np.array([[0, frames, 0]]),
        meta={},
    )


@pytest.mark.parametrize(
    ("told", "fits"),
    [
        ("joints in MuJoCo's order", "joint names in Isaac's breadth-first order"),
        ("joints with their sides exchanged", "joint names with left and right exchanged"),
        ("bodies with their sides exchanged", "body names with left and right exchanged"),
        ("arms of the bodies exchanged", ""),
        ("arms of the joints exchanged", ""),
        ("hips rolled by one", ""),
    ],
)
def test_names_that_the_motion_inside_contradicts_are_refused_with_the_order_that_fits(tmp_path, g1, moved, told, fits):
    joints = [g1.joint_names[i] for i in isaac_order(g1)]
    bodies = list(g1.profile.tracked)
    hips = [n for n in joints if n.startswith("left_hip")]
    changes = {
        "joints in MuJoCo's order": {"joint_names": ",".join(g1.joint_names)},
        "joints with their sides exchanged": {"joint_names": ",".join(other_side(joints))},
        "bodies with their sides exchanged": {"body_names": ",".join(other_side(bodies))},
        "arms of the bodies exchanged": {"body_names": ",".join(other_side(bodies, "shoulder"))},
        "arms of the joints exchanged": {"joint_names": ",".join(other_side(joints, "elbow"))},
        "hips rolled by one": {
            "joint_names": ",".join(dict(zip(hips, hips[1:] + hips[:1], strict=True)).get(n, n) for n in joints)
        },
    }[told]
    beyondmimic(tmp_path / "p.onnx", g1, moved)
    read_beyondmimic(tmp_path / "p.onnx", g1)
    beyondmimic(tmp_path / "p.onnx", g1, moved, **changes)
    with pytest.raises(TrackingError, match=f"away from where it says they are.*{fits}"):
        read_beyondmimic(tmp_path / "p.onnx", g1)


def test_an_anchor_that_is_not_named_is_told(tmp_path, g1, reference):
    beyondmimic(tmp_path / "p.onnx", g1, reference, anchor_body_name=None)
    runner, _ = read_beyondmimic(tmp_path / "p.onnx", g1)
    assert "names no anchor_body_name; torso_link is assumed" in runner.contract.source


def unitree(folder, robot, joints=None, **changes):
    ids = isaac_order(robot) if joints is None else joints
    n = len(ids)
    rest = [float(robot.default_joint_pos[i]) for i in ids]
    told = {
        "joint_ids_map": ids,
        "step_dt": 0.02,
        "stiffness": robot.kp.tolist() if n == 29 else [float(robot.kp[i]) for i in sorted(ids)],
        "damping": robot.kd.tolist() if n == 29 else [float(robot.kd[i]) for i in sorted(ids)],
        "default_joint_pos": rest,
        "commands": {},
        "actions": {"JointPositionAction": {"clip": None, "scale": [0.4] * n, "offset": rest}},
        "observations": {
            name: {"params": {}, "clip": None, "scale": [scale] * size, "history_length": 1}
            for name, size, scale in (
                ("motion_command", 2 * n, 1.0), ("motion_anchor_ori_b", 6, 1.0), ("base_ang_vel", 3, 0.2),
                ("joint_pos_rel", n, 1.0), ("joint_vel_rel", n, 0.05), ("last_action", n, 1.0),
            )
        },
    } | changes  # fmt: skip
    (folder / "params").mkdir(parents=True, exist_ok=True)
    (folder / "exported").mkdir(exist_ok=True)
    (folder / "params" / "deploy.yaml").write_text(yaml.safe_dump(told, sort_keys=False))
    network(folder / "exported" / "policy.onnx", 5 * n + 9, n)
    return ids


@pytest.mark.parametrize("count", [29, 23])
def test_unitrees_deploy_yaml_is_read_with_gains_by_motor_and_all_else_by_policy(tmp_path, g1, reference, rng, count):
    absent = {"waist_roll_joint", "waist_pitch_joint"} | {
        n for n in g1.joint_names if "wrist_pitch" in n or "wrist_yaw" in n
    }
    ids = [i for i in isaac_order(g1) if count == 29 or g1.joint_names[i] not in absent]
    unitree(tmp_path, g1, ids)
    bundle = load_bundle(tmp_path, reference=SHIPPED / "groove-g1" / "reference.npz")
    assert len(bundle.contract.joint_names) == len(ids) == count
    np.testing.assert_allclose(bundle.contract.kp, g1.kp[ids])
    np.testing.assert_allclose(bundle.contract.default_joint_pos, g1.default_joint_pos[ids])
    joints = 0.1 * rng.normal(size=29)
    now = Measurement(
        quat=np.array([[1.0, 0, 0, 0]]),
        gyro=np.ones((1, 3)),
        joint_pos=joints[None, ids],
        joint_vel=np.ones((1, count)),
    )
    bundle.runner.start(now, 7)
    bundle.runner.act(now)
    seen = bundle.runner.seen[0]
    np.testing.assert_allclose(seen[:count], reference.joint_pos[7, ids], atol=1e-6)
    np.testing.assert_allclose(seen[2 * count + 6 : 2 * count + 9], 0.2)
    np.testing.assert_allclose(seen[2 * count + 9 : 3 * count + 9], joints[ids] - g1.default_joint_pos[ids], atol=1e-6)
    np.testing.assert_allclose(seen[3 * count + 9 : 4 * count + 9], 0.05)
    result = evaluate(
        bundle.runner, bundle.robot, bundle.reference, evaluation_task(TaskConfig()), rollouts=2, threads=1
    )
    assert result.survived_s > 0.0


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"joint_ids_map": [0] * 29}, "different motors"),
        ({"observations": {"wind": {}}}, "wind"),
        ({"observations": {"base_ang_vel": {"clip": [-1, 1]}}}, "clip"),
        ({"stiffness": None}, "deploy.yaml"),
        ({"step_dt": 0.01}, "control_dt"),
    ],
)
def test_a_deploy_yaml_that_does_not_fit_is_refused(tmp_path, g1, reference, changes, said):
    unitree(tmp_path, g1, **changes)
    with pytest.raises(TrackingError, match=said):
        read_unitree(tmp_path / "params" / "deploy.yaml", g1, reference, tmp_path / "exported" / "policy.onnx")


def test_unitrees_policy_without_a_motion_is_refused_with_the_option(tmp_path, g1):
    unitree(tmp_path, g1)
    with pytest.raises(TrackingError, match="no motion inside"):
        load_bundle(tmp_path)


def test_our_deploy_yaml_has_the_contracts_numbers(tmp_path):
    bundle = load_bundle(SHIPPED / "groove-dancer")
    write_unitree(tmp_path / "deploy.yaml", bundle)
    told = yaml.safe_load((tmp_path / "deploy.yaml").read_text())
    assert told["stiffness"] == bundle.contract.kp.tolist() and told["step_dt"] == 0.02
    assert sum(len(t["scale"]) for t in told["observations"].values()) == bundle.contract.observation_size
