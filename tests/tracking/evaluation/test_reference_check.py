"""What is known of a reference before training: a good one passes, a spoilt one does not."""

import dataclasses

import numpy as np
import pytest

pytest.importorskip("torch")

from cli import train as command
from clips import load_reference, save_reference
from robot_models import load_robot
from tracking import check_reference


@pytest.fixture(scope="module")
def reference(groove_file):
    return load_reference(groove_file, load_robot("dancer"))


def spoilt(reference):
    """The same motion, said to have missed a gate."""
    report = {**reference.meta["report"], "joint range": {"value": 1.0, "unit": "%", "limit": 0.0, "passed": False}}
    return dataclasses.replace(reference, meta={**reference.meta, "report": report})


def test_a_good_reference_passes_and_its_prior_stands(reference):
    found = check_reference(reference, load_robot("dancer"))
    assert found.passed and found.perfect > 0.99 and found.too_fast == found.beyond_limits == 0.0
    assert abs(found.settles_m) < 0.005  # the robot's weight presses the soles into the floor, no more
    assert 0.5 < found.survived_s < reference.duration_s


@pytest.mark.slow
def test_missed_gates_and_joints_beyond_their_range_do_not_pass(reference):
    robot = load_robot("dancer")
    assert check_reference(spoilt(reference), robot).failed_gates == ("joint range",)
    joints = np.array(reference.joint_pos)
    joints[100, 3] = robot.upper[3] + 0.1
    found = check_reference(dataclasses.replace(reference, joint_pos=joints), robot)
    assert found.beyond_limits == pytest.approx(1 / reference.frames) and not found.passed


@pytest.mark.slow
def test_training_on_missed_gates_needs_a_word(reference, tmp_path, capsys):
    save_reference(spoilt(reference), tmp_path / "bad.npz")
    assert command.main(["--ref", str(tmp_path / "bad.npz"), "-o", str(tmp_path / "run")]) == 2
    told = capsys.readouterr().err
    assert "joint range" in told and "--anyway" in told
    assert not (tmp_path / "run").exists()
    assert command.main(["--ref", str(tmp_path / "bad.npz"), "--check-ref"]) == 1
