"""What a run and a reference came to, for the terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from cli.evaluating import outcome_line
from cli.shell import GATE, Trouble, Verdict, again, line
from cli.training.beginning import who_taught
from clips import is_reference
from tracking import LABELS, NOBODY

_HARDLY = 0.2  # share of rollouts that finish, below which more of the same is not the first thing to try

if TYPE_CHECKING:
    from tracking import Evaluation, ReferenceCheck, Run
    from tracking.task import Selection


def check_verdict(found: Mapping[str, ReferenceCheck], solve: Sequence[str] = (), slower: str = "") -> Verdict:
    """Whether references are worth training on; the worst of them decides.

    Args:
        found: by name.
        solve: commands that solve other tools' motions anew.
        slower: the command that makes a slower reference, where there is one file.
    """
    bad = {name: check for name, check in found.items() if not check.passed}
    name, worst = min((bad or found).items(), key=lambda pair: pair[1].survived_s)
    state = (
        "worth training on"
        if not bad
        else f"{len(bad)} of {len(found)} not worth training on"
        if len(found) > 1
        else "not worth training on"
    )
    hopeless = any(check.failed_gates for check in bad.values())
    first = tuple(("solve it anew first", command) for command in solve)
    anyway = (("train on it all the same", again({"--anyway": ""}, but=("--check-ref",))),) if hopeless else ()

    def cures(check: ReferenceCheck) -> tuple[tuple[str, str], ...]:
        return (*first, *anyway, *([("slower", slower)] if slower and not check.failed_gates else []))

    return Verdict(
        passed=not bad,
        line=f"{name if len(found) == 1 else f'{len(found)} references'}: {state}",
        numbers=(
            f"perfect tracking earns {100 * worst.perfect:.0f} % of the reward",
            f"the first pose sinks {1e3 * worst.settles_m:.0f} mm in a second",
            f"zero action survives {worst.survived_s:.1f} s",
        ),
        troubles=tuple(Trouble(what=f"{name}: {_why(check)}", cures=cures(check)) for name, check in bad.items()),
        steps=() if hopeless else ((again({}, but=("--check-ref",)), "a policy that dances it"),),
        data={"checks": {name: asdict(check) for name, check in found.items()}},
    )  # fmt: skip


def slower(files: Sequence[Path], robot: str) -> str:
    """The command that makes a slower reference of one; nothing for several."""
    (file, *others) = files
    if others or not is_reference(file):
        return ""
    return line("dance-retarget", file, "--robot", robot, "--speed", "0.8", "-o", f"{file.stem}_slower.npz")


def _why(check: ReferenceCheck) -> str:
    if check.failed_gates:
        return f"gates that it misses: {', '.join(check.failed_gates)}"
    if check.beyond_limits:
        return f"joints are beyond their limits in {100 * check.beyond_limits:.1f} % of the frames"
    return (
        f"even perfect tracking would earn {100 * check.perfect:.1f} % of the reward, where 90 are asked for: fast or jerky "
        "seconds cost the rest; slower is easier; a policy may learn it all the same"
    )


def check_table(found: ReferenceCheck) -> Table:
    """What the check of a reference found."""
    table = Table(box=None, pad_edge=False, show_header=False)
    table.add_row("gates that failed", ", ".join(found.failed_gates) or "none", "when it was retargeted")
    table.add_row("frames beyond joint limits", f"{100 * found.beyond_limits:.1f} %", "")
    table.add_row("frames over motor speed", f"{100 * found.too_fast:.1f} %", "")
    table.add_row("perfect tracking earns", f"{100 * found.perfect:.1f} %", "of the largest reward")
    table.add_row("first pose, held for 1 s", f"{1e3 * found.settles_m:.1f} mm", "that the pelvis sinks")
    table.add_row("zero action survives", f"{found.survived_s:.2f} s", "mean over starts all along the dance")
    return table


def print_plan(console: Console, chosen: Selection, folder: Path, teacher: Path | None) -> None:
    """What will be learnt, from whom, and where it goes."""
    for piece in chosen.pieces:
        if piece.reference.joint_torque is None:
            console.print(
                f"no torques in {piece.name}: it was made without Pinocchio, or by an earlier release; zero action will fall "
                "sooner and learning take longer. Retarget the clip again to have them.",
                style="yellow",
            )
        console.print(f"{piece.name}: {piece.reference.duration_s:.1f} s for {chosen.robot.name}")
    taught = f"taught by {teacher}" if teacher else "nobody teaches: the policy finds out by itself (docs/training.md)"
    console.print(f"{taught}\nrun in {folder}")


def print_tracker(console: Console, found: dict[str, Evaluation], gate: float) -> None:
    """How well a tracker dances references that nobody taught it."""
    for name, e in found.items():
        known = "dances it already; teaching makes it tighter" if e.finished >= gate else "does not dance it all"
        console.print(
            f"{name}, untaught: {100 * e.finished:.0f} % of {e.rollouts} finish, {100 * e.stood:.0f} % do not fall, "
            f"{e.body_error_mm:.0f} mm: the tracker {known}",
        )  # fmt: skip


def run_verdict(result: Run, refs: Sequence[Path], robot: str | None = None) -> Verdict:
    """How far a policy came, in the dance that it learnt least, and the files."""
    whose = () if robot is None else ("--robot", robot)
    words = line("dance-train", "--ref", *refs, *whose, "-o", result.folder, "--resume")
    if not result.evaluations:  # stopped before it was judged; a resumed run may have earlier curves
        return Verdict(
            passed=False,
            line=f"{result.folder}: {result.stopped}, after {result.steps} steps",
            notes=(_kept(result), "not judged since"),
            steps=((words, "go on"),),
        )
    last, name = result.outcome, min(result.evaluations, key=lambda n: result.evaluations[n].finished)
    worst = result.evaluations[name]
    passed = last["finished"] >= GATE
    taught = who_taught(result.folder) != NOBODY
    recording, labels = result.folder / "training.rrd", result.folder / LABELS
    told = ("policy.onnx", "contract.json", "curves.csv", "checkpoint.pt", "training.rrd")
    which = f"{name}, the dance learnt least of {len(result.evaluations)}" if len(result.evaluations) > 1 else name
    look = ((line("rerun", recording), "look at it"),) if recording.exists() else ()
    after = (
        (line("dance-eval", result.folder), "judge it on a hundred robots"),
        (line("dance-export", result.folder, "-o", "bundle"), "for a robot, or another tool"),
    )
    return Verdict(
        passed=passed,
        line=f"{which}: {100 * last['finished']:.0f} % of rollouts finish, after {result.seconds / 60:.1f} min",
        numbers=(
            f"survives {last['survived_s']:.2f} of {worst.duration_s:.2f} s",
            f"bodies {last['body_error_mm']:.0f} mm off the reference",
            f"{result.steps} steps; {result.stopped}",
        ),
        notes=(f"{labels} ({labels.stat().st_size / 1e6:.0f} MB) is for --resume alone",) if labels.is_file() else (),
        troubles=() if passed else (_below(last["finished"], words, taught),),
        written=tuple(path for path in (result.folder / n for n in told) if path.exists()),
        steps=(*look, *(after if passed else after[:1])),
        data={"evaluations": {n: e.as_dict() for n, e in result.evaluations.items()}, "minutes": result.seconds / 60},
    )


def _kept(result: Run) -> str:
    """What a run that goes on begins with."""
    lost = result.steps - result.saved
    return f"saved at step {result.saved}" + (f"; the {lost} steps after it are done again" if lost > 0 else "")


def _below(finished: float, words: str, taught: bool) -> Trouble:
    cures = [("train on", words)]
    if finished < _HARDLY:
        alone = "a real dance takes hours without a teacher: a shorter or slower part first, or a teacher (docs/trackers.md)"
        cures.append(("its teacher may not dance this: a shorter or slower part first" if taught else alone, ""))
    return Trouble(what=f"below the gate of {100 * GATE:.0f} %", cures=tuple(cures))


def run_details(result: Run) -> list[str]:
    """Every dance's outcome, and what the file of the policy is worth."""
    lines = [
        f"{name}: {outcome_line(e)}; survives {e.survived_s:.2f} of {e.duration_s:.2f} s, body error {e.body_error_mm:.0f} mm"
        for name, e in sorted(result.evaluations.items(), key=lambda pair: pair[1].finished)
    ]
    if result.curves:
        lines.append(f"survived {result.curves[0]['survived_s']:.2f} s in the beginning")
    return [*lines, f"onnxruntime agrees with torch to {result.onnx_difference:.1e}"]
