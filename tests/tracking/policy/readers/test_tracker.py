"""Trackers by their contracts: what each input is, what the output means, whose gains; and what is refused."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")

import onnx
from onnx import TensorProto, helper, numpy_helper

from clips import load_reference
from robot_models import load_robot
from robot_models.maths import rotation as rot
from tracking import Measurement, TaskConfig, TrackingError, evaluate, evaluation_task, load_bundle
from tracking.policy.bundle import SHIPPED

REFERENCE = SHIPPED / "groove-g1" / "reference.npz"
CONTRACT = """
name = "told"
control_hz = 50
output = "targets"
input = [
  { name = "turns", shape = [2, 4], rows = [{ kind = "anchor_quat_xyzw" }, { kind = "reference_anchor_quat_xyzw", at = 4 }] },
  { name = "joints", shape = [58], rows = [{ groups = ["now"] }] },
]
[group]
now = [{ kind = "encoders" }, { kind = "joint_vel", scale = 0.5, zero = [".*_ankle_.*"] }]
[action]
adds_to = "target"
"""


@pytest.fixture(scope="module")
def g1():
    return load_robot("g1")


@pytest.fixture(scope="module")
def reference(g1):
    return load_reference(REFERENCE, g1)


def network(path, *, batch=1):
    """Two inputs; the first 29 of the second are the output, plus a hundredth of the first's sum."""
    nodes = [
        helper.make_node("Slice", ["joints", "zero", "end", "one"], ["encoders"]),
        helper.make_node("ReduceSum", ["turns", "axes"], ["sum"], keepdims=0),
        helper.make_node("Unsqueeze", ["sum", "one"], ["column"]),
        helper.make_node("Mul", ["column", "small"], ["little"]),
        helper.make_node("Add", ["encoders", "little"], ["targets"]),
    ]
    constants = {"zero": [0], "end": [29], "one": [1], "axes": [1, 2]}
    graph = helper.make_graph(
        nodes, "g",
        [
            helper.make_tensor_value_info("turns", TensorProto.FLOAT, [batch, 2, 4]),
            helper.make_tensor_value_info("joints", TensorProto.FLOAT, [batch, 58]),
        ],
        [helper.make_tensor_value_info("targets", TensorProto.FLOAT, [batch, 29])],
        [numpy_helper.from_array(np.array(v), k) for k, v in constants.items()]
        + [numpy_helper.from_array(np.float32(0.01), "small")],
    )  # fmt: skip
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=9), str(path))
    return path


def told(tmp_path, text=CONTRACT, **changes):
    path = network(tmp_path / "told.onnx", **changes)
    path.with_suffix(".toml").write_text(text, encoding="utf-8")
    return path


def somewhere(runner, rng, n=3):
    motion = runner.motion
    return Measurement(
        quat=rot.multiply(rot.from_yaw(np.array([0.0, 1.0, -2.0])[:n]), np.tile(motion.root_quat[motion.start], (n, 1))),
        gyro=rng.normal(size=(n, 3)), joint_pos=rng.normal(size=(n, 29)), joint_vel=rng.normal(size=(n, 29)),
    )  # fmt: skip


@pytest.mark.parametrize("batch", [1, "n"])
def test_inputs_are_what_the_contract_says_and_the_output_is_the_target(tmp_path, rng, batch):
    runner = load_bundle(told(tmp_path, batch=batch), reference=REFERENCE).runner
    now = somewhere(runner, rng)
    runner.start(now)
    target = runner.act(now)
    seen, motion = runner.seen, runner.motion
    turned = rot.multiply(runner.heading, np.tile(motion.anchor_quat[motion.start + 4], (3, 1)))
    np.testing.assert_allclose(seen[:, 4:8], rot.to_quat_xyzw(turned), atol=1e-6)
    np.testing.assert_allclose(seen[:, 8:37], now.joint_pos, atol=1e-6)
    ankles = ["_ankle_" in name for name in runner.contract.joint_names]
    np.testing.assert_allclose(seen[:, 37:], np.where(ankles, 0.0, 0.5 * now.joint_vel), atol=1e-6)
    c, asked = runner.contract, now.joint_pos + 0.01 * seen[:, :8].sum(axis=1, keepdims=True)
    np.testing.assert_allclose(target, np.clip(asked, c.target_lower, c.target_upper), atol=1e-5)


def test_one_robot_that_begins_anew_does_not_disturb_the_others(tmp_path, rng):
    runner = load_bundle(told(tmp_path), reference=REFERENCE).runner
    now, other = somewhere(runner, rng), somewhere(runner, rng)
    runner.start(now)
    runner.act(now)
    before = (runner.frame.copy(), runner.heading.copy())
    runner.restart(np.array([1]), other.of(np.array([1])), np.array([77]))
    assert runner.frame.tolist() == [before[0][0], 77, before[0][2]]
    np.testing.assert_array_equal(runner.heading[[0, 2]], before[1][[0, 2]])
    assert (runner.actions[0][1] == 0.0).all()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("encoders", "wishes", "no such term"),
        ("shape = [58]", "shape = [57]", "58 numbers"),
        ('"targets"', '"answers"', "one of targets"),
        ('adds_to = "target"', 'adds_to = "hope"', "adds_to of default or target"),
        ('adds_to = "target"', "adds_to = { a = 1 }", "adds_to of default or target"),
        ('adds_to = "target"', 'adds_to = ["target"]', "adds_to of default or target"),
        ("control_hz = 50", "", "control_hz"),
        ("[action]", "[action", "TOML"),
    ],
)
def test_a_contract_that_does_not_fit_is_refused_by_what_is_wrong(tmp_path, old, new, said):
    with pytest.raises(TrackingError, match=said):
        load_bundle(told(tmp_path, CONTRACT.replace(old, new)), reference=REFERENCE)


def test_a_tracker_needs_a_reference_and_a_network_a_contract(tmp_path):
    with pytest.raises(TrackingError, match="follows any reference") as refusal:
        load_bundle(told(tmp_path))
    assert refusal.value.option == "ref"
    told(tmp_path).with_suffix(".toml").unlink()
    with pytest.raises(TrackingError, match="contract|metadata"):
        load_bundle(tmp_path / "told.onnx", reference=REFERENCE)


@pytest.fixture
def twist2(shared):
    path = shared.parent / "policies" / "twist2_1017_20k.onnx"
    if not path.is_file():
        pytest.skip("the shared policies are not on this machine")
    return path


def test_twist2_is_known_by_its_inputs_and_dances_on_its_own_gains(twist2):
    tracker = load_bundle(twist2, reference=REFERENCE)
    assert tracker.contract.source.endswith("(TWIST2)") and tracker.contract.observation_size == 1432
    knee = tracker.robot.joint("left_knee_joint")
    assert (tracker.robot.kp[knee], tracker.robot.kd[knee]) == (150.0, 4.0)
    result = evaluate(
        tracker.runner, tracker.robot, tracker.reference, evaluation_task(TaskConfig()), rollouts=4, threads=1
    )
    assert result.stood == 1.0 and result.body_error_mm < 60.0


def test_twist2_on_other_gains_falls(twist2, g1, reference):
    """The negative control: gains belong to the policy."""
    tracker = load_bundle(twist2, reference=REFERENCE)
    result = evaluate(tracker.runner, g1, reference, evaluation_task(TaskConfig()), rollouts=4, threads=1)
    assert result.stood < 0.5


def test_the_past_of_a_tracker_is_what_it_saw_then(twist2, rng):
    """1432 = now, ten times before (oldest first), the reference once more."""
    runner = load_bundle(twist2, reference=REFERENCE).runner
    shown, now = [], somewhere(runner, rng, 2)
    runner.start(now)
    for _ in range(12):
        runner.act(now)
        shown.append(runner.seen[:, :127].copy())
        now = somewhere(runner, rng, 2)
    seen = runner.seen
    np.testing.assert_array_equal(seen[:, -35:], seen[:, :35])
    np.testing.assert_allclose(seen[:, 127:-35].reshape(2, 10, 127), np.stack(shown[-11:-1], axis=1), atol=1e-6)


def test_the_contract_in_the_docs_is_one(tmp_path):
    text = (Path(__file__).parents[4] / "docs" / "trackers.md").read_text(encoding="utf-8")
    contract = text.split("```toml\n")[1].split("```")[0]
    inputs = [
        helper.make_tensor_value_info(n, TensorProto.FLOAT, ["n", *s])
        for n, s in (("current", [1, 62]), ("future", [4, 33]))
    ]
    nodes = [
        helper.make_node("Gather", ["future", "third"], ["frame"], axis=1),
        helper.make_node("Slice", ["frame", "four", "end", "one"], ["joint_pos_targets"]),
    ]
    constants = {"third": 2, "four": [4], "end": [33], "one": [1]}
    output = helper.make_tensor_value_info("joint_pos_targets", TensorProto.FLOAT, ["n", 29])
    initialisers = [numpy_helper.from_array(np.array(v), k) for k, v in constants.items()]
    graph = helper.make_graph(nodes, "g", [*inputs], [output], initialisers)
    path = tmp_path / "mine.onnx"
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=9), str(path))
    path.with_suffix(".toml").write_text(contract, encoding="utf-8")
    runner = load_bundle(path, reference=REFERENCE).runner
    now = runner.motion
    measured = Measurement(
        quat=now.root_quat[[40]], gyro=np.zeros((1, 3)), joint_pos=now.joint_pos[[40]], joint_vel=np.zeros((1, 29))
    )
    runner.start(measured, 40)
    # The network picks the third of the four frames ahead: the target is the reference four frames on.
    np.testing.assert_allclose(runner.act(measured), now.joint_pos[[44]], atol=1e-6)


def test_protomotions_is_known_by_its_inputs(tmp_path):
    """A network of its interface, whose targets are the reference's joints four frames on."""
    shapes = {
        "current_anchor_rot": [4], "current_dof_pos": [29], "current_dof_vel": [29], "current_root_local_ang_vel": [3],
        "historical_processed_actions": [1, 29], "mimic_future_anchor_rot": [4, 4], "mimic_future_dof_pos": [4, 29],
        "mimic_future_dof_vel": [4, 29],
    }  # fmt: skip
    nodes = [
        helper.make_node("Gather", ["mimic_future_dof_pos", "third"], ["joint_pos_targets"], axis=1),
        *(helper.make_node("Identity", [name], [f"same/{name}"]) for name in shapes),
    ]
    graph = helper.make_graph(
        nodes, "g", [helper.make_tensor_value_info(n, TensorProto.FLOAT, [1, *s]) for n, s in shapes.items()],
        [helper.make_tensor_value_info("joint_pos_targets", TensorProto.FLOAT, [1, 29])],
        [numpy_helper.from_array(np.array(2), "third")],
    )  # fmt: skip
    path = tmp_path / "unified_pipeline.onnx"
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=9), str(path))
    bundle = load_bundle(path, reference=REFERENCE)
    assert bundle.contract.source.endswith("(ProtoMotions)")
    motion, now = bundle.runner.motion, somewhere(bundle.runner, np.random.default_rng(0))
    bundle.runner.start(now, 50)
    np.testing.assert_allclose(bundle.runner.act(now), np.tile(motion.joint_pos[54], (3, 1)), atol=1e-6)
    bundle.runner.act(now)
    shown = bundle.runner.seen[:, 65:94]  # after orientation, joints, velocities and gyro: what was asked for before
    np.testing.assert_allclose(shown, np.tile(motion.joint_pos[54], (3, 1)), atol=1e-6)


def test_a_tracker_of_another_robot_is_refused(twist2):
    with pytest.raises(TrackingError, match="a tracker of g1"):
        load_bundle(twist2, reference=SHIPPED / "groove-dancer" / "reference.npz")
