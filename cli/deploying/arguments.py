"""The options of `dance-deploy`, and which of them cannot go together."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from cli.shell import (
    ClipPath,
    TellOptions,
    recording_name,
)
from tracking import TrackingError

_LONGEST = 600.0  # of a stand [s]


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Run a policy bundle over Unitree's DDS messages: damping, stand, dance, stand, damping.

    By default nothing is sent: states are read, commands computed and counted. With --rehearse a simulated robot answers
    on this machine's loopback, in a process of its own. A real robot needs --interface, --send and --i-stand-clear, a
    gantry, a remote in somebody's hand, and docs/robot.md read to its end.

    Enter or Ctrl-C stops at any time, and so do the remote's select and every signal that ends programs: damping, and
    nothing else until the command is given again. A second process damps when this one dies.

    Examples:
        dance-deploy groove-g1 --rehearse
        dance-deploy groove-g1 --rehearse --loops 4 --recording rehearsal.rrd --json rehearsal.json
        dance-deploy groove-g1 --rehearse --fault battery
        dance-deploy tracker-g1 --ref dance_g1.npz --rehearse
        dance-deploy tracker-g1 --dance groove --rehearse
        dance-deploy bundle --music song.mp3 --rehearse
        dance-deploy groove-g1 --interface eth0
        dance-deploy groove-g1 --interface eth0 --send --i-stand-clear
    """

    bundle: ClipPath
    """Folder of the bundle, or groove-g1; or a tracker of ours, with --ref or --dance: tracker-g1."""
    ref: Path | None = None
    """What a tracker shall follow: any reference of its robot."""
    dance: str | None = None
    """The same by the name of a dance that the tracker knows; any other name tells which there are."""
    rehearse: bool = False
    """Start a simulated robot on loopback, and send to it."""
    interface: str = "lo"
    """Network interface of the robot; lo, loopback, is this machine alone."""
    send: bool = False
    """Really send commands."""
    i_stand_clear: bool = False
    """Nobody is within the robot's reach, and somebody has the remote in hand: needed before anything is sent."""
    uncertified: bool = False
    """Send without a certificate (dance-certify) of this very policy."""
    loops: int = 1
    """Dances, with a stand between them; 0: the stand alone."""
    stand: float = 1.0
    """How long each stand lasts [s]."""
    music: Path | None = None
    """A song to be played here while the robot dances (WAV, FLAC, OGG, MP3); it begins as the reference says, else with the
    dance."""
    music_at: float | None = None
    """Second of the dance at which it begins instead; below 0: so much of it is skipped."""
    music_late: float | None = None
    """What the loudspeaker is late by, in seconds; default: what its driver says."""
    fault: str = ""
    """Something that goes wrong in the rehearsal, to see what becomes of it: tilt, battery, remote, silence, ..."""
    fault_after: float = 4.0
    """When, after the robot was first told to be stiff [s]."""
    recording: Path | None = None
    """Write a Rerun recording of the rehearsal here."""
    tell: TellOptions = field(default_factory=TellOptions)


def check(args: Arguments) -> None:
    """Refuse what cannot go together.

    Raises:
        TrackingError: options that contradict each other, or commands to a robot without a confirmation.
    """
    from tracking.deploy import FAULTS

    recording_name(args.recording)
    if args.music is not None and not args.music.is_file():
        raise TrackingError(f"--music {args.music}", found="no such file", expected="a song")
    if args.music is None and (args.music_at is not None or args.music_late is not None):
        raise TrackingError("--music-at or --music-late", found="no music", expected="--music SONG")
    if args.rehearse and args.interface != "lo":
        raise TrackingError(
            "--rehearse", found=f"--interface {args.interface}", expected="a rehearsal on loopback alone"
        )
    if args.send and args.interface != "lo" and not args.i_stand_clear:
        raise TrackingError(
            "--send", found=f"commands to whatever is on {args.interface}",
            expected="the word of somebody who stands by, clear of the robot, with its remote in hand: --i-stand-clear",
        )  # fmt: skip
    if args.fault and (args.fault not in FAULTS or not args.rehearse):
        raise TrackingError(
            "--fault", found=f"{args.fault}{'' if args.rehearse else ' without a rehearsal'}",
            expected=f"--rehearse, and one of {', '.join(FAULTS)}",
        )  # fmt: skip
    if args.recording is not None and not args.rehearse:
        raise TrackingError(
            "--recording", found="no rehearsal", expected="--rehearse: a real robot has no cameras here"
        )
    if args.loops < 0 or not (0.0 < args.stand < _LONGEST and 0.0 <= args.fault_after < _LONGEST):
        found = f"{args.loops}, {args.stand}, {args.fault_after}"
        raise TrackingError(
            "--loops, --stand, --fault-after", found=found, expected="positive numbers of dances and seconds"
        )
