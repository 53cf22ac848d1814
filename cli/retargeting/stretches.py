"""Which seconds of a clip are danced."""

from __future__ import annotations

from cli.retargeting.arguments import Arguments
from retarget import RetargetError


def stretches(args: Arguments) -> list[tuple[float, float | None]]:
    """Seconds of the clip that are danced, (start, end), in order; an end of None is the clip's.

    Raises:
        RetargetError: what shall be dropped is no stretch of seconds, or everything.
    """
    if not args.drop:
        return [(args.start, args.end)]
    kept, at = list[tuple[float, float | None]](), args.start
    for a, b in sorted(map(_seconds, args.drop)):
        if a > at:
            kept.append((at, a))
        at = max(at, b)
    if args.end is None or at < args.end:
        kept.append((at, args.end))
    kept = [
        (a, b if args.end is None or b is None else min(b, args.end))
        for a, b in kept
        if args.end is None or a < args.end
    ]
    if not kept:
        raise RetargetError(f"--drop {' '.join(args.drop)}", found="nothing left", expected="something to dance")
    return kept


def refuse_beyond(args: Arguments, end: float | None, length_s: float) -> None:
    """Refuse to drop what a clip of so many seconds does not have; `end` is where one of its stretches ends.

    Raises:
        RetargetError: it ends where the clip is over.
    """
    if args.drop and end is not None and end != args.end and end > length_s:
        raise RetargetError(
            f"--drop {' '.join(args.drop)}", found=f"a clip of {length_s:.1f} s", expected="seconds inside it"
        )


def _seconds(stretch: str) -> tuple[float, float]:
    """`13.8-14.3` as numbers."""
    try:
        start, end = map(float, stretch.split("-"))
    except ValueError:
        start, end = 0.0, 0.0
    if not 0.0 <= start < end < float("inf"):
        raise RetargetError(f"--drop {stretch}", found="no stretch of seconds", expected="start-end, as 13.8-14.3")
    return start, end
