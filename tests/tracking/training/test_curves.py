"""Curves: a table that reads back, and events that TensorBoard reads."""

import csv
import math

import pytest

pytest.importorskip("torch")

from clips import OutputError
from tracking.training.curves import TensorBoard, write_curves
from tracking.training.ppo import Iteration

ROWS = [
    {"steps": 0.0, "survived_s": 1 / 3, "finished": 0.0, "minutes": 1e-7},
    {"steps": 123456.0, "survived_s": 12345.678, "finished": math.nan, "minutes": math.inf},
]
ITERATION = Iteration(
    steps=64, losses={"value": 0.5, "surrogate": -0.25}, episode_s=1.5, terms={"body_position": 0.75},
    causes={"diverged": 0, "anchor_tilt": 3}, std=0.25, kl=0.125, rate=0.0625,
)  # fmt: skip


def test_a_table_reads_back_in_order_and_to_six_digits(tmp_path):
    write_curves(tmp_path / "c.csv", ROWS)
    with open(tmp_path / "c.csv", newline="") as stream:
        again = list(csv.DictReader(stream))
    assert [list(row) for row in again] == [list(row) for row in ROWS]
    for ours, theirs in zip(ROWS, again, strict=True):
        for name, value in ours.items():
            assert float(theirs[name]) == pytest.approx(value, rel=5e-6, nan_ok=True), name


def test_a_longer_table_takes_the_place_of_the_shorter_one_whole(tmp_path):
    for rows in (ROWS[:1], ROWS):
        write_curves(tmp_path / "c.csv", rows)
    assert len((tmp_path / "c.csv").read_text().splitlines()) == 3
    assert [p.name for p in tmp_path.iterdir()] == ["c.csv"]
    with pytest.raises(OutputError, match="takes no file"):
        write_curves(tmp_path / "no" / "c.csv", ROWS)


def test_a_row_with_a_column_of_its_own_is_refused_and_nothing_written(tmp_path):
    with pytest.raises(ValueError, match="new"):
        write_curves(tmp_path / "c.csv", [ROWS[0], ROWS[0] | {"new": 1.0}])
    assert not list(tmp_path.iterdir())


def test_tensorboard_reads_every_number_at_its_step(tmp_path):
    accumulator = pytest.importorskip("tensorboard.backend.event_processing.event_accumulator")
    with TensorBoard(tmp_path) as board:
        board.iteration(64, ITERATION)
        board.iteration(128, ITERATION)
        board.evaluation(128, {"finished": 0.5})
    events = accumulator.EventAccumulator(str(tmp_path))
    events.Reload()
    seen = {tag: [(e.step, e.value) for e in events.Scalars(tag)] for tag in events.Tags()["scalars"]}
    wanted = {
        "reward/body_position": 0.75, "loss/value": 0.5, "loss/surrogate": -0.25, "failures/diverged": 0.0,
        "failures/anchor_tilt": 3.0, "episode/length_s": 1.5, "policy/std": 0.25, "policy/kl": 0.125,
        "policy/learning_rate": 0.0625,
    }  # fmt: skip
    assert seen == {k: [(64, v), (128, v)] for k, v in wanted.items()} | {"evaluation/finished": [(128, 0.5)]}


def test_without_a_folder_nothing_is_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with TensorBoard(None) as board:
        board.iteration(1, ITERATION)
        board.evaluation(1, {"finished": 1.0})
    assert not list(tmp_path.iterdir())
