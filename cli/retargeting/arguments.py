"""The options of `dance-retarget`, and which of them cannot go together."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from cli.retargeting.song import SongOptions
from cli.shell import ClipPath, FileOptions, Out, TellOptions, from_file, from_words
from clips import ClipError, OutputError, file_and_name
from retarget import RetargetConfig, RetargetError
from robot_models import DEFAULT_ROBOT


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Bring a mocap file to a robot: writes a reference (.npz) and a Rerun recording (.rrd).

    Examples:
        dance-retarget clip.csv
        dance-retarget dance.bvh --robot g1 -o dance_g1.npz --start 5 --end 25
        dance-retarget unitree.csv --fps 30 --robot g1
        dance-retarget verse.bvh --then chorus.bvh verse.bvh -o song.npz
        dance-retarget fast.bvh --fit-dynamics
        dance-retarget walk.bvh --arms wave.bvh
        dance-retarget signs.bvh --keep legs
        dance-retarget dance.bvh --music song.mp3 --robot g1 --film dance.mp4
        dance-retarget dance.bvh --drop 13.8-14.3 20-21.5
        dance-retarget dance.bvh --contact.tight-speed 0.3 --weights.arm 12
        dance-retarget clips/ more/verse.bvh -o references --robot g1,dancer --jobs 2
        dance-retarget /shared/clips -o /shared/references --ray 10.0.0.5:6379
    """

    clips: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """A motion file, which is known by its content; or several, folders of them, patterns like 'mocap/*.bvh'."""
    robot: str = DEFAULT_ROBOT
    """A built-in robot (dancer, g1, h1, t1, ...; g1@23dof is a variant) or the path of a profile (.toml); several with commas."""
    out: Out = None
    """The reference to write; default: <clips>_<robot>.npz in the current folder. Of several clips: a folder."""
    jobs: int | None = None
    """Processes for several clips; default: one per core that may be used."""
    ray: str | None = None
    """Work on a Ray cluster instead: its host:port, 'auto' for this machine's, 'local' to start one here."""
    start: float = 0.0
    """Begin at this second of the clip."""
    end: float | None = None
    """End at this second of the clip."""
    drop: tuple[str, ...] = ()
    """Leave these seconds of the clip out, as 13.8-14.3; steps lead from what is before to what comes after."""
    speed: float = 1.0
    """Play the clip so many times as fast."""
    mirror: bool = False
    """Exchange left and right."""
    arms: ClipPath | None = None
    """Take trunk, head and arms from this clip, from its beginning on, and the legs from the other."""
    legs: ClipPath | None = None
    """Take pelvis and legs from this clip, and trunk, head and arms from the other."""
    keep: Literal["legs"] | None = None
    """legs: they stand still under what the trunk and the arms do, as of somebody who sat."""
    then: tuple[ClipPath, ...] = ()
    """More clips to dance after this one, with steps between them."""
    loop: int = 1
    """Dance it so many times, with steps back to the first pose between."""
    contacts: Path | None = None
    """CSV of touches (start, end, edge, kind; seconds of the dance) that override the detected ones."""
    keys: Path | None = None
    """CSV of key frames (time, joint, value in radians or degrees; seconds of the dance)."""
    write_contacts: Path | None = None
    """Write the touches used, to be edited and given back with --contacts."""
    fit_dynamics: bool = False
    """Slow the stretches that physics does not allow, and only those."""
    solver: Literal["whole-clip", "mink", "placo"] = "whole-clip"
    """All frames at once, or a per-frame solver for comparison."""
    out_fps: float = 50.0
    """Frame rate of the reference."""
    lead_in: float = 1.0
    """Seconds from standing into the first pose (0: none)."""
    lead_out: float = 1.0
    """Seconds from the last pose back to standing (0: none)."""
    float32: bool = False
    """Write single precision: half the size, forward kinematics to 1e-5."""
    recording: bool = True
    """Write a Rerun recording beside the reference."""
    film: Path | None = None
    """Write a film (.mp4) of the person and the robot side by side, with the song."""
    config: Path | None = None
    """Settings of every stage in a TOML file; --verbose prints them all. One alone: --contact.tight-speed 0.3."""
    song: SongOptions = field(default_factory=SongOptions)
    file: FileOptions = field(default_factory=FileOptions)
    tell: TellOptions = field(default_factory=TellOptions)

    @property
    def clip(self) -> Path:
        """The clip, where it is one; of several the first."""
        return self.clips[0]

    def numbers(self) -> RetargetConfig:
        """The numbers of every stage: defaults, the file's, what was stated; the later beats the earlier.

        Raises:
            DanceError: a setting that does not exist, or that no setting can have.
        """
        options = {"solver": self.solver, "fps": self.out_fps, "lead_in_s": self.lead_in, "lead_out_s": self.lead_out}
        stated: dict[str, Any] = {
            name: value for name, value in options.items() if value != getattr(RetargetConfig(), name)
        }
        return from_words(replace(from_file(RetargetConfig(), self.config), **stated))


def check_one(args: Arguments) -> None:
    """Refuse what cannot go together for one clip.

    Raises:
        DanceError: options that contradict each other.
    """
    if not file_and_name(args.clip)[0].exists():
        raise ClipError(str(args.clip), found="no such file or folder", expected="a motion file, or a folder of them")
    if args.out is not None and (args.out.suffix != ".npz" or args.out.resolve() == args.clip.resolve()):
        raise OutputError(f"--out {args.out}", found="that name", expected="a new file that ends in .npz")
    if args.film is not None and args.film.suffix != ".mp4":
        raise OutputError(f"--film {args.film}", found="that name", expected="a file that ends in .mp4")
    args.numbers()
    args.song.check()
    halves = [f"--{name}" for name in ("arms", "legs", "keep") if getattr(args, name) is not None]
    if len(halves) > 1:
        raise RetargetError(
            " and ".join(halves), found="several of them", expected="one: the other half is the clip itself",
            cure="join two first (--lead-in 0 --lead-out 0), and give what was written as a clip",
        )  # fmt: skip
    if args.write_contacts is not None and args.write_contacts.exists():
        raise OutputError(
            f"--write-contacts {args.write_contacts}",
            found="a file there, which may be your own",
            expected="a new name",
        )
    edits = args.contacts or args.keys or args.write_contacts
    if args.fit_dynamics and edits:
        raise RetargetError(
            "--fit-dynamics", found="--contacts, --keys or --write-contacts beside it",
            expected="one of them: their seconds would move when the dance is slowed",
        )  # fmt: skip
    if args.fit_dynamics and args.song.given:
        raise RetargetError(
            "--fit-dynamics", found="music beside it", expected="one of them: each changes the pace",
            cure="write the fitted dance to a file first (--lead-in 0 --lead-out 0); a reference (.npz) is a clip again",
        )  # fmt: skip
    if args.ray is not None or args.jobs is not None:
        raise RetargetError(
            "--ray or --jobs", found="one clip", expected="a folder of clips, or a pattern of names",
            cure="leave them out: one clip is one job",
        )  # fmt: skip
    if args.loop < 1:
        raise RetargetError("--loop", found=str(args.loop), expected="at least once")
    asked = {"--then": args.then, "--drop": args.drop, "--loop": args.loop != 1}
    several = [name for name, value in asked.items() if value]
    beside = {
        "--contacts": args.contacts, "--keys": args.keys, "--write-contacts": args.write_contacts,
        "--fit-dynamics": args.fit_dynamics, "music": args.song.given,
    }  # fmt: skip
    if several and any(beside.values()):
        raise RetargetError(
            ", ".join(several), found=f"{', '.join(name for name, value in beside.items() if value)} beside it",
            expected="dances without edits of their own",
            cure="write each dance to a file first, without leads (--lead-in 0 --lead-out 0); a reference (.npz) is a clip again",
        )  # fmt: skip
