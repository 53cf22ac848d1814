"""How a body sways over its feet: a pendulum made by hand has its ratio, at any rate; what does not sway tells nothing."""

import dataclasses

import numpy as np
import pytest
from person import ANKLE, person, standing_feet

from clips.checks import check_sway, likely_rate, sway_ratio

FPS = 60.0


def test_who_swings_like_a_hanging_pendulum_stands_on_no_foot():
    frames = round(8.0 * FPS)
    ankles, toes = standing_feet(frames)
    for points in (ankles, toes):
        points[:, 1, 2] += 0.2  # the right foot is up
    middle = np.tile([0.1, 0.1, ANKLE], (frames, 1))
    middle[:, 1] += 0.03 * np.sin(2 * np.pi * 0.6 * np.arange(frames) / FPS)
    assert sway_ratio(person(ankles, toes, FPS, middle=middle)) is None


def test_a_pendulum_on_its_head_is_seen_at_any_rate():
    def falling(fps):
        """Over the left foot pulled away from it, g/h times the distance; pushed back while both feet are down."""
        t = np.arange(round(9.6 * fps)) / fps
        phase = t % 1.2
        ankles, toes = standing_feet(len(t))
        for points in (ankles, toes):
            points[:, 1, 2] += 0.2 * ((phase > 0.3) & (phase < 0.9))
        middle = np.tile([0.1, 0.1, ANKLE], (len(t), 1))
        middle[:, 1] += 0.02 * np.cosh(np.sqrt(9.81) * (phase - 0.6))
        return person(ankles, toes, fps, middle=middle)

    ratios = [sway_ratio(falling(fps)) for fps in (50.0, 100.0)]
    assert all(ratio is not None for ratio in ratios)
    assert ratios[0] == pytest.approx(ratios[1], rel=0.15)
    played = falling(100.0)
    assert sway_ratio(dataclasses.replace(played, fps=50.0)) > 1.5 * ratios[1]
    assert check_sway(played).verdict == "holds"
    half = check_sway(dataclasses.replace(played, fps=50.0))
    assert (half.verdict, half.option, half.suggestion) == ("doubtful", "fps", "100")


def test_who_stands_still_on_two_feet_tells_nothing():
    still = person(*standing_feet(200))
    assert sway_ratio(still) is None and check_sway(still).verdict == "cannot tell"


@pytest.mark.parametrize(
    ("ratios", "rate"),
    [
        ({30.0: 1.6, 60.0: 0.8, 120.0: 0.4}, 60.0),
        ({30.0: 0.85, 60.0: 0.45}, 30.0),
        ({30.0: None, 60.0: None}, None),
        ({30.0: 1.3, 60.0: None}, None),  # not clear
        ({}, None),
    ],
)
def test_the_rate_that_is_nearest_is_named_if_it_is_near(ratios, rate):
    assert likely_rate(ratios) == rate


@pytest.mark.slow
def test_rates_that_are_named_are_right(shared):
    from damage import RATES

    from clips import ClipError, read_clip

    named = wrong = 0
    for path in sorted((shared / "csv").rglob("*.csv")):
        file = str(path.relative_to(shared))
        true = next((rate for name, rate in RATES.items() if file.startswith(name)), None)
        try:
            read_clip(path)
        except ClipError as e:
            named += bool(e.suggestion)
            wrong += bool(e.suggestion) and float(e.suggestion) != true
    assert named >= 15 and not wrong


@pytest.mark.slow
def test_no_true_rate_is_doubted_and_most_wrong_ones_are_where_it_can_tell(shared):
    from damage import RATES

    from clips import ClipError, ReadOptions, read_clip

    told = seen = 0
    for path in sorted((shared / "csv").rglob("*.csv")):
        file = str(path.relative_to(shared))
        try:
            clip = read_clip(path, ReadOptions(fps=next((fps for f, fps in RATES.items() if file.startswith(f)), None)))
        except ClipError:
            continue
        assert check_sway(clip).verdict != "doubtful", file
        for factor in (0.5, 2.0):
            check = check_sway(dataclasses.replace(clip, fps=factor * clip.fps))
            told += check.verdict != "cannot tell"
            seen += check.verdict == "doubtful"
            assert check.suggestion in ("", f"{clip.fps:.4g}"), file
    assert told >= 30 and seen >= 0.9 * told
