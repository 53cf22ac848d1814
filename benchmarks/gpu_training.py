"""Training on a CUDA device: steps per second by number of worlds, and where the time goes.

    dance-retarget clips/samples/groove.csv --robot g1 -o groove_g1.npz
    python benchmarks/gpu_training.py groove_g1.npz [--worlds 1024 2048 4096 8192]

Physics is MuJoCo-Warp's graph, task is observations, rewards and resets on the same device, learning is the networks, both
when they act and when they are updated. The device is waited for between the parts, which costs the whole a little.
Quality stands beside speed by `dance-train --engine warp`, which writes a curve.
"""

from __future__ import annotations

import argparse
import time
from collections import defaultdict
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import torch

from clips import load_reference
from robot_models import load_robot
from tracking import TrackingTask, TrainConfig

ITERATIONS = 5


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("reference", type=Path)
    arguments.add_argument("--worlds", type=int, nargs="+", default=[1024, 2048, 4096, 8192])
    arguments.add_argument(
        "--anyway", action="store_true", help="measure on warp's CPU device too, which tells nothing"
    )
    args = arguments.parse_args()
    name = cuda_device()
    if name is None and not args.anyway:
        print("no CUDA device here: nothing was measured")
        return
    robot = load_robot(load_reference(args.reference).robot)
    reference = load_reference(args.reference, robot)
    print(f"{args.reference.name} on {robot.name}, {name or 'no CUDA device'}\n")
    print("| worlds | control steps/s | physics % | task % | learning % |\n|---|---|---|---|---|")
    for worlds in args.worlds:
        steps, spent, took = measure(robot, reference, worlds, None if name else "cpu")
        shares = [100.0 * spent[part] / took for part in ("physics", "task")]
        print(
            f"| {worlds} | {steps / took:.0f} | {shares[0]:.0f} | {shares[1]:.0f} | {100.0 - sum(shares):.0f} |",
            flush=True,
        )


def cuda_device() -> str | None:
    """Its name, where warp sees one."""
    try:
        import warp

        warp.config.log_level = warp.LOG_WARNING
        return str(warp.get_device("cuda:0").name) if warp.get_cuda_device_count() else None
    except ImportError:
        return None


def measure(robot: Any, reference: Any, worlds: int, device: str | None) -> tuple[int, dict[str, float], float]:
    """Control steps, seconds by part, seconds in all."""
    from tracking.engines import WarpBatch
    from tracking.training import Trainer

    config = replace(TrainConfig(), envs=worlds)
    task = TrackingTask(
        robot=robot, reference=reference, envs=worlds, config=config.task, engine=partial(WarpBatch, device=device)
    )
    trainer = Trainer(task, config.ppo, seed=0)
    trainer.iterate(config.ppo.first_kl)
    spent: dict[str, float] = defaultdict(float)
    task.physics.step = timed(task.physics.step, spent, "physics")  # type: ignore[method-assign]
    for method in ("step", "observe", "reset"):
        setattr(task, method, timed(getattr(task, method), spent, "task"))
    wait()
    began, steps = time.perf_counter(), 0
    for _ in range(ITERATIONS):
        steps += trainer.iterate(config.ppo.first_kl).steps
    took = time.perf_counter() - began
    task.close()
    spent["task"] -= spent["physics"]  # a task's step has the physics' inside
    return steps, spent, took


def timed(function: Callable[..., Any], spent: dict[str, float], part: str) -> Callable[..., Any]:
    """The same function, which adds its time to a part."""

    def measured(*args: Any, **kwargs: Any) -> Any:
        wait()
        began = time.perf_counter()
        try:
            return function(*args, **kwargs)
        finally:
            wait()
            spent[part] += time.perf_counter() - began

    return measured


def wait() -> None:
    """Until the device has done what it was asked for."""
    if torch.cuda.is_available():
        torch.cuda.synchronize()


if __name__ == "__main__":
    main()
