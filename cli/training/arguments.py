"""The options of `dance-train`."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from cli.shell import FileOptions, Out, TellOptions, from_file, from_words
from tracking import TrainConfig


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Train a policy that performs a reference; no GPU needed.

    Writes a folder: policy.onnx + contract.json (the bundle), checkpoint.pt, curves.csv, TensorBoard events and a
    Rerun recording of the policy beside the ghost of its reference.

    Examples:
        dance-train --ref out.npz
        dance-train --ref out.npz --teacher twist2_1017_20k.onnx
        dance-train --ref faster.npz --from runs/out
        dance-train --ref out.npz --check-ref
        dance-train --ref out.npz --minutes 2 --view
        dance-train --ref out.npz --teacher none --ppo.hidden 512,256 --task.rewards.action-rate -0.2
        dance-train --ref out.npz -o runs/groove --resume
        dance-train --ref verse.npz chorus.npz -o runs/song
        dance-train --ref references -o runs/all --steps 50000000
        tensorboard --logdir runs
        torchrun --nproc-per-node 2 --no-python dance-train --ref out.npz
    """

    ref: tuple[Path, ...]
    """The reference (.npz) that dance-retarget wrote; or several of one robot, or a folder of them, for one policy. Another
    tool's motion of a robot (GMR, PHC, BeyondMimic, mjlab, Unitree) is taken as it stands: dance-report judges it."""
    teacher: str = "auto"
    """Who teaches the dance, in minutes where finding out takes hours: another lab's tracker (an ONNX, docs/trackers.md), a
    teacher.pt or the folder of a run that has one, or a tracker that comes with the package. auto: the robot's own where
    there is one; none: the policy finds out by itself (PPO). A teacher's gains become the policy's."""
    begin: Annotated[Path | None, tyro.conf.arg(name="from")] = None
    """A policy to begin with instead of nothing, of the same robot, table and size: a run, a bundle, the name of one. Who is
    taught by a tracker of ours is of its own tracker's size: --from tracker-g1."""
    robot: str | None = None
    """Its robot, where the reference's is not a built-in one (path of a profile), or a folder has several robots'."""
    out: Out = None
    """Folder of the run, which is the bundle; of several references each has its bundle inside. Default:
    runs/<reference>."""
    steps: int | None = None
    """Budget, over which the schedules run: of a taught dance labels, by default as many as its length asks; of PPO control
    steps of all environments together, by default three million."""
    minutes: float = TrainConfig.minutes
    """Stop learning after this much time from now, whatever the steps; the last judgement comes on top, a minute on a slow
    machine."""
    envs: int = TrainConfig.envs
    """Environments side by side."""
    seed: int = TrainConfig.seed
    """Seed of everything random."""
    threads: int = TrainConfig.threads
    """Threads of physics and networks; 0: as many as this process may use."""
    engine: Literal["mujoco", "warp"] = "mujoco"
    """Physics of the training: MuJoCo on the processor's cores, or MuJoCo-Warp on a CUDA device (extra gpu)."""
    target: float = TrainConfig.target
    """Stop early when this share of evaluation rollouts finishes (of several dances in each), twice in a row."""
    randomisation: bool = True
    """Give every environment a robot of its own (friction, masses, gains, motors, biases, delays) and pushes."""
    resume: bool = False
    """Go on from the run's checkpoint."""
    view: bool = False
    """Open a page meanwhile (extra view): the latest policy beside its reference, where it falls, the curves."""
    recording: bool = True
    """Write a Rerun recording at the end."""
    check_ref: bool = False
    """Only play the reference: perfectly, and with zero action. No training."""
    anyway: bool = False
    """Train on a reference whose gates failed."""
    config: Path | None = None
    """Settings of task and training in a TOML file; a run keeps its own in config.toml. One alone:
    --task.rewards.action-rate -0.2, --ppo.hidden 512,256."""
    file: FileOptions = field(default_factory=FileOptions)
    tell: TellOptions = field(default_factory=TellOptions)

    def numbers(self) -> TrainConfig:
        """All numbers of the run: defaults, the file's, what was stated; the later beats the earlier.

        Raises:
            DanceError: a setting that does not exist, or that no setting can have.
        """
        names = ("minutes", "envs", "seed", "threads", "target", "engine", "steps")
        options = {name: getattr(self, name) for name in names}
        stated: dict[str, Any] = {
            name: value for name, value in options.items() if value not in (None, getattr(TrainConfig, name))
        }
        base = replace(from_file(TrainConfig(), self.config), **stated)
        if self.steps is not None:
            base = replace(base, distillation=replace(base.distillation, samples=self.steps))
        if not self.randomisation:
            base = replace(base, task=replace(base.task, randomisation=replace(base.task.randomisation, enabled=False)))
        return from_words(base)
