"""The pace of a dance that is too hard, and the rounds of finding it."""

import numpy as np
import pytest
from dynamics_by_hand import dynamics_by_hand
from person import stepping
from standing import reference_of, standing

import retarget.workflows.time_scaling as fit_module
from retarget import FitConfig, Report, RetargetConfig, Retargeted, RetargetError, fit_to_dynamics
from retarget.targets.contacts import find_contacts
from retarget.targets.targets import make_targets
from retarget.workflows.time_scaling import pace_for

FPS, FIT = 50.0, FitConfig()


def hard(rng, frames=300):
    """Scores with three hard stretches, and a flight beside the last."""
    score, flight = 0.7 * rng.random(frames), np.zeros(frames, dtype=bool)
    score[60:70], score[150], score[240:250], flight[243:260] = 1.5, 6.0, 2.0, True
    return score, flight


def test_the_pace_lies_between_the_slowest_and_the_recordings_and_flights_keep_theirs(rng):
    score, flight = hard(rng)
    pace = pace_for(score, flight, FPS, FIT)
    assert pace.min() >= FIT.slowest and pace.max() <= 1.0
    np.testing.assert_array_equal(pace[flight], 1.0)
    # The hardest stretch may go no slower; what smoothing fills of a dip this wide is a few per cent.
    assert pace[150] < FIT.slowest + 0.05
    # score ~ pace^2: at its pace the middle of the first stretch comes down below impossible.
    assert (1.5 * pace[60:70] ** 2 < 1.0).all()


def test_what_is_easy_is_not_slowed():
    np.testing.assert_allclose(pace_for(np.full(100, 0.99), np.zeros(100, dtype=bool), FPS, FIT), 1.0, atol=1e-9)


def test_the_pace_runs_backwards_with_time(rng):
    score, flight = hard(rng)
    back = pace_for(score[::-1], flight[::-1], FPS, FIT)
    np.testing.assert_allclose(back[::-1], pace_for(score, flight, FPS, FIT), atol=1e-9)


def test_who_allows_more_slowing_gets_no_faster_pace_where_it_is_hardest(rng):
    score, flight = hard(rng)
    deepest = [pace_for(score, flight, FPS, FitConfig(slowest=s))[150] for s in (0.9, 0.6, 0.4)]
    assert deepest[0] > deepest[1] > deepest[2]


def result_of(clip, robot, score):
    """As `retarget` would give it, standing, with a score of missing force."""
    contacts = find_contacts(clip, RetargetConfig().contact)
    return Retargeted(
        robot=robot,
        reference=reference_of(robot, standing(robot, clip.frames)),
        report=Report(metrics=(), series={}),
        sources=(clip,),
        contacts=contacts,
        targets=make_targets(clip, contacts, robot, RetargetConfig()),
        dynamics=None if score is None else dynamics_by_hand(clip.frames, force=score[:, None] * np.eye(3)[0]),
    )


def rounds_of(monkeypatch, shares):
    """Lets `fit_to_dynamics` see results whose shares of impossible frames are given; the clips that each round saw."""
    seen = []

    def stub(clip, robot, config, *, progress=None):
        score = np.zeros(clip.frames)
        score[: round(shares[len(seen)] * clip.frames)] = 1.5
        seen.append(clip)
        return result_of(clip, robot, score)

    monkeypatch.setattr(fit_module, "retarget", stub)
    return seen


@pytest.mark.parametrize(
    ("shares", "rounds", "kept"),
    [([0.0], 1, 1), ([0.4, 0.0], 2, 2), ([0.2, 0.4, 0.1, 0.3], 4, 3), ([0.2, 0.25, 0.3, 0.4], 4, 1)],
)
def test_the_best_round_is_kept_and_none_follows_a_perfect_one(monkeypatch, dancer, shares, rounds, kept):
    seen = rounds_of(monkeypatch, shares)
    result = fit_to_dynamics(stepping(), dancer, RetargetConfig(), FIT)
    assert len(seen) == rounds and result.source is seen[kept - 1]
    lengths = [clip.frames for clip in seen]
    assert lengths == sorted(lengths) and len(set(lengths)) == len(lengths)  # each slower than the one before


def test_without_dynamics_there_is_nothing_to_fit_to(monkeypatch, dancer):
    monkeypatch.setattr(fit_module, "retarget", lambda clip, robot, config, progress: result_of(clip, robot, None))
    with pytest.raises(RetargetError, match="pip install pin"):
        fit_to_dynamics(stepping(), dancer)
