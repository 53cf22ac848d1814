"""Music: the beats of a song, the accents of a dance, and the change of pace that brings one to the other."""

from clips.music.accents import Accents, find_accents, parts_of, robot_parts
from clips.music.alignment import Alignment, MusicConfig, to_the_beat
from clips.music.beats import Beats, check_tempo, read_beats, steady_beats
from clips.music.music import BeatError, Music, beat_error, music_of
from clips.music.song import duration_of, find_beats, loudness

__all__ = [
    "Accents",
    "Alignment",
    "BeatError",
    "Beats",
    "Music",
    "MusicConfig",
    "beat_error",
    "check_tempo",
    "duration_of",
    "find_accents",
    "find_beats",
    "loudness",
    "music_of",
    "parts_of",
    "read_beats",
    "robot_parts",
    "steady_beats",
    "to_the_beat",
]
