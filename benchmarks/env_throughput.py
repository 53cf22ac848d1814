"""Control steps per second: raw MuJoCo rollouts, our batched task, and Gymnasium's vector environments, in one run.

    python benchmarks/env_throughput.py REFERENCE.npz [--envs 64 256 1024 4096]

Raw: `mujoco.rollout` in chained calls of one control period, on the models, states and controls that our task goes
through. Ours: a step with rewards, terminations, resets and both observations; actions are small noise. Times are the
best of several rounds, the contenders taking turns. Last result in env_throughput.md.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import gymnasium
import mujoco
import numpy as np
from mujoco import rollout

import tracking.envs  # noqa: F401  (registers the ids)
from clips import load_reference
from robot_models import load_robot
from robot_models.maths import available_threads
from tracking import TrackingTask

STEPS, ROUNDS = 24, 5


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("reference", type=Path)
    parser.add_argument("--envs", type=int, nargs="+", default=[64, 256, 1024, 4096])
    parser.add_argument("--vector-envs", type=int, default=16)
    args = parser.parse_args()
    robot = load_robot(load_reference(args.reference).robot)
    reference = load_reference(args.reference, robot)
    print(f"{args.reference.name} on {robot.name}, {available_threads()} threads; control steps/s\n")
    print("| environments | raw | ours | ours / raw | us per control step and environment |\n|---|---|---|---|---|")
    for count in args.envs:
        task = TrackingTask(robot=robot, reference=reference, envs=count)
        raw, ours = fastest(_raw(task), _ours(task))
        print(
            f"| {count} | {count / raw:.0f} | {count / ours:.0f} | {100 * raw / ours:.0f} % | {1e6 * ours / count:.0f} |",
            flush=True,
        )
        task.close()
    n = args.vector_envs
    print(f"\n| {n} environments of `DanceTracking-v0` | control steps/s |\n|---|---|")
    for mode in ("sync", "async"):
        envs = gymnasium.make_vec(
            "DanceTracking-v0", num_envs=n, vectorization_mode=mode, reference=str(args.reference.resolve())
        )
        envs.reset(seed=0)
        (seconds,) = fastest(_vector(envs, n))
        print(f"| Gymnasium {mode} | {n / seconds:.0f} |", flush=True)
        envs.close()
    task = TrackingTask(robot=robot, reference=reference, envs=n)
    (seconds,) = fastest(_ours(task))
    print(f"| ours | {n / seconds:.0f} |")


def fastest(*contenders: Callable[[], None]) -> list[float]:
    """Seconds per step of each, the best of the rounds, taking turns."""
    best = [float("inf")] * len(contenders)
    for _ in range(ROUNDS):
        for i, step in enumerate(contenders):
            began = time.perf_counter()
            for _ in range(STEPS):
                step()
            best[i] = min(best[i], (time.perf_counter() - began) / STEPS)
    return best


def _ours(task: TrackingTask) -> Callable[[], None]:
    """The task from one saved state on, always with the same actions, so that every round does the same physics."""
    begin = task.state_dict()
    actions = 0.2 * np.random.default_rng(0).standard_normal((STEPS, task.envs, task.actions))
    at = 0

    def step() -> None:
        nonlocal at
        if at == 0:
            task.load_state_dict(begin)
        result = task.step(actions[at])
        task.reset(np.flatnonzero(result.terminated | result.truncated))
        task.observe()
        at = (at + 1) % STEPS

    return step


def _raw(task: TrackingTask) -> Callable[[], None]:
    """Nothing but the physics of the very states and controls that the task goes through."""
    physics, threads = task.physics, available_threads()
    states, controls = [], []
    ours = _ours(task)
    for _ in range(STEPS):
        states.append(physics.state.copy())
        ours()
        controls.append(np.repeat(physics.targets[:, :1], physics.substeps, axis=1))
    pool = rollout.Rollout(nthread=threads)
    data = [mujoco.MjData(physics.models[0]) for _ in range(threads)]
    out = np.zeros((task.envs, physics.substeps, physics.state.shape[1]))
    at = 0

    def step() -> None:
        nonlocal at
        pool.rollout(physics.models, data, states[at], controls[at], nstep=physics.substeps, state=out)
        at = (at + 1) % STEPS

    return step


def _vector(envs: gymnasium.vector.VectorEnv, count: int) -> Callable[[], None]:
    rng, size = np.random.default_rng(0), envs.single_action_space.shape

    def step() -> None:
        envs.step(0.2 * rng.standard_normal((count, *size)).astype(np.float32))

    return step


if __name__ == "__main__":
    main()
