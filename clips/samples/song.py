"""A song that nobody plays: drums, a bass and chords at tempi that are known. Everything is computed."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy import ndarray
from scipy.io import wavfile

RATE = 22_050  # samples a second
FIRST_S = 0.6  # the first beat [s]


def beats_of(*tempi: tuple[float, int]) -> ndarray:
    """Beats of (beats a minute, bars of four) one after another [s]."""
    gaps = [60.0 / bpm for bpm, bars in tempi for _ in range(4 * bars)]
    return FIRST_S + np.concatenate(([0.0], np.cumsum(gaps)))


def write_song(path: Path, beats: ndarray, seed: int = 0) -> Path:
    """A WAV with a drum on every beat, hats between, a bass and a chord a bar."""
    rng, sound = np.random.default_rng(seed), np.zeros(int((beats[-1] + 1.0) * RATE))

    def put(at_s: float, wave: ndarray) -> None:
        first = int(at_s * RATE)
        sound[first : first + len(wave)] += wave[: max(0, len(sound) - first)]

    t = np.arange(int(0.35 * RATE)) / RATE
    kick = np.sin(2 * np.pi * (50 * t + 2.7 * (1 - np.exp(-30 * t)))) * np.exp(-14 * t)
    snare = 0.5 * rng.standard_normal(len(t)) * np.exp(-22 * t)
    hat = 0.15 * rng.standard_normal(len(t)) * np.exp(-90 * t)
    for k, (beat, after) in enumerate(pairwise(beats)):
        put(beat, kick if k % 2 == 0 else snare)
        put(beat, hat)
        put(0.5 * (beat + after), hat)
        root = 55.0 * 2.0 ** ((0, 9, 5, 7)[k // 4 % 4] / 12)
        put(beat, 0.2 * np.sin(2 * np.pi * root * t) * np.exp(-3 * t))
        if k % 4 == 0:
            bar = np.arange(int(4 * (after - beat) * RATE)) / RATE
            chord = sum(np.sin(2 * np.pi * 4 * root * ratio * bar) for ratio in (1.0, 1.26, 1.5))
            put(beat, 0.1 * chord * np.minimum(1.0, 50 * bar) * np.exp(-0.8 * bar))
    wavfile.write(path, RATE, (30000 * sound / np.abs(sound).max()).astype(np.int16))
    return path
