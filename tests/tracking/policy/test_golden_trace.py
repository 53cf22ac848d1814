"""Golden traces: a runner that does as the trainer did passes, and one that is off anywhere, once, does not."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("onnxruntime")

import tracking
from clips import load_reference
from tracking import Runner, TrackingError, motion_of, onnx_policy, read_contract
from tracking.policy.golden_trace import TOLERANCE, Golden, read_golden, replay, write_golden

pytestmark = pytest.mark.usefixtures("as_users_run_it")  # refusals, and doubles of what is checked elsewhere

FOLDER = Path(tracking.__file__).parent / "policies" / "groove-dancer"
SENSORS, RESULTS = ("quat", "gyro", "joint_pos", "joint_vel"), ("observation", "action", "target")


@pytest.fixture(scope="module")
def golden():
    whole = read_golden(FOLDER / "golden.npz")
    return Golden(**{k: v[:12] for k, v in vars(whole).items()})


@pytest.fixture(scope="module")
def parts():
    contract = read_contract(FOLDER / "contract.json")
    motion = motion_of(load_reference(FOLDER / "reference.npz"), contract)
    return contract, onnx_policy(FOLDER / "policy.onnx"), motion


def changed(golden, name, by, at=(7, 0)):
    array = getattr(golden, name).copy()
    array[at] += by
    return dataclasses.replace(golden, **{name: array})


def test_a_trace_survives_its_file_bit_for_bit(golden, tmp_path):
    write_golden(tmp_path / "g.npz", golden)
    again = read_golden(tmp_path / "g.npz")
    for name, array in vars(golden).items():
        np.testing.assert_array_equal(getattr(again, name), array)
    assert [p.name for p in tmp_path.iterdir()] == ["g.npz"]


def test_the_same_runner_may_repeat_a_trace_twice(golden, parts):
    runner = Runner(*parts)
    assert replay(runner, golden) == replay(runner, golden) < TOLERANCE


@pytest.mark.parametrize("name", RESULTS)
def test_one_number_in_one_period_is_enough_to_be_found_out_and_is_named(golden, parts, name):
    assert replay(Runner(*parts), changed(golden, name, 0.2 * TOLERANCE)) < TOLERANCE
    with pytest.raises(TrackingError, match=f"golden trace, {name}"):
        replay(Runner(*parts), changed(golden, name, 10.0 * TOLERANCE))


def test_a_network_that_gives_no_numbers_is_found_out(golden, parts):
    contract, _, motion = parts
    broken = Runner(contract, lambda seen: np.full((len(seen), 28), np.nan), motion)
    with pytest.raises(TrackingError, match="golden trace"):
        replay(broken, golden)


@pytest.mark.parametrize("name", SENSORS)
def test_a_sensor_that_told_something_else_is_found_out(golden, parts, name):
    with pytest.raises(TrackingError, match="golden trace"):
        replay(Runner(*parts), changed(golden, name, 0.05, at=(7, 1)))


def test_quaternions_stored_scalar_last_are_found_out(golden, parts):
    with pytest.raises(TrackingError, match="golden trace"):
        replay(Runner(*parts), dataclasses.replace(golden, quat=golden.quat[:, [1, 2, 3, 0]]))


def test_joints_in_another_order_are_found_out(golden, parts):
    with pytest.raises(TrackingError, match="golden trace"):
        replay(Runner(*parts), dataclasses.replace(golden, joint_pos=golden.joint_pos[:, ::-1]))


def test_results_of_another_size_are_no_results(golden, parts):
    with pytest.raises(TrackingError, match="golden trace, action: found inf"):
        replay(Runner(*parts), dataclasses.replace(golden, action=golden.action[:, 1:]))


@pytest.mark.parametrize("lost", [*SENSORS, *RESULTS])
def test_a_trace_without_one_of_its_arrays_is_refused(golden, tmp_path, lost):
    np.savez(tmp_path / "g.npz", **{k: v for k, v in vars(golden).items() if k != lost})
    with pytest.raises(TrackingError, match=rf"g\.npz: found {lost}.*export it again"):
        read_golden(tmp_path / "g.npz")


def test_what_is_no_archive_is_refused(tmp_path):
    (tmp_path / "g.npz").write_bytes(b"no archive")
    for name in ("g.npz", "absent.npz"):
        with pytest.raises(TrackingError, match="golden.npz of a policy bundle"):
            read_golden(tmp_path / name)


@pytest.mark.parametrize("name", (*SENSORS, *RESULTS))
@pytest.mark.parametrize("how", ["nan", "inf", "empty", "shorter", "flat"])
def test_a_trace_whose_numbers_are_none_is_refused_before_it_is_repeated(golden, tmp_path, name, how):
    array = getattr(golden, name)
    array = {
        "nan": lambda: np.where(np.arange(array.size).reshape(array.shape) == 5, np.nan, array),
        "inf": lambda: np.where(np.arange(array.size).reshape(array.shape) == 5, np.inf, array),
        "empty": lambda: array[:0],
        "shorter": lambda: array[:-1],
        "flat": lambda: array[:, 0],
    }[how]()
    np.savez(tmp_path / "g.npz", **(vars(golden) | {name: array}))
    with pytest.raises(TrackingError, match=r"export it again"):
        read_golden(tmp_path / "g.npz")


def test_a_trace_of_no_periods_repeats_nothing_and_is_refused(golden, tmp_path):
    np.savez(tmp_path / "g.npz", **{k: v[:0] for k, v in vars(golden).items()})
    with pytest.raises(TrackingError, match="one period at least"):
        read_golden(tmp_path / "g.npz")
