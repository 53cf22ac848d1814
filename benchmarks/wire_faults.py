"""Random faults at random moments of rehearsals over the robot's own messages: does every one end in damping, and when?

    python benchmarks/wire_faults.py --count 100 --out benchmarks/wire_faults.md

Each trial is a rehearsal of its own: a controller, its keeper, a simulated robot. Signals, kills and pauses of either
process, faults of the policy, faults of the robot's sensors. What counts is what the robot heard, by its own log: the time
from the fault (for faults that have to last, from the guard's decision) to the first damping command, and whether anything
with stiffness came after it.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

import numpy as np

SIGNALS = {
    f"controller: {n}": getattr(signal, n) for n in ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGKILL", "SIGSTOP")
}
KEEPER = {f"keeper: {n}": getattr(signal, n) for n in ("SIGTERM", "SIGKILL", "SIGSTOP")}
POLICY = ("policy: exception", "policy: hang", "policy: NaN", "policy: jump", "parent: gone")
LASTING = {  # faults that have to last, and what the guard says of each
    "lean": "lean", "fall": "falling", "strain": "strain", "loss": "lost states", "silence": "stale", "frozen": "stale"
}  # fmt: skip
TARGET, SAFE_S = 0.1, 0.5


def controller(log: Path, kind: str, after: float) -> None:
    """Rehearse groove-g1 with a fault of the policy or the robot; tell the parent what it needs to do the others."""
    from robot_models import load_robot
    from tracking.deploy import (
        LOSS,
        Controller,
        ControllerTransport,
        Guard,
        GuardConfig,
        RehearsedFault,
        RobotLimits,
        Stage,
        StageConfig,
        kept_outlet,
        own_tag,
        perform,
        rehearsal_robot,
        stop_key,
    )
    from tracking.policy import read_runner

    limits = RobotLimits.of(load_robot("g1"))
    _, runner = read_runner(Path("groove-g1"))
    begun, honest = [np.inf], runner.policy

    people = os.fdopen(os.dup(1), "w")  # the SDK talks on the standard output, in the middle of lines
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)

    def tell(**what: object) -> None:
        print(json.dumps(what), flush=True, file=people)

    def broken(seen: np.ndarray) -> np.ndarray:
        actions = honest(seen)
        if kind.startswith("policy") and time.monotonic() > begun[0] + after:
            tell(fault=time.monotonic())
            begun[0] = np.inf
            if kind.endswith("exception"):
                raise ValueError("of the policy")
            if kind.endswith("hang"):
                time.sleep(1.0)
            actions = actions * np.nan if kind.endswith("NaN") else actions + (40.0 if kind.endswith("jump") else 0.0)
        return actions

    def stage(now: Stage, _: int) -> None:
        tell(stage=now.value, at=time.monotonic())
        if now is (Stage.DANCE if kind.startswith("policy") else Stage.STAND) and begun[0] == np.inf:
            begun[0] = time.monotonic()

    runner.policy = broken
    tag, fault = own_tag(), RehearsedFault(name=kind.split(": ")[1], after=after) if kind.startswith("robot") else None
    config = StageConfig(damping_s=0.2, rise_s=1.0, stand_s=0.5)
    transport = ControllerTransport("lo", limits.joint_names, tag=tag)
    with stop_key() as stopped, rehearsal_robot(log, tag, fault) as ready:
        transport.wait_alone(ready.wait)
        with kept_outlet("lo", tag, transport, limits) as outlet:
            tell(controller=os.getpid(), keeper=outlet._process.pid)
            stopped.begun, guard = True, Guard(limits, GuardConfig(loss=LOSS))
            done = perform(Controller(runner, guard, config), transport, outlet, stopped=stopped, tell=stage)
            tell(tripped=done.tripped)


def trial(kind: str, after: float, folder: Path) -> dict[str, object]:
    """One rehearsal with one fault; what the robot heard of it."""
    log = folder / f"robot-{time.monotonic_ns()}"
    words = [sys.executable, __file__, "--controller", str(log), kind, str(after)]
    if kind == "parent: gone":
        words = ["sh", "-c", '"$@" & wait', "sh", *words]
    child = subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, start_new_session=True
    )
    assert child.stdout is not None
    told: dict[str, object] = {}
    fault_at = None
    for line in child.stdout:
        if not line.startswith("{"):
            continue
        told |= (said := json.loads(line))
        if "fault" in said:
            fault_at = said["fault"]
        if said.get("stage") == "over":
            told["over_at"] = said["at"]
        if (
            said.get("stage") == "stand"
            and fault_at is None
            and kind.split(":")[0] in ("controller", "keeper", "parent")
        ):
            time.sleep(after)
            fault_at = time.monotonic()
            pid = child.pid if kind == "parent: gone" else told[kind.split(":")[0]]
            with contextlib.suppress(ProcessLookupError):  # it tripped before: not in flight
                os.kill(int(str(pid)), signal.SIGKILL if kind == "parent: gone" else (SIGNALS | KEEPER)[kind])
            if kind == "controller: SIGSTOP":
                time.sleep(1.5)
                os.kill(int(str(pid)), signal.SIGCONT)
    child.stdout.close()
    child.wait(30)
    until = time.monotonic() + 20.0
    while not log.with_suffix(".npz").exists() and time.monotonic() < until:
        time.sleep(0.1)
    time.sleep(0.2)
    return judged(kind, log.with_suffix(".npz"), fault_at, told)


def judged(kind: str, log: Path, fault_at: float | None, told: dict[str, object]) -> dict[str, object]:
    """When the robot heard damping for good, and whether it heard stiffness afterwards."""
    out: dict[str, object] = {"kind": kind, "stopped by": told.get("tripped", "")}
    if not log.exists():
        return out | {"outcome": "no log of the robot"}
    with np.load(log) as heard:
        at, kp, kd, end = heard["heard"], heard["kp"], heard["kd"], float(heard["time"][-1])
        fault_at = float(heard["fault_at"]) if fault_at is None else fault_at
    name = kind.split(": ")[-1]
    if (
        name in LASTING and fault_at < np.inf
    ):  # the guard waits for them to last: from its decision, which has to be theirs
        if not str(told.get("tripped", "")).startswith(LASTING[name]):
            return out | {"outcome": "not in flight" if float(str(told.get("over_at", 0))) < fault_at else "missed"}
        fault_at = float(str(told.get("over_at", np.inf)))
    soft = (kp == 0.0) & (kd > 0.0)
    stiff = np.flatnonzero(kp > 0.0)
    last = stiff[-1] if len(stiff) else -1
    # A machine that stood still tripped it before the fault came: no trial of this fault.
    if not np.isfinite(fault_at) or last < 0 or at[stiff[0]] > fault_at or at[min(last + 1, len(at) - 1)] < fault_at:
        return out | {"outcome": "not in flight"}
    if last + 1 >= len(at) or not soft[last + 1 :].all():
        return out | {"outcome": "no damping"}
    took, safe = float(at[last + 1] - fault_at), end - float(at[last + 1])
    good = took <= TARGET and safe > SAFE_S
    return out | {
        "outcome": "damped" if good else "late",
        "ms": round(1e3 * took, 1),
        "silence after [s]": round(safe, 1),
    }


def table(results: list[dict[str, object]]) -> str:
    """By kind: how many, how many well, median and worst time to damping."""
    kinds = defaultdict(list)
    for r in results:
        kinds[str(r["kind"])].append(r)
    lines = ["| fault | trials | damped in 100 ms, nothing stiff after | median, worst [ms] |", "|---|---|---|---|"]
    for kind, rows in sorted(kinds.items()):
        times = [float(str(r["ms"])) for r in rows if "ms" in r]
        spread = f"{np.median(times):.0f}, {max(times):.0f}" if times else "-"
        lines.append(f"| {kind} | {len(rows)} | {sum(r['outcome'] == 'damped' for r in rows)} | {spread} |")
    good = sum(r["outcome"] == "damped" for r in results)
    return "\n".join([*lines, f"| all | {len(results)} | {good} | |"])


def main() -> None:
    """Run the trials, kinds in turn, moments at random."""
    from tracking.deploy import FAULTS

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--controller", nargs=3, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.controller:
        return controller(Path(args.controller[0]), args.controller[1], float(args.controller[2]))
    kinds = [*SIGNALS, *KEEPER, *POLICY, *(f"robot: {name}" for name in FAULTS)]
    kinds = [k for k in kinds if args.only in k]
    rng, results, tried = random.Random(args.seed), [], 0
    with tempfile.TemporaryDirectory() as folder:
        while len(results) < args.count and tried < 2 * args.count:
            after, tried = rng.uniform(0.1, 8.0), tried + 1
            result = trial(kinds[len(results) % len(kinds)], after, Path(folder))
            results += [result] if result["outcome"] != "not in flight" else []
            print(len(results), f"{after:.1f} s", result, file=sys.stderr, flush=True)
    text = (
        f"{table(results)}\n\n{tried - len(results)} more were over before their fault came, tripped by a busy machine."
    )
    print(text)
    if args.out:
        args.out.write_text(
            f"# Faults on the wire\n\n`python benchmarks/wire_faults.py --count {args.count}`\n\n{text}\n"
        )
    return None


if __name__ == "__main__":
    main()
