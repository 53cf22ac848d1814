"""Networks, metadata and yaml of strangers: a policy or a refusal, within ten seconds and two gigabytes."""

import dataclasses
import json
import os
import shutil
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("onnxruntime")
onnx = pytest.importorskip("onnx")

from onnx import TensorProto, helper, numpy_helper

import tracking
from robot_models import DanceError, load_robot
from tracking import TrackingError, load_bundle
from tracking.policy import onnx_policy, write_beyondmimic
from tracking.policy.readers import read_beyondmimic
from tracking.policy.readers.policy_import import read_unitree

pytestmark = pytest.mark.usefixtures("as_users_run_it")

DANCER = Path(tracking.__file__).parent / "policies" / "groove-dancer"


def value(name, shape, kind=TensorProto.FLOAT):
    return helper.make_tensor_value_info(name, kind, shape)


def saved(path, nodes, inputs, outputs, constants=()):
    graph = helper.make_graph(nodes, "g", inputs, outputs, [numpy_helper.from_array(v, k) for k, v in constants])
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9), str(path))


def linear(path, *, inputs=("obs",), shape=(1, 4), out="actions", weights=None, kind=TensorProto.FLOAT):
    weights = np.zeros((4, 2), dtype=np.float32) if weights is None else weights
    some = [value(n, list(shape), kind) for n in inputs]
    saved(
        path, [helper.make_node("MatMul", [inputs[0], "w"], [out])], some, [value(out, [1, 2], kind)], [("w", weights)]
    )


def endless(path):
    """A loop whose condition never changes."""
    body = helper.make_graph(
        [helper.make_node("Identity", ["on"], ["on_out"]), helper.make_node("Identity", ["x"], ["x_out"])], "body",
        [value("i", [], TensorProto.INT64), value("on", [], TensorProto.BOOL), value("x", [1, 2])],
        [value("on_out", [], TensorProto.BOOL), value("x_out", [1, 2])],
    )  # fmt: skip
    nodes = [
        helper.make_node("MatMul", ["obs", "w"], ["start"]),
        helper.make_node("Loop", ["most", "true", "start"], ["actions"], body=body),
    ]
    constants = [
        ("w", np.zeros((4, 2), np.float32)), ("most", np.array(2**62, np.int64)), ("true", np.array(True))
    ]  # fmt: skip
    saved(path, nodes, [value("obs", [1, 4])], [value("actions", [1, 2])], constants)


def huge(path):
    """Eighty gigabytes of zeros."""
    nodes = [
        helper.make_node("ConstantOfShape", ["shape"], ["big"]), helper.make_node("ReduceSum", ["big"], ["sum"], keepdims=0),
        helper.make_node("MatMul", ["obs", "w"], ["a"]), helper.make_node("Add", ["a", "sum"], ["actions"]),
    ]  # fmt: skip
    constants = [("shape", np.array([20_000_000_000], np.int64)), ("w", np.zeros((4, 2), np.float32))]
    saved(path, nodes, [value("obs", [1, 4])], [value("actions", [1, 2])], constants)


NETWORKS = {
    "endless": endless,
    "huge": huge,
    "of NaN": lambda p: linear(p, weights=np.full((4, 2), np.nan, np.float32)),
    "of inf": lambda p: linear(p, weights=np.full((4, 2), np.inf, np.float32)),
    "of another input": lambda p: linear(p, inputs=("o",)),
    "of two inputs": lambda p: linear(p, inputs=("obs", "more")),
    "of another output": lambda p: linear(p, out="a"),
    "of rank three": lambda p: linear(p, shape=(1, 1, 4)),
    "of doubles": lambda p: linear(p, kind=TensorProto.DOUBLE, weights=np.zeros((4, 2))),
    "of no bytes": lambda p: p.write_bytes(b""),
    "of text": lambda p: p.write_text("hello"),
    "a pipe": lambda p: os.mkfifo(p),
    "a device": lambda p: p.symlink_to("/dev/zero"),
    "a folder": lambda p: p.mkdir(),
}


@pytest.mark.parametrize("how", NETWORKS)
def test_a_network_that_is_none_is_refused_in_time(how, tmp_path, monkeypatch):
    import tracking.policy.network as module

    monkeypatch.setattr(module, "refusal_of_child", partial(module.refusal_of_child, seconds=3.0))
    NETWORKS[how](tmp_path / "p.onnx")
    began = time.monotonic()
    with pytest.raises(TrackingError):
        onnx_policy(tmp_path / "p.onnx", 4, 2)
    assert time.monotonic() - began < 15.0


def test_a_network_that_is_one_passes(tmp_path):
    linear(tmp_path / "p.onnx", weights=np.ones((4, 2), np.float32))
    np.testing.assert_array_equal(onnx_policy(tmp_path / "p.onnx", 4, 2)(np.ones((1, 4), np.float32)), [[4.0, 4.0]])


@pytest.fixture(scope="module")
def beyondmimic(tmp_path_factory):
    path = tmp_path_factory.mktemp("bm") / "p.onnx"
    write_beyondmimic(path, load_bundle(DANCER))
    return path


METADATA = {
    "total_time_steps": ("nan", "inf", "-5", "0", "1", "1e12", "2000000", "abc", "", "7.5", "3,4"),
    "observation_history_lengths": ("1e12,1,1,1,1,1", "1.5,1,1,1,1,1", "nan,1,1,1,1,1", "1", ""),
    "joint_stiffness": ("1e300", "nan", "0", "-1", ""),
    "joint_damping": ("1e300", "nan", "-1"),
    "default_joint_pos": ("1e300", "nan"),
    "action_scale": ("1e300", "nan"),
    "joint_names": ("a,b", "", "\x1b[2J"),
    "body_names": ("a,b", ""),
    "observation_names": ("wind", ""),
    "anchor_body_name": ("nowhere",),
}


@pytest.mark.parametrize(("key", "text"), [(k, t) for k, some in METADATA.items() for t in some])
def test_metadata_that_say_what_cannot_be_are_refused(key, text, beyondmimic, tmp_path, monkeypatch):
    import tracking.policy.network as module

    monkeypatch.setattr(module, "refusal_of_child", lambda *_: "")  # the network itself is ours
    model = onnx.load(str(beyondmimic))
    told = {p.key: p.value for p in model.metadata_props}
    per_joint = key in ("joint_stiffness", "joint_damping", "default_joint_pos", "action_scale") and text
    told[key] = ",".join([text, *told[key].split(",")[1:]]) if per_joint else text
    helper.set_model_props(model, told)
    onnx.save(model, str(tmp_path / "p.onnx"))
    began = time.monotonic()
    if (key, text) in (("observation_history_lengths", ""),):  # one of each is what an absent key means
        read_beyondmimic(tmp_path / "p.onnx", load_robot("dancer"))
    else:
        with pytest.raises(DanceError):
            read_beyondmimic(tmp_path / "p.onnx", load_robot("dancer"))
    assert time.monotonic() - began < 10.0


BOMB = "".join(f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9) if k else '1.0'}]\n" for k in range(12))
YAML = {
    "an alias bomb": BOMB + "stiffness: *a11\n",
    "a list that holds itself": "stiffness: &a [*a]\n",
    "nested": "stiffness: " + "[" * 3000 + "]" * 3000 + "\n",
    "history without end": "observations: {base_ang_vel: {history_length: 1.0e+9}}\n",
    "history of a word": "observations: {base_ang_vel: {history_length: a}}\n",
    "history of nothing": "observations: {base_ang_vel: {history_length: .nan}}\n",
    "a term that is a number": "observations: {base_ang_vel: 5}\n",
    "a term that is nothing": "observations: {base_ang_vel: null}\n",
    "terms that are a list": "observations: [1, 2]\n",
    "infinite motors": "joint_ids_map: [.inf]\n",
    "a scale of words": "actions: {JointPositionAction: {scale: [a], offset: [0.0]}}\n",
    "python": "stiffness: !!python/object/apply:os.system ['true']\n",
    "no yaml": "{{{",
}


@pytest.mark.parametrize("how", YAML)
def test_yaml_that_grows_or_says_what_cannot_be_is_refused(how, tmp_path):
    robot = load_robot("dancer")
    reference = tracking.load_bundle(DANCER).reference
    n = len(robot.joint_names)
    told = {
        "joint_ids_map": list(range(n)), "step_dt": 0.02, "stiffness": [1.0] * n, "damping": [1.0] * n,
        "default_joint_pos": [0.0] * n,
        "actions": {"JointPositionAction": {"scale": 0.25, "offset": [0.0] * n}}, "observations": {"base_ang_vel": {}},
    }  # fmt: skip
    key = YAML[how].split(":")[0] if how != "an alias bomb" else "stiffness"
    rest = "".join(f"{k}: {json.dumps(v)}\n" for k, v in told.items() if k != key)
    (tmp_path / "deploy.yaml").write_text(rest + YAML[how])
    began = time.monotonic()
    with pytest.raises(TrackingError):
        read_unitree(tmp_path / "deploy.yaml", robot, reference, DANCER / "policy.onnx")
    assert time.monotonic() - began < 10.0


@pytest.mark.parametrize("text", ["[" * 100_000, '{"x":' * 100_000, "3", "", '{"format_version": 2}', "\x00"])
def test_contracts_that_are_none_are_refused(text, tmp_path):
    shutil.copytree(DANCER, tmp_path / "b")
    (tmp_path / "b" / "contract.json").write_text(text)
    with pytest.raises(TrackingError):
        load_bundle(tmp_path / "b")


@pytest.mark.parametrize("name", ["contract.json", "reference.npz", "policy.onnx"])
def test_a_pipe_in_a_bundle_is_not_waited_for(name, tmp_path):
    shutil.copytree(DANCER, tmp_path / "b")
    (tmp_path / "b" / name).unlink()
    os.mkfifo(tmp_path / "b" / name)
    with pytest.raises(DanceError, match="pipe"):
        load_bundle(tmp_path / "b")


@pytest.mark.parametrize("name", ["velocity", "lower", "upper", "robot"])
def test_a_contract_of_another_robot_is_not_played_in_simulation_either(name):
    bundle = load_bundle(DANCER)
    c = bundle.contract
    changed = {name: "g1" if name == "robot" else getattr(c, name) * 1.5}
    with pytest.raises(TrackingError, match=name):
        tracking.check_contract(dataclasses.replace(c, **changed), bundle.robot, c.reference_sha256)
