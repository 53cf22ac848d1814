"""Does mjlab's tracking task take a motion file of ours? Run it in mjlab's own environment (it needs another MuJoCo).

    dance-convert dance_g1.npz --to mujoco-npz -o motion.npz
    python scripts/hand_over_mjlab.py motion.npz          # mjlab 1.6; a minute or two of kernels at the first run

Two things are asked. Placed on the reference, frame by frame, the robot has to earn what perfect tracking earns: names,
orders, frames and velocities are then what mjlab takes them for. And stepped from there for one control period each,
asked for the next frame, it has to earn nearly as much: the motion is one that its physics can follow.
"""

from __future__ import annotations

import argparse
import sys

import numpy as np
import torch
from mjlab.envs import ManagerBasedRlEnv
from mjlab.tasks.tracking.config.g1.env_cfgs import unitree_g1_flat_tracking_env_cfg

PLACED, STEPPED = 0.999, 0.9  # least shares of the largest reward


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("motion", help="motion.npz in mjlab's layout")
    arguments.add_argument("--every", type=int, default=5, help="of so many frames, one is tried")
    args = arguments.parse_args()
    env = make_env(args.motion)
    command = env.command_manager.get_term("motion")
    frames = range(1, command.motion.time_step_total - 2, args.every)
    if not frames:
        print(f"refused: {args.motion}: found {command.motion.time_step_total} frames, expected at least 4")
        return 2
    largest = sum(term.weight for name, term in env.cfg.rewards.items() if name.startswith("motion_"))
    placed, stepped = [], []
    for frame in frames:
        place(env, command, frame)
        placed.append(sum(rewards(env).values()) / largest)
        place(env, command, frame)
        action = (command.motion.joint_pos[frame + 1] - env.scene["robot"].data.default_joint_pos[0]) / scale(env)
        *_, terminated, _, _ = env.step(action[None])
        stepped.append(0.0 if terminated.any() else sum(last_rewards(env).values()) / largest)
    print(f"{len(frames)} frames of {args.motion} in mjlab's tracking task, of the largest reward:")
    print(f"  placed on the reference: {np.mean(placed):.4f}, least {np.min(placed):.4f}")
    print(f"  one control period on:   {np.mean(stepped):.4f}, least {np.min(stepped):.4f}")
    passed = np.min(placed) > PLACED and np.mean(stepped) > STEPPED
    print("taken over" if passed else f"NOT taken over: expected at least {PLACED} everywhere and {STEPPED} on average")
    return 0 if passed else 1


def make_env(motion: str) -> ManagerBasedRlEnv:
    """mjlab's own G1 task with one robot, started at the reference's first frame without noise."""
    cfg = unitree_g1_flat_tracking_env_cfg(play=True)
    cfg.events.clear()
    cfg.scene.num_envs = 1
    cfg.commands["motion"].motion_file = motion
    cfg.commands["motion"].joint_position_range = (0.0, 0.0)
    env = ManagerBasedRlEnv(cfg, device="cpu")
    env.reset()
    return env


def place(env: ManagerBasedRlEnv, command, frame: int) -> None:  # type: ignore[no-untyped-def]
    """Put the robot where the reference is."""
    command.time_steps[:] = frame
    robot, everyone = env.scene["robot"], torch.arange(1)
    root = (
        command.body_pos_w[:, 0],
        command.body_quat_w[:, 0],
        command.body_lin_vel_w[:, 0],
        command.body_ang_vel_w[:, 0],
    )
    robot.write_joint_state_to_sim(command.joint_pos, command.joint_vel, env_ids=everyone)
    robot.write_root_state_to_sim(torch.cat(root, dim=-1), env_ids=everyone)
    env.sim.forward()
    command.update_relative_body_poses()


def rewards(env: ManagerBasedRlEnv) -> dict[str, float]:
    """The tracking terms of the present state."""
    terms = {name: term for name, term in env.cfg.rewards.items() if name.startswith("motion_")}
    return {name: term.weight * float(term.func(env, **term.params)[0]) for name, term in terms.items()}


def last_rewards(env: ManagerBasedRlEnv) -> dict[str, float]:
    """The tracking terms of the step that was."""
    told = dict(env.reward_manager.get_active_iterable_terms(0))
    return {name: float(value[0]) for name, value in told.items() if name.startswith("motion_")}


def scale(env: ManagerBasedRlEnv) -> torch.Tensor:
    """Radians per unit of action."""
    return torch.as_tensor(env.action_manager.get_term("joint_pos").scale).reshape(-1)


if __name__ == "__main__":
    sys.exit(main())
