"""Runs that are stopped: by a signal they save first, by kill -9 they lose at most one interval."""

import dataclasses
import json
import os
import signal
import subprocess
import sys
import time

import pytest
from conftest import ROOT

torch = pytest.importorskip("torch")


from robot_models import load_robot
from tracking import PpoConfig, RandomisationConfig, TaskConfig, TrainConfig, train
from tracking.task.motion_set import read_motion_set
from tracking.training.checkpoint import load_checkpoint

INTERVAL = 16 * 8 * 5
CONFIG = TrainConfig(
    envs=16, steps=INTERVAL * 400, evaluate_every=INTERVAL, rollouts=2, threads=1, minutes=1.0,
    ppo=PpoConfig(hidden=(32, 32), steps_per_env=8, epochs=2, minibatches=2),
    task=TaskConfig(randomisation=RandomisationConfig(grow_over=0.0)),  # nothing depends on the budget, so budgets may differ
)  # fmt: skip
CHILD = """
import sys
from pathlib import Path
from robot_models import load_robot
from tracking import train
from tracking.task.motion_set import read_motion_set
sys.path[:0] = ["tests", "tests/tracking/training"]
from test_interruption import CONFIG
robot = load_robot("dancer")
run = train(robot, read_motion_set([Path(sys.argv[1])], robot), Path(sys.argv[2]), CONFIG)
print(run.steps, run.stopped)
"""


def begin(groove_file, folder, rows):
    """A run in another process, once it has written so many rows of its curves."""
    child = subprocess.Popen(
        [sys.executable, "-c", CHILD, str(groove_file), str(folder)],
        cwd=ROOT, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    end = time.monotonic() + 60.0
    while time.monotonic() < end and child.poll() is None:
        if (folder / "curves.csv").exists() and len((folder / "curves.csv").read_text().splitlines()) > rows:
            return child
        time.sleep(0.02)
    pytest.fail(f"the run did not get so far: {child.communicate()}")


def go_on(groove_file, folder, intervals):
    robot = load_robot("dancer")
    config = dataclasses.replace(CONFIG, steps=INTERVAL * intervals)
    return train(
        robot, read_motion_set([groove_file], robot), folder, config, resume=(folder / "checkpoint.pt").exists()
    )


def steps_in(folder):
    return json.loads(load_checkpoint(folder / "checkpoint.pt")["progress"])["steps"]


def told(run):
    return [(r["steps"], r["survived_s"], r["body_error_mm"]) for r in run.curves]


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="no kill -9")
def test_kill_minus_nine_loses_at_most_one_interval_and_the_curve_goes_on(groove_file, tmp_path):
    child = begin(groove_file, tmp_path / "killed", rows=3)
    child.kill()
    child.communicate()
    seen = len((tmp_path / "killed" / "curves.csv").read_text().splitlines()) - 1
    kept = steps_in(tmp_path / "killed")
    assert kept >= (seen - 1) * INTERVAL  # every row that was written can be gone on from
    more = kept // INTERVAL + 2
    again, straight = go_on(groove_file, tmp_path / "killed", more), go_on(groove_file, tmp_path / "straight", more)
    assert told(again) == told(straight) and len(told(again)) == more + 1


@pytest.mark.skipif(os.name == "nt", reason="no SIGTERM")
@pytest.mark.parametrize("which", [signal.SIGTERM, pytest.param(signal.SIGINT, marks=pytest.mark.slow)])
def test_a_run_that_is_told_to_stop_saves_what_it_has(groove_file, tmp_path, which):
    child = begin(groove_file, tmp_path / "r", rows=2)
    child.send_signal(which)
    out, _ = child.communicate(timeout=60)
    assert child.returncode == 0 and f"stopped by {which.name}" in out
    assert steps_in(tmp_path / "r") == int(out.split()[0])  # to the very step
    assert (tmp_path / "r" / "policy.onnx").exists()
