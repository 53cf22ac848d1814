"""How near do good rollouts come to the guard's limits? `python benchmarks/guard_margins.py groove-g1 --rollouts 30`.

The controller of a deployment, on the rehearsal's robot with its sensor noise, time as the ticks go, and a guard that never
trips. The largest of each number stands in `GuardConfig` and in docs/robot.md as what was seen.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import fields, replace
from pathlib import Path

import numpy as np

from robot_models import load_robot
from robot_models.maths import rotation as rot
from tracking.deploy import Controller, Guard, GuardConfig, RobotLimits, Stage, StageConfig
from tracking.deploy.rehearsal import STATE_DT, SimulatedBody, sensed
from tracking.policy import read_runner

BLIND = GuardConfig(**{f.name: 1e9 for f in fields(GuardConfig) if f.name not in ("voltage", "rate")})
CONFIG = StageConfig(damping_s=0.02, rise_s=1.0, stand_s=0.5)


def rollout(bundle: Path, limits: RobotLimits, seed: int) -> tuple[bool, dict[str, float]]:
    """Whether one performance came to its end, and the largest of each number before it."""
    _, runner = read_runner(bundle)
    robot, rng, body = limits.robot, np.random.default_rng(seed), SimulatedBody(limits.robot)
    guard = Guard(limits, BLIND)
    controller, dt = Controller(runner, guard, CONFIG), runner.contract.control_dt
    worst, last, stage, now = dict[str, float](), None, None, 0.0
    while True:
        state = replace(sensed(body, rng), received=now)
        up = [rot.rotate(rot.conjugate(q), np.array((0.0, 0.0, 1.0))) for q in (state.quat, controller._meant())]
        command = controller.tick(state, now, now)
        if controller.stage is Stage.OVER:
            return controller.dances == 1 and not guard.tripped, worst
        last, stage = (last if stage is controller.stage else None), controller.stage
        asked = command.kp * (command.target - state.joint_pos) - command.kd * state.joint_vel
        moved = np.zeros_like(asked) if last is None else command.kp * np.abs(command.target - last)
        seen = {
            "lean [rad]": np.arccos(np.clip(up[0] @ up[1], -1.0, 1.0)),
            "gyro [rad/s]": np.linalg.norm(state.gyro),
            "speed, of the limit": (np.abs(state.joint_vel) / robot.velocity).max(),
            "torque asked for, efforts": (np.abs(asked) / robot.effort).max(),
            "torque measured, efforts": (np.abs(body.torque) / robot.effort).max(),
            "jump of a target, effort / kp": (moved / robot.effort).max(),
            "overlap of the commanded pose [m]": guard._overlap(command),
        }
        worst = {name: max(worst.get(name, 0.0), float(value)) for name, value in seen.items()}
        last, now = command.target, now + dt
        for _ in range(round(dt / STATE_DT)):
            body.step(command.kp, command.kd, command.target)


def main() -> None:
    """The largest of every number over all rollouts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bundle", type=Path)
    parser.add_argument("--rollouts", type=int, default=30)
    args = parser.parse_args()
    limits = RobotLimits.of(load_robot("g1"))
    done = [rollout(args.bundle, limits, seed) for seed in range(args.rollouts)]
    sys.stdout.write(f"{sum(good for good, _ in done)} of {args.rollouts} came to their end\n")
    for name in done[0][1]:
        sys.stdout.write(f"{name:<36} {max(worst[name] for _, worst in done):.3f}\n")


if __name__ == "__main__":
    main()
