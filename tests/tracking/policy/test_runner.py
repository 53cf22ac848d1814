"""The runner knows the bundle alone, repeats what the trainer did, and refuses what does not fit."""

import dataclasses
import json
import shutil
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("onnxruntime")

from clips import load_reference
from robot_models import load_robot
from tracking import (
    Measurement,
    Runner,
    TrackingError,
    TrackingTask,
    load_bundle,
    motion_of,
    onnx_policy,
    read_contract,
)
from tracking.config import RandomisationConfig, TaskConfig
from tracking.policy.bundle import SHIPPED
from tracking.policy.contract import write_contract
from tracking.policy.golden_trace import read_golden, replay

pytestmark = pytest.mark.usefixtures("as_users_run_it")  # refusals, and doubles of what is checked elsewhere

FOLDER = SHIPPED / "groove-dancer"


@pytest.fixture(scope="module")
def reference():
    return load_reference(FOLDER / "reference.npz")


def runner(reference, **changes):
    contract = dataclasses.replace(read_contract(FOLDER / "contract.json"), **changes)
    return Runner(contract, onnx_policy(FOLDER / "policy.onnx"), motion_of(reference, contract))


@pytest.mark.parametrize("name", ["groove-dancer", "groove-g1"])
def test_a_runner_repeats_the_golden_trace(name):
    bundle = load_bundle(SHIPPED / name)
    assert replay(bundle.runner, read_golden(SHIPPED / name / "golden.npz")) < 1e-5


def _shift(rows, kind, **changes):
    return tuple(dataclasses.replace(r, **changes) if r.kind == kind else r for r in rows)


@pytest.mark.parametrize("broken", ["chain", "rows", "scale", "ahead", "action", "gains", "target", "seconds"])
def test_a_runner_that_does_anything_else_is_found_out(reference, broken):
    told, golden = read_contract(FOLDER / "contract.json"), read_golden(FOLDER / "golden.npz")
    rows = told.observation
    changes = {
        "chain": {"anchor_chain": told.anchor_chain[:-1]},
        "rows": {"observation": (*rows[:-2], rows[-1], rows[-2])},
        "scale": {"observation": _shift(rows, "gyro", scale=1.0)},
        "ahead": {"observation": _shift(rows, "reference_joint_pos", at=2)},
        "action": {"action_scale": 0.5 * told.action_scale},
        "gains": {"kp": 1.2 * told.kp},
        "target": {"target": "default"},
        "seconds": {},
    }[broken]
    one = runner(reference, **changes)
    if broken == "seconds":
        one.motion = dataclasses.replace(one.motion, start=one.motion.start + 1)
    with pytest.raises(TrackingError, match="golden trace"):
        replay(one, golden)


def test_sensors_lead_to_the_observation_of_the_simulation_whatever_the_heading(reference, rng):
    quiet = RandomisationConfig(enabled=False)
    robot, config = load_robot("dancer"), TaskConfig(randomisation=quiet, look_back=(1, 2), root_ahead=True)
    task = TrackingTask(robot=robot, reference=reference, envs=6, config=config, threads=1)
    told = dataclasses.replace(read_contract(FOLDER / "contract.json"), observation=task.actor.rows)
    one = Runner(told, lambda seen: np.zeros((len(seen), 28)), motion_of(reference, told))
    task.reset(np.arange(6), np.full(6, 60))
    one.start(task.measured(noisy=False), 60)
    for _ in range(12):
        seen = task.observe(noisy=False)[0]
        targets = one.act(task.measured(noisy=False))
        np.testing.assert_allclose(one.seen, seen, atol=1e-6)
        action = 0.3 * rng.normal(size=(6, 28))
        one.actions[0] = action
        task.step(action)
        asked = task.targets[one.frame] + task.action_scale * action
        np.testing.assert_allclose(task.physics.targets[:, 0], np.clip(asked, *task.target_range), atol=1e-12)
        np.testing.assert_allclose(targets, np.clip(task.targets[one.frame], *task.target_range), atol=1e-12)
    task.close()


def test_no_simulator_and_no_trainer_is_needed():
    script = f"""
import sys, pathlib
from clips import load_reference
from tracking import Runner, motion_of, onnx_policy, read_contract
from tracking.policy.golden_trace import read_golden, replay
folder = pathlib.Path({str(FOLDER)!r})
contract = read_contract(folder / "contract.json")
runner = Runner(contract, onnx_policy(folder / "policy.onnx"), motion_of(load_reference(folder / "reference.npz"), contract))
assert replay(runner, read_golden(folder / "golden.npz")) < 1e-5
print(sorted({{"torch", "mujoco", "pinocchio", "gymnasium", "sapien"}} & set(sys.modules)))
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("door", ["load_bundle", "read_runner"])
def test_a_bundle_opens_where_the_training_packages_are_not(door):
    script = f"""
import sys
sys.modules |= dict.fromkeys(("torch", "rsl_rl", "tensordict", "gymnasium", "onnx"))
import tracking.deploy.loop, tracking.deploy.stages
from tracking.policy.bundle import load_bundle, read_runner
from pathlib import Path
{door}(Path({str(FOLDER)!r}))
print("opened")
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "opened", done.stderr


def test_a_term_that_nobody_knows_is_refused_by_name_and_one_that_no_sensor_tells_when_it_is_asked_for(reference):
    told = read_contract(FOLDER / "contract.json")
    with pytest.raises(TrackingError, match="base_lin_wel"):
        runner(reference, observation=(dataclasses.replace(told.observation[0], kind="base_lin_wel", size=3),))
    one = runner(reference, observation=(dataclasses.replace(told.observation[0], kind="root_lin_vel", size=3),))
    sensors = Measurement(
        quat=np.array([[1.0, 0, 0, 0]]), gyro=np.zeros((1, 3)), joint_pos=np.zeros((1, 28)), joint_vel=np.zeros((1, 28))
    )
    one.start(sensors)
    with pytest.raises(TrackingError, match="state estimator"):
        one.act(sensors)


def test_a_motion_of_another_rate_or_joint_order_is_refused(reference):
    with pytest.raises(TrackingError, match="control_dt"):
        runner(reference, control_dt=0.01)
    with pytest.raises(TrackingError, match="joint_names"):
        runner(reference, joint_names=read_contract(FOLDER / "contract.json").joint_names[::-1])


def test_a_contract_survives_its_file_to_the_last_bit(tmp_path):
    told = read_contract(FOLDER / "contract.json")
    write_contract(tmp_path / "contract.json", told)
    again = read_contract(tmp_path / "contract.json")
    for field in dataclasses.fields(told):
        if field.name != "source":
            np.testing.assert_array_equal(getattr(told, field.name), getattr(again, field.name), err_msg=field.name)


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("format_version", 99, "update dance-retarget"),
        ("format_version", 1, "export it again"),
        ("kp", [1.0, 2.0], "28 finite numbers"),
        ("kd", [float("nan")] * 28, "finite"),
        ("effort", [0.0] * 28, "positive"),
        ("control_dt", 20, "seconds"),
        ("target", "nothing", "reference, default"),
        ("joint_names", ["a"] * 28, "one name per joint"),
        ("observation", json.loads((FOLDER / "contract.json").read_text())["observation"][1:], "side by side"),
        (
            "anchor_chain",
            [{"pos": [0, 0, 0], "quat": [1, 1, 0, 0], "joint": None, "axis": [0, 0, 0]}],
            "unit quaternions",
        ),
        ("anchor_chain", [{"pos": [0, 0, 0], "quat": [1, 0, 0, 0], "joint": "tail", "axis": [0, 0, 1]}], "tail"),
    ],
)
def test_a_bad_contract_is_refused_by_the_key_that_is_wrong(tmp_path, key, value, said):
    told = json.loads((FOLDER / "contract.json").read_text())
    (tmp_path / "contract.json").write_text(json.dumps({**told, key: value}))
    with pytest.raises(TrackingError, match=said):
        read_contract(tmp_path / "contract.json")


def test_a_network_of_another_size_is_refused_before_anything_moves(tmp_path):
    shutil.copytree(FOLDER, tmp_path / "b")
    shutil.copy(SHIPPED / "groove-g1" / "policy.onnx", tmp_path / "b")
    with pytest.raises(TrackingError, match="observation"):
        load_bundle(tmp_path / "b")


def test_one_measurement_or_many_are_the_same(reference, rng):
    many, one = runner(reference), runner(reference)
    noise = rng.normal(size=(3, 28))
    measured = Measurement(
        quat=np.tile([1.0, 0, 0, 0], (3, 1)), gyro=np.zeros((3, 3)), joint_pos=0.1 * noise, joint_vel=noise
    )
    single = Measurement(**{k: v[1:2] for k, v in vars(measured).items() if v is not None})
    many.start(measured)
    one.start(single)
    np.testing.assert_allclose(many.act(measured)[1], one.act(single)[0], atol=1e-5)
