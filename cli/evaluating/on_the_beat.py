"""How near a dance that was simulated is to the beats of its song."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tracking import Bundle, Evaluation


def on_the_beat(bundle: Bundle, results: Mapping[str, Evaluation]) -> list[str]:
    """How near the best robot's accents are to the beats of the song that its reference was made for."""
    from clips.music import beat_error, find_accents, music_of, robot_parts

    music, fps = music_of(bundle.reference), bundle.reference.fps
    if music is None:
        return []
    lines, begins_s = [], bundle.reference.dance.start / fps
    for engine, result in results.items():
        path = next(iter(result.shown.values()))
        error = beat_error(
            find_accents(robot_parts(bundle.robot, path), fps), music.beats_s - begins_s, len(path) / fps
        )
        if error is None:
            continue
        share, off = 100 * error.on_beat, error.median_ms
        told = {key: measured["value"] for key, measured in bundle.reference.report.items()}
        meant = (
            f"; its reference {told['beats_with_an_accent']:.0f} %, {told['beat_error_median']:.0f} ms"
            if "beat_error_median" in told
            else ""
        )
        lines.append(
            f"{engine}: an accent of the best robot on {share:.0f} % of the beats, {off:.0f} ms off (median){meant}"
        )
    return lines
