"""A policy learns four seconds of a dance; ten seconds of training here, where minutes would do it."""

from dataclasses import replace
from pathlib import Path
from tempfile import mkdtemp

import clips.samples
from clips import cut, read_clip, save_reference
from retarget import retarget
from robot_models import load_robot
from tracking import TrainConfig, train
from tracking.task import read_named_reference

robot = load_robot("dancer")
clip = cut(read_clip(Path(clips.samples.__path__[0]) / "groove.bvh"), 0.0, 4.0)
save_reference(retarget(clip, robot).reference, Path("short.npz"))

config = replace(TrainConfig(), minutes=0.15, envs=64, seed=0)
run = train(robot, [read_named_reference(Path("short.npz"))], Path(mkdtemp()) / "run", config)
print(run.stopped, "after", run.steps, "steps:", run.evaluations["short"])
