"""`dance-convert`: a robot's motion in another tool's layout."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from cli.shell import ClipPath, FileOptions, Out, TellOptions, Verdict, command, tell
from clips import LAYOUTS, ClipError, RobotClip, read_back, read_clip, write_motion
from robot_models import load_robot


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Write a robot's motion (a reference, or any joint-space file) in the layout of another tool.

    unitree-csv (30 fps, headerless), gmr (pickle), phc (PHC / ASAP / PBHC joblib), mujoco-npz (mjlab's motion.npz),
    isaac-npz (BeyondMimic's motion.npz in Isaac Lab's order). Every file is read back before it is said to be written.

    Examples:
        dance-convert dance_g1.npz --to gmr
        dance-convert dance_g1.npz --to isaac-npz -o motion.npz
        dance-convert unitree.csv --fps 30 --to mujoco-npz --out-fps 50
    """

    clip: ClipPath
    """A reference (.npz), or a motion file of a robot's joints."""
    to: str
    """unitree-csv, gmr, phc, mujoco-npz or isaac-npz."""
    out: Out = None
    """The file; by default beside the clip, named after the layout."""
    out_fps: float | None = None
    """Frame rate to write; by default the clip's, or the one that the layout takes for granted."""
    file: FileOptions = field(default_factory=FileOptions)
    tell: TellOptions = field(default_factory=TellOptions)


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-convert`."""
    return command(Arguments, run, name="dance-convert", argv=argv)


def run(args: Arguments) -> int:
    """Read, write, read back."""
    clip = read_clip(args.clip, args.file.reading())
    if not isinstance(clip, RobotClip):
        raise ClipError(
            str(args.clip), found=f"a person ({clip.source.dialect})", expected="a robot's joints",
            cure=f"retarget it first: dance-retarget {args.clip}",
        )  # fmt: skip
    robot = load_robot(clip.robot)
    suffix = LAYOUTS[args.to].suffix if args.to in LAYOUTS else ""
    out: Path = args.out or args.clip.with_name(f"{args.clip.stem}_{args.to}{suffix}")
    motion = write_motion(out, args.to, clip, robot, args.out_fps)
    apart = read_back(out, motion, robot)
    verdict = Verdict(
        passed=True,
        line=f"{out}: {LAYOUTS[args.to].title}, {motion.frames} frames at {motion.fps:g} fps for {robot.name}",
        numbers=(f"read back to {apart:.1e} rad",),
        written=(out,),
    )
    return tell(verdict, args.tell)
