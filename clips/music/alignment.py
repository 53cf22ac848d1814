"""A dance brought to a song: a change of pace, never more than is stated, that lands its accents on the beats.

The accents are in order and the song is: so the best times in the song for all of them are the shortest way through a trellis
(Viterbi), whose steps are as long as the pace allows. What an accent is worth falls with its distance from the nearest beat.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.clip import Clip
from clips.edit import warp_time
from clips.errors import ClipError
from clips.music.accents import Accents
from clips.music.beats import Beats
from robot_models.maths import smooth

_STEP_S = 0.005  # of the song's time in the trellis [s]
_LONGEST_S = 0.4  # between two nodes of the dance [s]
_STRONGEST = 3.0  # of the mean, beyond which an accent is worth no more


@dataclass(frozen=True, kw_only=True)
class MusicConfig:
    """How a dance is brought to a song."""

    stretch: float = 0.15  # largest change of pace, faster or slower
    off_beat: float = 0.5  # what an accent half-way between two beats is worth; on the beat: 1
    near_s: float = 0.04  # off the beat by which an accent has lost 40 % of its worth [s]
    steadiness: float = 0.3  # accents a second that the largest change of pace costs
    change_hz: float = 1.0  # how fast the pace may change [Hz]

    def __post_init__(self) -> None:
        if not 0.0 <= self.stretch <= 0.5:
            raise ClipError("stretch", found=f"{self.stretch:g}", expected="0 to 0.5 of the pace", option="stretch")


@dataclass(frozen=True, kw_only=True, eq=False)
class Alignment:
    """Where in the song a dance is."""

    begins_s: float  # of the song, at the dance's first frame [s]
    pace: Float[ndarray, "T"]  # of the recording, at each of its frames


def to_the_beat(
    clip: Clip, accents: Accents, beats: Beats, config: MusicConfig | None = None, *, start_s: float | None = None
) -> tuple[Clip, Alignment]:
    """The same dance at a pace that lands its accents on the song's beats.

    Args:
        clip: a person's or a robot's motion.
        accents: of it.
        beats: of the song.
        config: how far its pace may change.
        start_s: second of the song at which it begins; by default within four beats of the first, where it fits best.

    Raises:
        ClipError: the song ends before the dance.
    """
    config = config or MusicConfig()
    seconds = (clip.frames - 1) / clip.fps
    nodes, worth = _nodes(accents, seconds)
    earliest, latest = _beginnings(beats, start_s)
    if beats.times_s[-1] < earliest + seconds * (1.0 - config.stretch) - 60.0 / beats.bpm:
        raise ClipError(
            str(beats.song or "song"), found=f"beats until {beats.times_s[-1]:.1f} s", option="end",
            expected=f"music for the {seconds:.1f} s of the dance from second {earliest:.1f} on",
        )  # fmt: skip
    landed = _landed(nodes, worth, beats, (earliest, latest), config)
    frames = np.arange(clip.frames) / clip.fps
    # What the trellis gives has corners; a pace that changes slowly has none.
    ahead = smooth(np.interp(frames, nodes, landed - nodes), clip.fps, config.change_hz)
    pace = 1.0 / np.clip(
        1.0 + np.gradient(ahead, 1.0 / clip.fps), 1.0 / (1.0 + config.stretch), 1.0 / (1.0 - config.stretch)
    )
    return warp_time(clip, pace), Alignment(begins_s=float(ahead[0]), pace=pace)


def _beginnings(beats: Beats, start_s: float | None) -> tuple[float, float]:
    if start_s is not None:
        return start_s, start_s
    first = float(beats.times_s[0])
    return max(0.0, first - 60.0 / beats.bpm), first + 3.0 * 60.0 / beats.bpm


def _nodes(accents: Accents, seconds: float) -> tuple[Float[ndarray, "N"], Float[ndarray, "N"]]:
    """Moments of the dance that are placed in the song, from its first to its last, and what each is worth on a beat."""
    fixed = np.unique(
        np.concatenate(([0.0], accents.times_s[(accents.times_s > 0.0) & (accents.times_s < seconds)], [seconds]))
    )
    between = [np.linspace(a, b, int(np.ceil((b - a) / _LONGEST_S)) + 1)[:-1] for a, b in pairwise(fixed)]
    nodes = np.concatenate((*between, [seconds]))
    worth = np.zeros(len(nodes))
    places = np.searchsorted(nodes, accents.times_s).clip(0, len(nodes) - 1)
    worth[places] = np.minimum(accents.strength, _STRONGEST)
    return nodes, worth


def _landed(
    nodes: Float[ndarray, "N"],
    worth: Float[ndarray, "N"],
    beats: Beats,
    begins: tuple[float, float],
    config: MusicConfig,
) -> Float[ndarray, "N"]:
    """The song's time at each node: the best way through the trellis."""
    slowest, fastest = 1.0 / (1.0 - config.stretch), 1.0 / (1.0 + config.stretch)
    last = begins[1] + slowest * nodes[-1] + 1.0
    song = begins[0] + _STEP_S * np.arange(int(np.ceil((last - begins[0]) / _STEP_S)) + 1)
    on_beat = _closeness(song, beats, config)
    value = np.where(song <= begins[1] + 1e-9, worth[0] * on_beat, -np.inf)
    steps_back = []
    for gap, reward in zip(np.diff(nodes), worth[1:], strict=True):
        least, most = int(np.ceil(fastest * gap / _STEP_S - 1e-9)), int(slowest * gap / _STEP_S + 1e-9)
        steps = np.arange(min(least, most), max(least, most) + 1)
        change = (steps * _STEP_S - gap) / max(1e-9, config.stretch * gap)
        options = np.full((len(steps), len(song)), -np.inf)
        for row, (step, much) in enumerate(zip(steps, change, strict=True)):
            options[row, step:] = value[: len(song) - step] - config.steadiness * gap * much**2
        best = options.argmax(axis=0)
        value = options[best, np.arange(len(song))] + reward * on_beat
        steps_back.append(steps[best])
    place = int(value.argmax())
    places = [place]
    for back in reversed(steps_back):
        place -= int(back[place])
        places.append(place)
    return np.asarray(song[places[::-1]])


def _closeness(song: Float[ndarray, "S"], beats: Beats, config: MusicConfig) -> Float[ndarray, "S"]:
    """What an accent at each time of the song is worth: 1 on a beat, less half-way between two, nothing elsewhere."""
    halves = 0.5 * (beats.times_s[1:] + beats.times_s[:-1])

    def near(times: Float[ndarray, "B"]) -> Float[ndarray, "S"]:
        at = np.searchsorted(times, song).clip(1, len(times) - 1) if len(times) > 1 else np.zeros(len(song), dtype=int)
        off = np.minimum(np.abs(song - times[at]), np.abs(song - times[np.maximum(at - 1, 0)]))
        return np.asarray(np.exp(-0.5 * (off / config.near_s) ** 2))

    return np.maximum(near(beats.times_s), config.off_beat * near(halves))
