"""What a retargeting came to: the verdict, a diagnosis of every gate that does not hold, and what to type next."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from cli.retargeting.arguments import Arguments
from cli.shell import Trouble, Verdict, again, flag, line
from clips import Clip, MetricKey
from clips.checks import Check
from clips.music import Music, music_of
from retarget import Cure, Diagnosis, Report, Retargeted, Transition, flight_fit, hardest_stretches

_OFF_FLIGHT_M = 0.03  # of a flight's rise from gravity's that is worth a line
_LONGEST_FLIGHT_S = 0.8  # beyond it feet hover, which a gate tells
_LIKELY = 80.0, 160.0  # beats a minute; what is found elsewhere may be half or twice the tempo
_EASE = 0.95  # of the speed at which a limit would just hold
_SLOWEST = 0.25  # of the pace, below which another robot is meant, or a mistaken profile


@dataclass(frozen=True, kw_only=True)
class Danced:
    """One dance of a reference: what was read, from where on."""

    path: Path
    clip: Clip  # as it is danced
    doubts: tuple[Check, ...]  # of the recording, before it was slowed or mirrored
    fps: float  # of the file
    start_s: float = 0.0  # of the clip's file
    misses_s: float = 0.0  # of the stretch that was asked for, after the file's end


def verdict_of(
    result: Retargeted,
    transitions: Sequence[Transition],
    dances: Sequence[Danced],
    args: Arguments,
    written: Sequence[Path],
) -> Verdict:
    """The verdict on a reference.

    Args:
        result: with its report.
        transitions: from each dance to the next.
        dances: of the reference, in order.
        args: what was asked for.
        written: files, the reference first.
    """
    report, reference = result.report, result.reference
    troubles = _without_echoes([_trouble(diagnosis, dances, args) for diagnosis in result.diagnoses])
    said = (
        f"{' + '.join(dict.fromkeys(d.path.name for d in dances))} on {result.robot.name}, {reference.duration_s:.1f} s"
    )
    state = (
        "every gate holds"
        if report.passed
        else f"{len(troubles)} of {_gates(report)} gates missed; it is written all the same"
    )
    look = [(line("rerun", path), "look at it") for path in written if path.suffix == ".rrd"]
    if args.song.music is not None and args.film is None:
        look.append((line("dance-play", written[0], "--film", written[0].with_suffix(".mp4")), "a film with the song"))
    train = [
        (line("dance-train", "--ref", written[0], "--check-ref"), "is it worth training on? seconds"),
        (line("dance-train", "--ref", written[0]), "a policy that dances it"),
    ]
    return Verdict(
        passed=report.passed,
        line=f"{said}: {state}",
        numbers=_numbers(result),
        notes=(
            *dict.fromkeys(_convention(d) for d in dances),
            *_changed(args),
            *_danced_to(music_of(reference), reference.dance.start / reference.fps),
            *map(str, transitions),
        ),
        doubts=tuple(dict.fromkeys(doubt for dance in dances for doubt in _doubts(dance))),
        troubles=troubles,
        written=tuple(written),
        steps=(*look, *(train if report.passed else ())),
        data={"robot": result.robot.name, "frames": reference.frames, "fps": reference.fps, "report": report.as_dict()},
    )


def _gates(report: Report) -> int:
    return sum(m.limit is not None for m in report.metrics)


def _numbers(result: Retargeted) -> tuple[str, ...]:
    value = {m.key: m.value for m in result.report.metrics}
    said = [
        f"limbs {value[MetricKey.LIMB_DIRECTION_ERROR]:.1f} deg off the person's",
        f"standing feet slide {value[MetricKey.SLIDE_WORST]:.1f} mm at most",
    ]
    if MetricKey.IMPOSSIBLE_FRAMES in value:
        hard = value[MetricKey.IMPOSSIBLE_FRAMES]
        allowed = math.floor(10.0 * (100.0 - hard)) / 10.0
        worst = (
            ""
            if result.dynamics is None
            else f" (worst at {result.dynamics.score.argmax() / result.dynamics.fps:.1f} s)"
        )
        said.append(f"physics allows {allowed:.3g} % of the frames{worst}" if hard else "physics allows every frame")
    if MetricKey.BEAT_ERROR in value:
        said.append(_on_the_beat(value))
    return tuple(said)


def _on_the_beat(value: Mapping[MetricKey, float]) -> str:
    return (
        f"an accent on {value[MetricKey.ON_BEAT]:.0f} % of the beats, {value[MetricKey.BEAT_ERROR]:.0f} ms off (median); at the "
        f"recorded pace {value[MetricKey.ON_BEAT_RECORDED]:.0f} %, {value[MetricKey.BEAT_ERROR_RECORDED]:.0f} ms"
    )


def _convention(dance: Danced) -> str:
    """What was recognised, in a line, with what was changed."""
    source = dance.clip.source
    kept = [f"{f.what} {f.value}" for f in source.findings if f.option and f.what != "fps"]
    mended = [f"mended: {r}" for r in source.repairs]
    return "; ".join([f"{dance.path.name}: {source.dialect}", f"{dance.fps:.6g} fps", *kept, *mended])


def _changed(args: Arguments) -> list[str]:
    """What was asked to be another way than it was recorded."""
    mirrored = ["left and right exchanged, as asked for (--mirror)"] if args.mirror else []
    return [*mirrored, *([f"{args.speed:g} times as fast as recorded (--speed)"] if args.speed != 1.0 else [])]


def _danced_to(music: Music | None, begins_s: float) -> list[str]:
    """Which beats, and where in the song."""
    if music is None or (bpm := music.bpm) is None:
        return []
    song = Path(music.song).name or "beats"
    told = f"danced to {song}: {bpm:.1f} beats a minute, {music.source}; begins at second {begins_s - music.song_at_s:.1f} of it"
    twice = music.source == "found in it" and not _LIKELY[0] <= bpm <= _LIKELY[1]
    other = 2.0 * bpm if bpm < _LIKELY[0] else 0.5 * bpm
    return [f"{told}{f'; where it is {other:.0f}: --bpm {other:.0f}' if twice else ''}"]


def _doubts(dance: Danced) -> list[str]:
    """What was taken for granted, and what the recording itself makes doubtful."""
    assumed = [
        f"{f.what} {f.value} is assumed ({f.why}){f'; {flag(f.option)} states it' if f.option else ''}"
        for f in dance.clip.source.findings
        if f.confidence == "assumed"
    ]
    own_rate = any(f.what == "stated rate" for f in dance.clip.source.findings)  # the file's own is nearer than a guess
    asked = [
        f"{check}{f'; {flag(check.option)} {check.suggestion} states it' if check.option else ''}"
        for check in dance.doubts
        if not (own_rate and check.option == "fps")
    ]
    shorter = [f"the clip ends {dance.misses_s:.1f} s before --end"] if dance.misses_s else []
    return [f"{dance.path.name}: {doubt}" for doubt in (*shorter, *assumed, *asked)]


def _trouble(diagnosis: Diagnosis, dances: Sequence[Danced], args: Arguments) -> Trouble:
    dance = dances[min(diagnosis.dance, len(dances) - 1)]
    edited = (
        args.then or args.loop != 1 or args.fit_dynamics or args.contacts or args.keys or args.song.given
    )  # the clip's seconds are elsewhere
    alone = not edited
    cures = (_cure(cure, diagnosis, dance, args) for cure in diagnosis.cures if alone or not cure.stretches)
    clip_s = dance.start_s + diagnosis.at_s * args.speed
    where = (
        f"; in {dance.path.name} that is second {clip_s:.1f}"
        if diagnosis.metric.where and not args.fit_dynamics
        else ""
    )
    return Trouble(what=f"{diagnosis}{where}", cures=tuple(c for c in cures if c is not None))


def _without_echoes(troubles: Sequence[Trouble]) -> tuple[Trouble, ...]:
    """Every cure once: gates that fail for one reason have one cure."""
    told, out = set[tuple[str, str]](), []
    for trouble in troubles:
        out.append(replace(trouble, cures=tuple(c for c in trouble.cures if c not in told)))
        told |= set(trouble.cures)
    return tuple(out)


def _cure(cure: Cure, diagnosis: Diagnosis, dance: Danced, args: Arguments) -> tuple[str, str] | None:
    """What to do, and the command that does it."""

    def seconds(t: float) -> float:
        return dance.start_s + t * args.speed

    metric = diagnosis.metric
    if cure.help == "drop":
        more = [f"{math.floor(10 * seconds(a)) / 10:g}-{math.ceil(10 * seconds(b)) / 10:g}" for a, b in cure.stretches]
        return "leave it out", again({"--drop": " ".join([*args.drop, *more])})
    if cure.help == "keep":
        (a, b), *_ = cure.stretches
        return "keep the longest part without it", again({"--start": f"{seconds(a):.1f}", "--end": f"{seconds(b):.1f}"})
    if cure.help == "slower":
        power = 0.5 if metric.key is MetricKey.ACCELERATION_SHARE else 1.0
        speed = args.speed * _EASE * (float(metric.limit or 1.0) / metric.value) ** power
        if speed < _SLOWEST:
            return "no pace is slow enough for these motors: what does its profile say of them?", line(
                "dance-robot", "check", args.robot
            )
        return ("slower", again({"--speed": f"{speed:.2f}"})) if speed < args.speed else None
    if cure.help == "feet carry":
        return "make its way from the feet that stand", again({"--travel": "from-feet"})
    if cure.help == "whole clip":
        return ("all frames at once", again({"--solver": "whole-clip"})) if args.solver != "whole-clip" else None
    if cure.help == "lead in":
        longer = {
            flag: f"{2 * max(value, 0.5):g}"
            for flag, value in (("--lead-in", args.lead_in), ("--lead-out", args.lead_out))
        }
        return "more time to get there and back", again(longer)
    if cure.help == "state contacts":
        if args.contacts is not None:
            return None
        said = "see what was taken for a touch, edit it, and give it back with --contacts"
        return said, again({"--write-contacts": "touches.csv"})
    return "no option mends it: take another recording", ""


def details_of(result: Retargeted, dances: Sequence[Danced]) -> list[str]:
    """What was recognised and what physics says, line by line."""
    lines = []
    for dance in {d.path: d for d in dances}.values():
        source = dance.clip.source
        lines.append(f"{dance.path.name}: {source.dialect}, {dance.clip.frames} frames at {dance.clip.fps:.6g} fps")
        lines += [f"  {finding}" for finding in source.findings]
        lines += [f"  repaired: {mended}" for mended in source.repairs]
    if result.dynamics is None:
        return lines
    lines += [f"physics: {stretch}" for stretch in hardest_stretches(result.dynamics, above=1.0, most=3)]
    return lines + [
        f"flight from {f.start_s:.2f} to {f.end_s:.2f} s rises {100 * f.rise:.0f} cm; gravity asks for "
        f"{100 * f.ballistic_rise:.0f} cm in that time"
        for f in flight_fit(result.dynamics)
        if abs(f.rise - f.ballistic_rise) > _OFF_FLIGHT_M and f.end_s - f.start_s <= _LONGEST_FLIGHT_S
    ]
