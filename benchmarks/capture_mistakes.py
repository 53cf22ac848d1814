"""What becomes of recordings with mistakes of capture: mended, refused, told as doubtful, or passed in silence.

    python benchmarks/capture_mistakes.py CLIPS [--rates fps.csv]

Every motion file under CLIPS that can be read is damaged in each way at five severities, then mended and asked what every
clip is asked. `true` counts those that come out within 1 cm and 1 degree of the undamaged clip's own result, on the mean of its
frames, beside what was mended. `undamaged` is the control: the recordings as they are mended, and what their checks say.
Prints rows of a Markdown table; last result in capture_mistakes.md.
"""

from __future__ import annotations

import argparse
import csv
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from clips import Clip, ClipError, HumanClip, ReadOptions, read_clip, repair
from clips.checks import CHECKS, Check, check_facing, check_floor, check_jumps, check_travel
from clips.edit import exchanged_everywhere
from clips.samples import exchanged, tilted, travelling, with_rest

Damage = Callable[[Clip], Clip | None]
Question = Callable[[Clip], Check]
_HEADING = 40.0  # towards which worlds lean [deg]


def main() -> None:
    """Damage, mend, ask, count."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", type=Path)
    parser.add_argument(
        "--rates", type=Path, help="rows of file name, frames per second, for files that do not say theirs"
    )
    args = parser.parse_args()
    clips = dict(_sound(args.clips, args.rates))
    print(f"{len(clips)} recordings, {sum(isinstance(c, HumanClip) for c in clips.values())} of them of people\n")
    print(
        "| mistake | severity | clips | refused | mended | of them true | doubtful | cannot tell | passed in silence |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for kind, severity, damage, question in _mistakes():
        found: dict[str, list[str]] = defaultdict(list)
        for name, clip in clips.items():
            damaged = damage(clip)
            if damaged is not None:
                for outcome in _outcomes(damaged, clip, question):
                    found[outcome].append(name)
        silent = found["silence"]
        who = f" ({', '.join(silent)})" if 0 < len(silent) <= 4 else ""
        told = [len(found[k]) for k in ("clips", "refused", "mended", "true", "doubtful", "cannot tell")]
        print(f"| {kind} | {severity} | {' | '.join(map(str, told))} | {len(silent)}{who} |", flush=True)


def _sound(folder: Path, rates: Path | None) -> Iterator[tuple[str, Clip]]:
    known = dict(csv.reader(rates.read_text().splitlines())) if rates else {}
    for file in sorted(
        p for p in folder.rglob("*") if p.suffix in (".csv", ".bvh", ".pkl", ".npz", ".amc", ".c3d", ".txt")
    ):
        try:
            rate = known.get(file.name)
            yield file.name, repair(read_clip(file, ReadOptions(fps=float(rate) if rate else None)))
        except ClipError:
            continue


def _mistakes() -> Iterator[tuple[str, str, Damage, Question | None]]:
    """Kind, severity, what does it, and the check that it concerns."""
    for question in CHECKS:
        yield f"undamaged: {question.__name__}", "", lambda c: c, question
    for count in (1, 6, 12, 60, 240):
        yield "rest pose before it", f"{count} frames", lambda c, n=count: with_rest(c, n), None
    for count in (1, 12, 60):
        yield "rest pose after it", f"{count} frames", lambda c, n=count: with_rest(c, n, at_the_end=True), None
    for count in (1, 2, 6, 30):
        yield "rest pose amid it", f"{count} frames", lambda c, n=count: _interrupted(c, n), check_jumps
    for factor in (0.7, 0.4, 0.1, 0.01, 0.0):
        yield "root in another unit", f"x {factor:g}", lambda c, f=factor: travelling(c, f), check_travel
    yield "root held over one place", "", lambda c: travelling(c, (0.0, 0.0, 1.0)), check_travel
    for degrees in (2.0, 5.0, 10.0, 20.0, 30.0):
        yield "world leans", f"{degrees:g} deg", lambda c, d=degrees: tilted(c, d, _HEADING), check_floor
    for parts in (("ankle", "toe"), ("wrist",), ("hip", "knee", "ankle", "toe")):
        for seconds in (0.0, 0.1, 0.5, 1.5):
            told = f"{seconds:g} s" if seconds else "1 frame"
            yield f"{' '.join(parts)} exchanged", told, lambda c, p=parts, s=seconds: _flipped(c, p, s), check_facing
        yield f"{' '.join(parts)} exchanged", "throughout", lambda c, p=parts: _flipped(c, p, None), check_facing


def _interrupted(clip: Clip, count: int) -> Clip | None:
    if not isinstance(clip, HumanClip):
        return None
    half = clip.frames // 2
    first = with_rest(replace(clip, positions=clip.positions[:half], orientations=None), count, at_the_end=True)
    assert isinstance(first, HumanClip)
    return replace(first, positions=np.concatenate((first.positions, clip.positions[half:])))


def _flipped(clip: Clip, parts: tuple[str, ...], seconds: float | None) -> Clip | None:
    if not isinstance(clip, HumanClip):
        return None
    there = [p for p in parts if f"left_{p}" in clip.landmarks]
    count = max(1, round((seconds or 0.0) * clip.fps))
    if seconds is not None and count > 0.4 * clip.frames:
        return None
    first = clip.frames // 3
    return exchanged(clip, there, slice(None) if seconds is None else slice(first, first + count))


def _outcomes(damaged: Clip, sound: Clip, question: Question | None) -> set[str]:
    """What happened to one clip: one of the outcomes, and whether what was mended is true."""
    if isinstance(damaged, HumanClip) and exchanged_everywhere(damaged):
        return {"clips", "refused"}
    try:
        mended = repair(damaged)
    except ClipError:
        return {"clips", "refused"}
    if len(mended.source.repairs) > len(sound.source.repairs):
        return {"clips", "mended"} | ({"true"} if _same(mended, sound) else set())
    verdict = question(mended).verdict if question else "holds"
    return {"clips", "silence" if verdict == "holds" else verdict}


def _same(a: Clip, b: Clip) -> bool:
    """Within 1 cm and 1 degree on the mean, up to where it begins."""
    if a.frames != b.frames:
        return False
    if isinstance(a, HumanClip) and isinstance(b, HumanClip):
        off = (a.positions - a.positions[:1, :1]) - (b.positions - b.positions[:1, :1])
        return float(np.linalg.norm(off, axis=-1).mean()) < 0.01
    off = (a.root_pos - a.root_pos[:1]) - (b.root_pos - b.root_pos[:1])
    turned = 2.0 * np.arccos(np.clip(np.abs(np.sum(a.root_quat * b.root_quat, axis=1)), 0.0, 1.0))
    apart = float(np.abs(a.joint_pos - b.joint_pos).max())
    return (
        float(np.linalg.norm(off, axis=-1).mean()) < 0.01
        and np.degrees(turned.mean()) < 1.0
        and apart < np.radians(1.0)
    )


if __name__ == "__main__":
    main()
