"""`dance-export`: a trained run as a bundle that stands alone, and in the field's own forms beside it."""

from __future__ import annotations

import shutil
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from cli.shell import ClipPath, Out, TellOptions, Verdict, command, line, tell
from cli.viewing import policy_page
from clips import folder_aside
from tracking import TrackingError

if TYPE_CHECKING:
    from tracking import Bundle


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Write a policy bundle: all that a runner on a robot needs, and nothing else.

    policy.onnx (normaliser inside), contract.json (observations, joints, gains, scales), reference.npz, golden.npz
    (what the trainer made of the first two seconds, which every runner has to repeat), beyondmimic.onnx (runs in
    BeyondMimic's deployers as one of theirs) and deploy.yaml (Unitree's layout).

    With --web instead one page for a browser: the policy, its robot and the physics in a file that needs no network, to be
    pushed and sent to friends. (Of a reference: dance-view.)

    Examples:
        dance-export runs/groove -o bundle
        dance-export groove-g1 -o bundle
        dance-export groove-g1 --web groove.html
    """

    run: ClipPath
    """Folder that dance-train wrote, or groove-dancer or groove-g1, which come with the package."""
    out: Out = None
    """Folder of the bundle; a new one."""
    web: Path | None = None
    """Write a page (.html) instead."""
    robot: str | None = None
    """Path of the robot's profile, where it is not a built-in one."""
    tell: TellOptions = field(default_factory=TellOptions)


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-export`."""
    return command(Arguments, run, name="dance-export", argv=argv)


def _load(args: Arguments) -> Bundle:
    from tracking import load_bundle

    try:
        return load_bundle(args.run, robot=args.robot)
    except TrackingError as e:
        if e.option != "ref":
            raise
        raise TrackingError(
            str(args.run), found="a tracker, which follows any reference", expected="a policy of one dance",
            cure=f"it needs no export: dance-deploy {args.run} --ref DANCE.npz",
        ) from e  # fmt: skip


def run(args: Arguments) -> int:
    """Check, repeat the golden trace, write aside, rename."""
    if args.web is not None:
        return tell(policy_page(args.run, args.robot, None, args.web), args.tell)
    from tracking import read_golden, replay
    from tracking.policy import CONTRACT, GOLDEN, POLICY, REFERENCE, write_beyondmimic, write_unitree

    out = args.out or Path("bundles") / args.run.name
    if out.exists():
        raise TrackingError(str(out), found="something that is already there", expected="a new folder", option="out")
    bundle = _load(args)
    hidden = [row.name for row in bundle.contract.observation if not row.measurable]
    if hidden:
        raise TrackingError(
            str(args.run), found=f"an actor that sees {', '.join(hidden)}", expected="measurable terms only"
        )
    apart = replay(bundle.runner, read_golden(bundle.folder / GOLDEN))
    refused = ""
    with folder_aside(out) as beside:
        for name in (POLICY, CONTRACT, GOLDEN, REFERENCE):
            shutil.copyfile(bundle.folder / name, beside / name)
        write_unitree(beside / "deploy.yaml", bundle)
        try:
            write_beyondmimic(beside / "beyondmimic.onnx", bundle)
        except TrackingError as e:  # a history, say: the bundle itself is whole without this form
            refused = str(e)
    on_g1 = bundle.robot.name == "g1"  # the robot whose messages are known
    verdict = Verdict(
        passed=True,
        line=f"{out}: a bundle that stands alone, for {bundle.robot.name}",
        numbers=(f"golden trace repeated to {apart:.1e}",),
        doubts=(f"no beyondmimic.onnx: {refused}",) if refused else (),
        written=tuple(sorted(out.iterdir())),
        steps=(
            (line("dance-eval", out, "--engine", "all"), "judge it, in three engines"),
            (line("dance-certify", out), "how often it finishes, to a per cent"),
            *(
                [(line("dance-deploy", out, "--rehearse"), "over a robot's own messages, on this machine")]
                if on_g1
                else []
            ),
        ),
    )
    return tell(verdict, args.tell)
