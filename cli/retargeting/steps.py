"""The steps of one `dance-retarget`: read what is danced, retarget it, write it."""

from __future__ import annotations

from pathlib import Path

from cli.retargeting.arguments import Arguments
from cli.retargeting.stretches import refuse_beyond, stretches
from cli.retargeting.verdict import Danced
from cli.shell import make_folder, progress
from clips import Clip, at_speed, clip_stem, cut, read_clip, read_of_several, repair, save_reference
from clips.checks import Check, check_sway, doubts
from clips.edit import left_out_at_start
from retarget import (
    Retargeted,
    RetargetError,
    Transition,
    fit_to_dynamics,
    read_contacts,
    read_keys,
    retarget,
    retarget_sequence,
    retarget_to_music,
    write_contacts,
)
from retarget.targets import join_halves, mirrored, with_standing_legs
from robot_models import RobotModel
from robot_models.maths import Progress


def read_dances(args: Arguments) -> list[Danced]:
    """What is danced, in order.

    Raises:
        DanceError: a clip that cannot be read, or nothing is left of it.
    """
    parts = [_read(args.clip, args, *stretch) for stretch in stretches(args)]
    found = [part for part in (*parts, *(_read(path, args) for path in args.then)) if part is not None]
    if not found:
        raise RetargetError(f"--drop {' '.join(args.drop)}", found="nothing left", expected="something to dance")
    return found * args.loop


def _read(path: Path, args: Arguments, start: float = 0.0, end: float | None = None) -> Danced | None:
    whole = read_clip(path, args.file.reading())
    if start and args.drop and start >= (whole.frames - 1) / whole.fps:
        return None  # what is dropped reaches beyond its end
    refuse_beyond(args, end, (whole.frames - 1) / whole.fps)
    recorded = repair(cut(whole, start, end), strict=args.file.strict)
    clip = at_speed(recorded, args.speed)
    misses_s = max(0.0, end - whole.frames / whole.fps) if end is not None else 0.0
    danced = _of_halves(mirrored(clip) if args.mirror else clip, args)
    told, begins = _doubts(whole, recorded), start + left_out_at_start(recorded)
    return Danced(path=path, clip=danced, doubts=told, fps=recorded.fps, start_s=begins, misses_s=misses_s)


def _of_halves(clip: Clip, args: Arguments) -> Clip:
    """The clip with the half that is asked for from another, or with legs that stand."""
    if args.keep is not None:
        return with_standing_legs(clip)
    other = args.arms or args.legs
    if other is None:
        return clip
    half = repair(read_of_several(other, args.file.reading()), strict=args.file.strict)
    return join_halves(clip, half) if args.arms is not None else join_halves(half, clip)


def _doubts(whole: Clip, danced: Clip) -> tuple[Check, ...]:
    """Of what is danced; of the rate the whole recording knows more."""
    rate = check_sway(whole)
    others = [check for check in doubts(danced) if check.what != rate.what]
    return (*others, *([rate] if rate.verdict == "doubtful" else []))


def solve_dances(
    dances: list[Danced], robot: RobotModel, args: Arguments, follow: Progress
) -> tuple[Retargeted, list[Transition]]:
    """One dance, or several with steps between them.

    Raises:
        DanceError: the clips cannot be used; a poor result is no error.
    """
    clips, config = [dance.clip for dance in dances], args.numbers()
    if len(clips) > 1:
        return retarget_sequence(clips, robot, config, progress=follow)
    if args.fit_dynamics:
        return fit_to_dynamics(clips[0], robot, config, progress=follow), []
    contacts = read_contacts(args.contacts) if args.contacts else ()
    keys = read_keys(args.keys) if args.keys else ()
    if not args.song.given:
        return retarget(clips[0], robot, config, contacts=contacts, keys=keys, progress=follow), []
    result = retarget_to_music(
        clips[0], robot, args.song.find(follow), config, args.song.config(),
        start_s=args.song.music_start, contacts=contacts, keys=keys, progress=follow,
    )  # fmt: skip
    return result, []


def save_result(result: Retargeted, dances: list[Danced], args: Arguments) -> list[Path]:
    """Reference, touches and recording, as asked for; the files."""
    name, robot = "_".join(dict.fromkeys(clip_stem(dance.path) for dance in dances)), result.robot.name
    written = [args.out or Path(f"{name}_{'again' if name.endswith(f'_{robot}') else robot}.npz")]
    make_folder(written[0])
    save_reference(result.reference, written[0], float32=args.float32)
    if args.write_contacts:
        write_contacts(result.reference, args.write_contacts)
        written.append(args.write_contacts)
    if args.recording:
        written.append(result.save(written[0].with_suffix(".rrd")))
    if args.film is not None:
        make_folder(args.film)
        with progress("frames") as follow:
            written.append(result.save(args.film, progress=follow))
    return written
