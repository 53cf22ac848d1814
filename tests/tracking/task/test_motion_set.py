"""One policy, several references: every robot stays in its own, sees what it would see alone, and each gets a bundle."""

import dataclasses
import json

import numpy as np
import pytest

from clips import MetricKey, cut, load_reference, read_clip, save_reference
from retarget import RetargetConfig, retarget
from robot_models import PART_NAMES, load_robot
from tracking import TaskConfig, TrackingError, TrackingTask, load_bundle
from tracking.config import RandomisationConfig, StartNoise
from tracking.task.motion_set import bundle_folder, is_floor_work, motion_set_sha256, read_motion_set

CALM = TaskConfig(randomisation=RandomisationConfig(enabled=False), start_noise=StartNoise(scale=0.0))


@pytest.fixture(scope="module")
def files(groove_file, tmp_path_factory):
    """The sample dance, and two seconds of it as a dance of its own."""
    folder = tmp_path_factory.mktemp("pieces")
    robot = load_robot("dancer")
    short = retarget(cut(read_clip(groove_file), 3.0, 5.0), robot, RetargetConfig(lead_in_s=0.5, lead_out_s=0.5))
    save_reference(short.reference, folder / "short.npz")
    (folder / "long.npz").write_bytes(groove_file.read_bytes())
    return [folder / "long.npz", folder / "short.npz"]


@pytest.fixture(scope="module")
def pieces(files):
    return read_motion_set(files, load_robot("dancer"))


def task(pieces, envs=4):
    return TrackingTask(
        robot=load_robot("dancer"), reference=[p.reference for p in pieces], envs=envs, config=CALM, threads=1
    )


def test_what_a_robot_sees_and_earns_is_what_it_would_alone(pieces):
    both, first, second = task(pieces, 2), task(pieces[:1], 1), task(pieces[1:], 1)
    ends = len(pieces[0].reference.qpos), len(pieces[1].reference.qpos)
    both.reset(np.arange(2), np.array([ends[0] - 4, ends[0] + ends[1] - 6]))
    first.reset(np.arange(1), np.array([ends[0] - 4]))
    second.reset(np.arange(1), np.array([ends[1] - 6]))
    for step in range(3):
        for row, alone in enumerate((first, second)):
            for ours, theirs in zip(both.observe(noisy=False), alone.observe(noisy=False), strict=True):
                np.testing.assert_allclose(ours[row], theirs[0], atol=1e-6)
        together, *apart = (
            both.step(np.zeros((2, both.actions))),
            *(t.step(np.zeros((1, t.actions))) for t in (first, second)),
        )
        np.testing.assert_allclose(together.reward, [r.reward[0] for r in apart], atol=1e-9)
        assert list(together.truncated) == [step == 2, False]
    assert both.frame[0] == ends[0] - 1  # the end of its own, not the second's beginning
    for t in (both, first, second):
        t.close()


def test_every_reference_is_begun_and_none_is_left(pieces):
    one = task(pieces, 64)
    length = pieces[0].reference.frames
    belongs = one.frame < length
    assert 0.3 < belongs.mean() < 1.0
    for _ in range(20):
        one.step(np.zeros((64, one.actions)))
        assert ((one.frame < length) == belongs).all()
    one.close()


def test_names_rates_and_hashes(files, pieces, tmp_path):
    robot = load_robot("dancer")
    assert [p.name for p in pieces] == ["long", "short"]
    assert motion_set_sha256(pieces[:1]) == pieces[0].sha256
    assert len({motion_set_sha256(p) for p in (pieces, pieces[::-1], pieces[:1], pieces[1:])}) == 4
    assert bundle_folder(tmp_path, pieces[0], pieces[:1]) == tmp_path
    assert bundle_folder(tmp_path, pieces[0], pieces) == tmp_path / "long"
    (tmp_path / "short.npz").write_bytes(files[0].read_bytes())
    with pytest.raises(TrackingError, match="reference short: found a second"):
        read_motion_set([files[1], tmp_path / "short.npz"], robot)
    slow = retarget(cut(read_clip(files[0]), 3.0, 4.5), robot, RetargetConfig(fps=30.0, dynamics=False))
    save_reference(slow.reference, tmp_path / "slow.npz")
    with pytest.raises(TrackingError, match="30 frames/s"):
        read_motion_set([files[0], tmp_path / "slow.npz"], robot)


def test_a_reference_that_physics_forbids_weighs_half(pieces):
    reference = pieces[0].reference
    assert pieces[0].weight == 1.0
    report = dict(reference.meta["report"])
    report[MetricKey.IMPOSSIBLE_FRAMES] = report[MetricKey.IMPOSSIBLE_FRAMES] | {"value": 25.0}
    hard = dataclasses.replace(reference, meta=reference.meta | {"report": report})
    assert dataclasses.replace(pieces[0], reference=hard).weight == 0.5


def test_one_network_and_a_bundle_for_each(pieces, files, tmp_path):
    pytest.importorskip("torch")
    from tracking import PpoConfig, TrainConfig, train
    from tracking.policy.bundle import CONTRACT, POLICY, REFERENCE
    from tracking.policy.contract import read_contract

    small = PpoConfig(hidden=(32, 32), steps_per_env=8, epochs=1, minibatches=2)
    config = TrainConfig(envs=16, steps=16 * 8 * 3, evaluate_every=16 * 8 * 3, rollouts=2, threads=1, ppo=small)
    run = train(load_robot("dancer"), pieces, tmp_path / "r", config)
    assert set(run.evaluations) == {"long", "short"} and "finished short" in run.curves[-1]
    networks = {(tmp_path / "r" / p.name / POLICY).read_bytes() for p in pieces}
    assert len(networks) == 1
    for piece, file in zip(pieces, files, strict=True):
        assert (tmp_path / "r" / piece.name / REFERENCE).read_bytes() == file.read_bytes()
        assert read_contract(tmp_path / "r" / piece.name / CONTRACT).reference_sha256 == piece.sha256
    from cli.evaluate import main

    assert main([str(tmp_path / "r"), "--rollouts", "2", "--json", str(tmp_path / "r.json")]) == 1
    assert set(json.loads((tmp_path / "r.json").read_text())["results"]) == {"long", "short"}
    assert main([str(tmp_path / "r"), "--sweep"]) == 2
    spoilt = tmp_path / "r" / "short" / POLICY
    network = spoilt.read_bytes()
    spoilt.write_bytes(network + b" ")
    assert main([str(tmp_path / "r")]) == 2  # two policies are no one policy
    spoilt.write_bytes(network)
    with pytest.raises(TrackingError, match="resume"):
        train(load_robot("dancer"), pieces[:1], tmp_path / "r", config, resume=True)


def test_the_command_leaves_out_what_missed_a_gate_in_a_folder_and_refuses_it_by_name(files, tmp_path, capsys):
    pytest.importorskip("torch")
    from cli.train import main

    robot = load_robot("dancer")
    bad = load_reference(files[1], robot)
    report = {name: told | {"passed": False} for name, told in bad.meta["report"].items()}
    folder = tmp_path / "refs"
    folder.mkdir()
    save_reference(dataclasses.replace(bad, meta=bad.meta | {"report": report}), folder / "bad.npz")
    (folder / "long.npz").write_bytes(files[0].read_bytes())
    other = retarget(
        cut(read_clip(files[0]), 3.0, 4.5), load_robot("g1"), RetargetConfig(lead_in_s=0.3, lead_out_s=0.3)
    )
    save_reference(other.reference, folder / "other.npz")
    np.savez(folder / "junk.npz", a=np.zeros(3))
    budget = ["--steps", "64", "--envs", "8", "--no-recording", "--teacher", "none", "-o", str(tmp_path / "run")]
    assert main(["--ref", str(folder), *budget]) == 2
    said = capsys.readouterr().err
    assert "references of dancer, g1" in said and "--robot dancer" in said and "source-robot" not in said
    assert main(["--ref", str(folder), "--robot", "dancer", *budget]) == 1
    said = capsys.readouterr().out
    for name, why in (("bad", "gates that failed"), ("other", "g1, not dancer"), ("junk", "no reference")):
        assert f"left out {name}.npz: {why}" in said
    assert (tmp_path / "run" / "reference.npz").exists()
    assert main(["--ref", str(folder / "bad.npz"), str(files[0]), *budget]) == 2
    assert "bad.npz" in capsys.readouterr().err


def test_a_reference_of_a_users_robot_asks_for_its_profile(tmp_path, groove):
    from dataclasses import replace

    from clips import save_reference
    from tracking import TrackingError
    from tracking.task import select_references

    save_reference(replace(groove.reference, robot="my_biped"), tmp_path / "mine.npz")
    with pytest.raises(TrackingError, match="'my_biped', which is no built-in robot") as refused:
        select_references([tmp_path / "mine.npz"])
    assert (refused.value.option, refused.value.suggestion) == ("robot", "my_biped.toml")


def test_dances_on_two_feet_are_no_floor_work_and_whoever_lies_or_is_labelled_is():
    for name in ("groove-g1", "groove-dancer"):
        bundle = load_bundle(name)
        reference, robot = bundle.reference, bundle.robot
        assert not is_floor_work(reference, robot)
        low = np.array(reference.body_pos_w)
        low[100, :, 2] -= 0.5
        assert is_floor_work(dataclasses.replace(reference, body_pos_w=low), robot)
        kneels = np.zeros((reference.frames, len(PART_NAMES)), dtype=np.int8)
        kneels[100, PART_NAMES.index("left_knee")] = 1
        assert is_floor_work(dataclasses.replace(reference, part_contact=kneels), robot)
