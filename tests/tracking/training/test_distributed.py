"""Several processes, one network: gradients shared, robots and noise apart, the curve of one process with as many robots."""

import dataclasses
import json
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT

torch = pytest.importorskip("torch")

from robot_models import load_robot
from tracking import PpoConfig, TrackingError, TrainConfig, train
from tracking.task.motion_set import read_motion_set
from tracking.training.distributed import Team, join_team

SMALL = PpoConfig(hidden=(32, 32), steps_per_env=8, epochs=2, minibatches=2)
QUICK = TrainConfig(envs=16, steps=16 * 8 * 4, evaluate_every=16 * 8 * 2, rollouts=2, threads=1, ppo=SMALL)
LEARNING = TrainConfig(steps=250_000, evaluate_every=125_000, rollouts=32)

CHILD = """
import hashlib, json, os, sys
from pathlib import Path
sys.path[:0] = [".", "tests", "tests/tracking/training"]
import test_distributed
from robot_models import load_robot
from tracking import train
from tracking.training.ppo import Trainer
from tracking.task.motion_set import read_motion_set

end, trainers = Trainer.iterate, []
Trainer.iterate = lambda self, kl: (trainers.append(self), end(self, kl))[1]
file, folder, config, resume = sys.argv[1:]
robot = load_robot("dancer")
config = test_distributed.__dict__[config]
if resume == "half":
    import dataclasses
    config = dataclasses.replace(config, steps=config.steps // 2)
run = train(robot, read_motion_set([Path(file)], robot), Path(folder), config, resume=resume == "resume")
weights = b"".join(p.detach().numpy().tobytes() for p in trainers[-1].actor.parameters())
told = {"weights": hashlib.sha256(weights).hexdigest(), "frames": trainers[-1].task.frame.tolist(), "curves": run.curves}
Path(f"{folder}.{os.environ['RANK']}.json").write_text(json.dumps(told))
"""


def together(groove_file, folder, config, resume="no", processes=2):
    """What each process of a team tells at the end."""
    script = folder.parent / "child.py"
    script.write_text(CHILD)
    done = subprocess.run(
        [sys.executable, "-m", "torch.distributed.run", "--standalone", "--nproc-per-node", str(processes),
         str(script), str(groove_file), str(folder), config, resume],
        cwd=ROOT, capture_output=True, text=True, timeout=500,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    return [json.loads(Path(f"{folder}.{rank}.json").read_text()) for rank in range(processes)]


def without_time(curves):
    return [{k: v for k, v in row.items() if k != "minutes"} for row in curves]


def test_alone_there_is_nobody_to_ask(monkeypatch):
    monkeypatch.delenv("WORLD_SIZE", raising=False)
    team = join_team()
    assert team == Team() and team.is_leader and team.for_rsl_rl is None
    assert (
        team.broadcast("a") == "a" and team.gather(1) == [1] and team.mean(2.0) == 2.0 and team.share(7, "--envs") == 7
    )


def test_robots_that_cannot_be_shared_evenly_are_refused():
    assert Team(rank=1, size=4).share(256, "--envs") == 64
    with pytest.raises(TrackingError, match="a multiple of the 3 processes"):
        Team(size=3).share(256, "--envs")


@pytest.mark.slow
def test_two_processes_have_one_network_and_go_on_where_they_were_stopped(groove_file, tmp_path):
    whole = together(groove_file, tmp_path / "whole", "QUICK")
    assert whole[0]["weights"] == whole[1]["weights"] and whole[0]["curves"] == whole[1]["curves"]
    assert len(whole[0]["frames"]) == 8 and whole[0]["frames"] != whole[1]["frames"]
    # Schedules run over the budget: the first half of a run with the whole budget is not half a run.
    together(groove_file, tmp_path / "halves", "CALM", "half")
    halves = together(groove_file, tmp_path / "halves", "CALM", "resume")
    calm = together(groove_file, tmp_path / "calm", "CALM")
    assert halves[0]["weights"] == calm[0]["weights"]
    assert without_time(halves[0]["curves"]) == without_time(calm[0]["curves"])
    robot = load_robot("dancer")
    with pytest.raises(TrackingError, match="1 processes"):
        train(robot, read_motion_set([groove_file], robot), tmp_path / "calm", CALM, resume=True)


@pytest.mark.slow
def test_a_team_learns_as_one_process_with_as_many_robots_does(groove_file, tmp_path):
    robot = load_robot("dancer")
    alone = train(robot, read_motion_set([groove_file], robot), tmp_path / "alone", LEARNING).curves
    team = together(groove_file, tmp_path / "team", "LEARNING")[0]["curves"]
    assert [row["steps"] for row in alone] == [row["steps"] for row in team]
    assert team[-1]["survived_s"] > 1.12 * team[0]["survived_s"]
    assert 0.7 < team[-1]["survived_s"] / alone[-1]["survived_s"] < 1.4


CALM = dataclasses.replace(
    QUICK,
    task=dataclasses.replace(QUICK.task, randomisation=dataclasses.replace(QUICK.task.randomisation, grow_over=0.0)),
)
