"""The options of `dance-eval`."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from cli.shell import ClipPath, FileOptions, TellOptions


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Roll out a policy bundle over its whole dance and count how often it finishes.

    The policy is played by the runner that stands on a robot: it knows the bundle alone, and first has to repeat the
    golden trace of the training.

    Examples:
        dance-eval groove-g1
        dance-eval groove-g1 --engine all --recording both.rrd
        dance-eval runs/groove --rollouts 500 --json result.json
        dance-eval groove-g1 --engine all --sweep --picture sweep.png
        dance-eval groove-g1 --write-reference danced.npz
        dance-eval runs/song
        dance-eval tracker-g1 --ref dance_g1.npz
        dance-eval tracker-g1 --dance groove
        dance-eval twist2_1017_20k.onnx --ref dance_g1.npz
    """

    bundle: ClipPath
    """Folder that dance-train wrote (policy.onnx, contract.json, golden.npz, reference.npz; of a policy that dances
    several references, the run's folder: a row for each), or groove-dancer or groove-g1, which come with the package. Or a
    tracker, with --ref or --dance: tracker-g1, or another lab's ONNX (docs/trackers.md); with neither a row for each dance
    that it knows. Also another tool's policy: an ONNX with
    BeyondMimic's metadata, or Unitree's deploy.yaml with its policy.onnx beside it."""
    ref: Path | None = None
    """The reference that it shall perform, where it does not lie in the bundle: a tracker follows any of its robot.
    Another tool's motion is taken as it stands."""
    dance: str | None = None
    """The same by the name of a dance that the tracker knows; any other name tells which there are."""
    robot: str | None = None
    """Its robot, or the path of a profile, where the policy does not say."""
    engine: str = "mujoco"
    """mujoco; physx-isaac (PhysX 5 as Isaac Lab trains, implicit drives at 5 ms); physx-motor (PhysX 5 with the servo
    law of motor boards, clipped torques at 1 ms); physx for both of these, all for all three. PhysX needs the extra
    sim2sim. warp: MuJoCo-Warp, the extra gpu."""
    rollouts: int = 100
    """How many, each with its own noise and robot."""
    seed: int = 1
    """Seed of noise and robots."""
    randomisation: bool = True
    """Draw every rollout's robot from the training ranges; otherwise the nominal one."""
    sweep: bool = False
    """Change one thing at a time (delay, gains, friction, mass, pushes, sensors) and evaluate under each."""
    jobs: int = 0
    """Processes of a sweep; 0: as many as the cores that this process may use."""
    picture: Path | None = None
    """Write the sweep's table as a picture here."""
    write_reference: Path | None = None
    """Write here (.npz) what the nominal robot makes of its reference: a reference that has been danced."""
    recording: Path | None = None
    """Write a Rerun recording here: the best, the median and a failed rollout in each engine."""
    file: FileOptions = field(default_factory=FileOptions)
    tell: TellOptions = field(default_factory=TellOptions)
