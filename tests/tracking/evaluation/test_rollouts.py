"""Evaluations: what is counted is what happened, by an interval that the statisticians' own library gives too."""

import dataclasses
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

import tracking
from clips import load_reference
from robot_models.maths import silent
from tracking.config import RandomisationConfig, StartNoise, TaskConfig
from tracking.evaluation.rollouts import IN_PLACE, _Tally, evaluate, evaluation_task, play, wilson
from tracking.task.tracking_errors import FALLS, TrackingErrors
from tracking.task.tracking_task import StepResult, TrackingTask

pytestmark = pytest.mark.usefixtures("as_users_run_it")  # refusals, and doubles of what is checked elsewhere

FILE = Path(tracking.__file__).parent / "policies" / "groove-dancer" / "reference.npz"
CALM = TaskConfig(randomisation=RandomisationConfig(enabled=False), start_noise=StartNoise(scale=0.0))
N, DT, STEPS = 4, 0.1, 25


@pytest.mark.parametrize("n", [1, 2, 7, 50, 100, 1000])
def test_the_interval_is_that_of_scipy(n):
    for k in {0, 1, n // 3, n // 2, n - 1, n}:
        theirs = stats.binomtest(k, n).proportion_ci(confidence_level=0.95, method="wilson")
        assert wilson(k, n) == pytest.approx((theirs.low, theirs.high), abs=2e-5)  # 1.96 is a rounded quantile


@pytest.mark.parametrize("n", [5, 40])
def test_the_interval_is_symmetrical_holds_the_share_and_narrows_with_trials(n):
    intervals = [wilson(k, n) for k in range(n + 1)]
    for k, (low, high) in enumerate(intervals):
        assert 0.0 <= low <= k / n <= high <= 1.0
        assert intervals[n - k] == pytest.approx((1.0 - high, 1.0 - low))  # failures counted instead of successes
        finer = wilson(10 * k, 10 * n)
        assert finer[1] - finer[0] < high - low
    lows, highs = zip(*intervals, strict=True)
    assert (np.diff(lows) > 0.0).all() and (np.diff(highs) > 0.0).all()


class Room:
    """As much of a task as a tally looks at: the robots' bodies and joints stand so far from the reference."""

    def __init__(self, off, joints):
        self.frame, self.dt = np.zeros(N, dtype=int), DT
        self.tables = SimpleNamespace(pos=np.zeros((1, 2, 3)), joint_pos=np.zeros((1, 5)))
        pos = np.asarray(off)[:, None, None] * np.tile([0.6, 0.0, 0.8], (N, 2, 1))
        self.sensors = SimpleNamespace(states=SimpleNamespace(pos=pos))
        self.physics = SimpleNamespace(qpos=np.concatenate((np.zeros((N, 7)), np.full((N, 5), joints)), axis=1))


def step(failed, body=0.01, cause="anchor_height"):
    bodies = np.zeros((N, 2, 3))
    bodies[..., 1] = np.asarray(body)[..., None] * np.ones((N, 2))
    names = [f.name for f in dataclasses.fields(TrackingErrors)]
    errors = TrackingErrors(**({n: np.zeros(N) for n in names} | {"body_pos": bodies}))
    failed = np.asarray(failed, dtype=bool)
    return StepResult(
        reward=np.ones(N), terminated=failed, truncated=np.zeros(N, dtype=bool), terms={"a": np.ones(N)},
        causes={name: failed & (name == cause) for name in (*FALLS, "end_effector_height")}, errors=errors,
    )  # fmt: skip


def judged(ends, off=0.0, joints=0.02, cause="anchor_height"):
    """Rollouts that fail in these steps (None: never)."""
    tally = _Tally(N)
    for k in range(STEPS):
        tally.add(step([e == k for e in ends], cause=cause), Room(np.broadcast_to(off, N), joints))
    return tally.result(DT, STEPS, np.arange(STEPS + 1.0)[:, None, None] * np.ones((1, N, 12)))


def test_rollouts_count_until_they_fail_and_never_again():
    result = judged([None, 0, 12, 12])
    assert result.finished == 0.25 and result.causes["anchor_height"] == sum(result.causes.values()) == 3
    assert result.survived_s == pytest.approx(DT * (25 + 0 + 12 + 12) / 4)
    assert result.duration_s == pytest.approx(2.5)
    assert [(s.at_s, s.failed) for s in result.seconds] == [(0.0, 1), (1.0, 2), (2.0, 0)]
    assert result.hardest.at_s == 1.0
    assert result.terms == {"a": pytest.approx(1.0)}  # a mean over standing frames, whatever their number
    assert [len(path) for path in result.shown.values()] == [26, 13, 1]
    assert list(result.shown) == ["best: finished", "median: fell at 1.2 s", "worst: fell at 0.0 s"]
    assert result.shown["best: finished"][-1, 0] == 25.0


def test_who_strays_has_not_fallen_and_the_three_ends_are_all_there_are():
    strayed = judged([None, 0, 12, 12], cause="end_effector_height")
    assert {name: share.count for name, share in strayed.outcomes.items()} == {"finished": 1, "strayed": 3, "fell": 0}
    assert list(strayed.shown) == ["best: finished", "median: strayed at 1.2 s", "worst: strayed at 0.0 s"]
    assert [len(path) for path in strayed.shown.values()] == [26, 26, 26]  # they dance on
    fallen = judged([None, 0, 12, 12])
    assert {name: share.count for name, share in fallen.outcomes.items()} == {"finished": 1, "strayed": 0, "fell": 3}
    assert fallen.outcomes["fell"].interval == wilson(3, 4)
    assert list(judged([None] * N).shown) == [
        "best: finished",
        "median: finished",
    ]  # no failure, nothing failed to show


def test_a_failure_after_the_end_changes_nothing():
    tally = _Tally(N)
    for failed in ([True] + [False] * 3, [True] + [False] * 3, [False] * 4):
        tally.add(step(failed), Room(np.zeros(N), 0.0))
    result = tally.result(DT, 3, np.zeros((4, N, 12)))
    assert result.causes["anchor_height"] == 1 and result.finished == 0.75


def test_errors_are_means_over_the_frames_in_which_a_rollout_stood():
    result = judged([None, 0, 12, None], off=0.2, joints=0.02)
    assert result.body_error_mm == pytest.approx(10.0) and result.global_error_mm == pytest.approx(200.0)
    assert result.joint_error_rad == pytest.approx(0.02)
    assert result.body_error_half_mm == pytest.approx(0.0, abs=1e-9)  # all alike
    assert [s.body_error_mm for s in result.seconds] == [pytest.approx(10.0)] * 3


def test_a_second_in_which_nobody_stood_has_no_error():
    result = judged([3, 2, 1, 0])
    assert result.finished == 0.0 and [s.body_error_mm is None for s in result.seconds] == [False, True, True]
    assert result.hardest.at_s == 0.0


@pytest.mark.parametrize(("off", "stayed"), [(0.98 * IN_PLACE, 1.0), (1.02 * IN_PLACE, 0.0)])
def test_a_dance_half_a_metre_off_is_finished_but_not_in_place(off, stayed):
    result = judged([None] * N, off=off)
    assert result.finished == 1.0 and result.finished_in_place == stayed
    assert judged([5] * N, off=off).finished_in_place == 0.0  # nor is one that was never finished


def test_once_out_of_place_is_out_of_place():
    tally = _Tally(N)
    for off in ([0.0] * 4, [0.0, 0.6, 0.0, 0.0], [0.0] * 4):
        tally.add(step([False] * N), Room(np.array(off), 0.0))
    assert tally.result(DT, 3, np.zeros((4, N, 12))).finished_in_place == 0.75


def test_nobody_pushes_in_an_evaluation_and_nominal_robots_are_nominal():
    for config in (TaskConfig(), CALM):
        for randomised in (True, False):
            task = evaluation_task(config, randomised=randomised)
            assert not task.randomisation.pushes
            assert task.randomisation.enabled == (randomised and config.randomisation.enabled)
            assert dataclasses.replace(task, randomisation=config.randomisation) == config  # all else stays


@pytest.fixture(scope="module")
def reference(dancer):
    return load_reference(FILE, dancer)


def test_the_seed_decides_an_evaluation_and_progress_is_told_to_its_end(dancer, reference):
    def still(seen):
        return np.zeros((len(seen), 28))

    told = []
    task = evaluation_task(dataclasses.replace(TaskConfig(), start_noise=StartNoise(scale=2.0)))  # they fall soon
    runs = [
        evaluate(still, dancer, reference, task, rollouts=2, seed=seed, threads=1, progress=p)
        for seed, p in ((5, lambda stage, done, steps: told.append((done, steps))), (5, silent), (6, silent))
    ]
    assert runs[0].as_dict() == runs[1].as_dict() != runs[2].as_dict()
    assert [d for d, _ in told] == list(range(1, len(told) + 1)) and {s for _, s in told} == {500}
    assert "shown" not in runs[0].as_dict()
    assert all(path.shape[1] == 35 for path in runs[0].shown.values())


def test_a_policy_alone_is_shown_what_the_task_observes(dancer, reference):
    task = TrackingTask(robot=dancer, reference=reference, envs=2, config=CALM, threads=1)
    task.reset(np.arange(2), np.array([80, 90]))
    kept = task.rng.bit_generator.state
    wanted = task.observe()[0].copy()
    task.rng.bit_generator.state = kept
    seen = []
    result = play(lambda o: (seen.append(o.copy()), np.full((2, 28), 0.1))[1], task)
    np.testing.assert_array_equal(seen[0], wanted)
    np.testing.assert_array_equal(task.last_action, 0.1)
    assert not result.terminated.any()
    task.close()


def test_who_strays_has_failed_and_has_not_fallen():
    fell, strayed = (judged([3, None, None, None], cause=cause) for cause in ("anchor_tilt", "end_effector_height"))
    assert (fell.finished, fell.stood, strayed.finished, strayed.stood) == (0.75, 0.75, 0.75, 1.0)
    assert fell.stood_s == pytest.approx(fell.survived_s)
    assert strayed.stood_s == pytest.approx(STEPS * DT) and strayed.survived_s == pytest.approx(fell.survived_s)
