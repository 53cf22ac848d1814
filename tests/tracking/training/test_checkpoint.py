"""Checkpoints: whole, without code inside, and only for the run that they are of."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")

import tracking
from clips import load_reference
from tracking import PpoConfig, TrackingError, TrackingTask, TrainConfig
from tracking.training.checkpoint import FORMAT_VERSION, _packed, _unpacked, load_checkpoint, restore, save_checkpoint
from tracking.training.ppo import Trainer

FILE = Path(tracking.__file__).parent / "policies" / "groove-dancer" / "reference.npz"
CONFIG = TrainConfig(envs=2, threads=1, ppo=PpoConfig(hidden=(8,), steps_per_env=4, epochs=1, minibatches=1))


@pytest.fixture(scope="module")
def trainer(dancer):
    task = TrackingTask(robot=dancer, reference=load_reference(FILE, dancer), envs=2, seed=0, threads=1)
    made = Trainer(task, CONFIG.ppo, 0, threads=1)
    made.iterate(0.05)
    yield made
    task.close()


@pytest.fixture
def saved(trainer, tmp_path):
    save_checkpoint(tmp_path / "c.pt", trainer, CONFIG, "abc", {"steps": 8, "curves": [{"a": 0.1}]})
    return tmp_path / "c.pt"


def test_progress_comes_back_as_it_was_and_the_file_is_alone_in_its_folder(trainer, saved):
    assert restore(trainer, load_checkpoint(saved), CONFIG, "abc") == {"steps": 8, "curves": [{"a": 0.1}]}
    assert [p.name for p in saved.parent.iterdir()] == [saved.name]


def test_what_was_restored_is_saved_again_as_it_was(trainer, saved, tmp_path):
    before = load_checkpoint(saved)
    trainer.iterate(0.05)  # somewhere else
    restore(trainer, before, CONFIG, "abc")
    save_checkpoint(tmp_path / "again.pt", trainer, CONFIG, "abc", {"steps": 8, "curves": [{"a": 0.1}]})
    again = load_checkpoint(tmp_path / "again.pt")

    def flat(x, name=""):
        if isinstance(x, dict):
            return {k: v for key in x for k, v in flat(x[key], f"{name}/{key}").items()}
        if isinstance(x, list | tuple):
            return {k: v for i, y in enumerate(x) for k, v in flat(y, f"{name}/{i}").items()}
        return {name: x}

    ours, theirs = flat(before), flat(again)
    assert ours.keys() == theirs.keys() and len(ours) > 30
    for name, value in ours.items():
        same = torch.equal(value, theirs[name]) if isinstance(value, torch.Tensor) else value == theirs[name]
        assert same, name


def test_the_learning_rate_goes_on_from_where_it_was(trainer, saved):
    wanted = trainer.algorithm.learning_rate
    trainer._adapt_rate(1.0, 0.1)
    assert trainer.algorithm.learning_rate != wanted
    restore(trainer, load_checkpoint(saved), CONFIG, "abc")
    assert trainer.algorithm.learning_rate == wanted
    assert {g["lr"] for g in trainer.algorithm.optimizer.param_groups} == {wanted}


@pytest.mark.parametrize(
    ("key", "value"), [("envs", 4), ("seed", 1), ("threads", 2), ("engine", "warp"), ("task", {"action_scale": 0.25})]
)
def test_another_run_is_refused_by_what_differs(trainer, saved, key, value):
    value = dataclasses.replace(CONFIG.task, **value) if key == "task" else value
    with pytest.raises(TrackingError, match=f"resume: found another {key}"):
        restore(trainer, load_checkpoint(saved), dataclasses.replace(CONFIG, **{key: value}), "abc")


@pytest.mark.parametrize(("key", "value"), [("hidden", (8, 8)), ("steps_per_env", 5)])
def test_networks_and_batches_of_another_shape_are_refused(trainer, saved, key, value):
    ppo = dataclasses.replace(CONFIG.ppo, **{key: value})
    with pytest.raises(TrackingError, match=f"another {key}"):
        restore(trainer, load_checkpoint(saved), dataclasses.replace(CONFIG, ppo=ppo), "abc")


def test_budgets_and_schedules_may_change_on_purpose(trainer, saved):
    ppo = dataclasses.replace(CONFIG.ppo, settled_kl=0.02, entropy=0.0, gamma=0.9)
    other = dataclasses.replace(CONFIG, steps=7, minutes=1.0, rollouts=3, evaluate_every=2, target=0.5, ppo=ppo)
    assert restore(trainer, load_checkpoint(saved), other, "abc")["steps"] == 8


def test_more_processes_than_the_run_began_with_are_refused(trainer, saved):
    state = load_checkpoint(saved)
    with pytest.raises(TrackingError, match="1 processes, expected 2"):
        restore(trainer, {**state, "processes": state["processes"] * 2}, CONFIG, "abc")


class Evil:
    """What would run when it is unpickled."""

    def __reduce__(self):
        return (pytest.fail, ("code of a file was run",))


@pytest.mark.parametrize("what", [Evil(), {"format_version": FORMAT_VERSION, "algorithm": Evil()}], ids=range(2))
def test_a_file_with_code_inside_is_no_checkpoint(tmp_path, what):
    torch.save(what, tmp_path / "c.pt")
    with pytest.raises(TrackingError, match="no checkpoint"):
        load_checkpoint(tmp_path / "c.pt")


@pytest.mark.parametrize("what", [[1, 2], {"format_version": FORMAT_VERSION + 1}, {"format_version": None}, {}])
def test_what_is_of_another_format_is_refused(tmp_path, what):
    torch.save(what, tmp_path / "c.pt")
    with pytest.raises(TrackingError, match=f"another format, expected checkpoint version {FORMAT_VERSION}"):
        load_checkpoint(tmp_path / "c.pt")


def test_a_cut_off_file_and_an_absent_one_are_refused_differently(saved, tmp_path):
    (tmp_path / "cut.pt").write_bytes(saved.read_bytes()[:-100])
    with pytest.raises(TrackingError, match=r"cut\.pt: found a file that is no checkpoint"):
        load_checkpoint(tmp_path / "cut.pt")
    with pytest.raises(TrackingError, match=r"absent\.pt: found no such file"):
        load_checkpoint(tmp_path / "absent.pt")


def test_a_save_that_is_interrupted_leaves_the_checkpoint_before(trainer, saved, monkeypatch):
    before = saved.read_bytes()

    def broken(state, stream):
        stream.write(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr(torch, "save", broken)
    with pytest.raises(KeyboardInterrupt):
        save_checkpoint(saved, trainer, CONFIG, "abc", {})
    assert saved.read_bytes() == before and [p.name for p in saved.parent.iterdir()] == [saved.name]


def test_a_tasks_state_survives_packing_with_its_whole_generator(trainer):
    state = trainer.task.state_dict()
    again = _unpacked(_packed(state))
    assert again["rng"] == state["rng"] and json.dumps(again["rng"])
    for name in set(state) - {"rng"}:
        assert again[name].dtype == state[name].dtype, name
        np.testing.assert_array_equal(again[name], state[name], err_msg=name)
    again["frame"][:] = -1
    assert (state["frame"] >= 0).all()  # no memory is shared
