"""A dance brought to a robot and to a song: at a pace that lands its accents on the beats, as far as the motors go along."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips import Clip, MetricKey, Reference, read_clip, repair
from clips.edit import recentre, resample
from clips.music import (
    Accents,
    BeatError,
    Beats,
    Music,
    MusicConfig,
    beat_error,
    find_accents,
    loudness,
    robot_parts,
    to_the_beat,
)
from retarget.config import RetargetConfig
from retarget.pipeline import Retargeted, retarget
from retarget.report import beat_metrics
from retarget.targets import ContactEdit, KeyFrame
from robot_models import RobotModel, load_robot
from robot_models.maths import Progress, silent

_SHARES = (1.0, 0.5, 0.25)  # of the change of pace that is allowed, tried one after another while a gate is lost


def retarget_to_music(
    clip: Clip | Path | str,
    robot: RobotModel | str,
    beats: Beats,
    config: RetargetConfig | None = None,
    music: MusicConfig | None = None,
    *,
    start_s: float | None = None,
    contacts: Sequence[ContactEdit] = (),
    keys: Sequence[KeyFrame] = (),
    progress: Progress = silent,
) -> Retargeted:
    """Retarget a dance at the pace of a song.

    It is brought to the robot as it was recorded first, since the accents that people see are the robot's: on a fast dance half of
    them are 50 ms and more off the person's. Then again at the pace that lands them on the beats. Where that misses a gate which
    held before, half and a quarter of the change of pace are tried.

    The reference knows its song: `clips.music.music_of(reference)`. Its report has the beat error beside that of the dance at its
    recorded pace, begun where that fits best.

    Args:
        clip: what is danced, or a file that says everything about itself.
        robot: who shall dance it, or its name.
        beats: of the song.
        config: the numbers of every stage.
        music: how far the pace may change.
        start_s: second of the song at which the dance begins; None: where it fits best within four beats of the first.
        contacts: touches, in seconds of the dance at its new pace.
        keys: joint angles, likewise.
        progress: told as the solver goes on.

    Raises:
        DanceError: as for `retarget`; the song ends before the dance.
    """
    config, music = config or RetargetConfig(), music or MusicConfig()
    clip = read_clip(clip) if isinstance(clip, Path | str) else clip
    robot = load_robot(robot) if isinstance(robot, str) else robot
    recorded = recentre(resample(repair(clip), config.fps))
    as_recorded = retarget(recorded, robot, config, progress=progress)
    accents = _accents(as_recorded)
    _, unpaced = to_the_beat(recorded, accents, beats, replace(music, stretch=0.0), start_s=start_s)
    recorded_error = beat_error(accents, beats.times_s - unpaced.begins_s, recorded.frames / recorded.fps)
    held = {m.key for m in as_recorded.report.metrics if m.passed}
    best: tuple[int, Retargeted] | None = None
    for share in _SHARES:
        how = replace(music, stretch=share * music.stretch)
        paced, where = to_the_beat(recorded, accents, beats, how, start_s=start_s)
        result = retarget(paced, robot, config, contacts=contacts, keys=keys, progress=progress)
        lost = sum(m.key in held for m in result.report.failures)
        if best is None or lost < best[0]:
            best = lost, _with_music(result, _beside(result.reference, beats, where.begins_s), recorded_error)
        if not lost:
            break
    assert best is not None
    told = {m.key: m.value for m in best[1].report.metrics}
    worse = MetricKey.BEAT_ERROR in told and told[MetricKey.BEAT_ERROR] > told[MetricKey.BEAT_ERROR_RECORDED]
    if worse and not (contacts or keys):  # no change of pace is better than one that helps nobody
        return _with_music(as_recorded, _beside(as_recorded.reference, beats, unpaced.begins_s), recorded_error)
    return best[1]


def _curves(reference: Reference, accents: Accents, music: Music) -> dict[str, Float[ndarray, "T"]]:
    """To be looked at: pulses of the beats, and of the dance's accents; how loud the song is."""
    time = np.arange(reference.frames) / reference.fps
    at_s = accents.times_s + reference.dance.start / reference.fps
    curves = {
        "beats of the song": _pulses(time, music.beats_s, np.ones(len(music.beats_s))),
        "accents of the dance": _pulses(time, at_s, accents.strength),
    }
    heard = loudness(Path(music.song), time - music.song_at_s) if music.song else None
    return curves if heard is None else {**curves, "loudness of the song": heard}


def _pulses(time: Float[ndarray, "T"], at_s: Float[ndarray, "N"], height: Float[ndarray, "N"]) -> Float[ndarray, "T"]:
    out = np.zeros(len(time))
    frames = np.searchsorted(time, at_s).clip(0, len(time) - 1)
    out[frames] = height
    return out


def _accents(result: Retargeted) -> Accents:
    """Of the robot's dance, without its leads."""
    reference = result.reference
    return find_accents(robot_parts(result.robot, reference.qpos[reference.dance]), reference.fps)


def _beside(reference: Reference, beats: Beats, begins_s: float) -> Music:
    """The song in the reference's time: at its first dance's first frame the song is at `begins_s`."""
    song_at_s = reference.dance.start / reference.fps - begins_s
    times = beats.times_s + song_at_s
    return Music(
        beats_s=times[(times >= 0.0) & (times <= reference.duration_s)], song_at_s=song_at_s,
        song="" if beats.song is None else str(beats.song), source=beats.source,
    )  # fmt: skip


def _with_music(result: Retargeted, music: Music, recorded: BeatError | None) -> Retargeted:
    reference, dance, accents = result.reference, result.reference.dance, _accents(result)
    first_s, last_s = dance.start / reference.fps, (dance.stop - 1) / reference.fps
    danced = beat_error(accents, music.beats_s - first_s, last_s - first_s)
    report = replace(
        result.report,
        metrics=(*result.report.metrics, *beat_metrics(danced, recorded)),
        series={**result.report.series, **_curves(reference, accents, music)},
    )
    meta = {**reference.meta, "music": music.as_meta(), "report": report.as_dict()}
    return replace(result, reference=replace(reference, meta=meta), report=report)
