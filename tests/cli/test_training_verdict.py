"""What a training says at its end, and what it goes on with."""

from pathlib import Path

import pytest

from cli.training import Arguments, as_begun, keep_beginning, run_verdict

pytest.importorskip("torch")


def test_a_resumed_run_that_is_stopped_before_it_is_judged_says_that_it_is_saved(tmp_path):
    from tracking import Run

    run = Run(
        folder=tmp_path / "r", steps=4096, curves=[{"finished": 0.3, "survived_s": 2.0}], stopped="stopped by SIGINT"
    )
    verdict = run_verdict(run, [tmp_path / "a b.npz"])
    assert not verdict.passed and "stopped by SIGINT" in verdict.line and "4096 steps" in verdict.line
    assert "4096 steps after it are done again" in " ".join(verdict.notes)  # nothing was saved yet
    run.saved = 4096
    assert "again" not in " ".join(run_verdict(run, [tmp_path / "a.npz"]).notes)
    assert verdict.steps[0][0] == f"dance-train --ref '{tmp_path / 'a b.npz'}' -o {tmp_path / 'r'} --resume"


def test_what_goes_on_of_a_folder_of_several_robots_says_which(tmp_path):
    from tracking import Run

    run = Run(
        folder=tmp_path / "r", steps=1, curves=[{"finished": 0.0, "survived_s": 1.0}], stopped="stopped by SIGINT"
    )
    assert "--robot g1 " in run_verdict(run, [tmp_path], "g1").steps[0][0]


def test_minutes_are_of_this_part_of_a_run(tmp_path):
    from tracking import Run, TrainConfig

    run = Run(folder=tmp_path / "r", steps=1, seconds=600.0, before_s=590.0)
    assert run.reason_to_stop(TrainConfig(minutes=1.0), 10) == ""
    run.seconds = 651.0
    assert "budget of 1 minutes" in run.reason_to_stop(TrainConfig(minutes=1.0), 10)


def test_a_run_goes_on_with_the_teacher_and_the_settings_that_it_began_with(tmp_path):
    from cli.shell.typed import remember
    from tracking import TrainConfig

    folder = tmp_path / "run"
    remember("dance-train", [], {"task.rewards.action-rate": "-0.3"})
    begun = Arguments(ref=(tmp_path / "a.npz",), minutes=3.0, steps=4000, envs=64)
    keep_beginning(begun, folder, tmp_path / "twist2.onnx")
    remember("dance-train", [])
    plain = Arguments(ref=(tmp_path / "a.npz",), resume=True)
    again = as_begun(plain, folder)
    assert again.teacher == str(tmp_path / "twist2.onnx")
    numbers = again.numbers()
    assert numbers.task.rewards.action_rate == -0.3 and numbers.envs == 64
    # How long one part may take is no property of the run.
    plain_numbers = TrainConfig()
    assert (numbers.minutes, numbers.steps) == (plain_numbers.minutes, plain_numbers.steps)
    assert numbers.distillation.samples == plain_numbers.distillation.samples
    stated = as_begun(Arguments(ref=plain.ref, resume=True, teacher="none", config=tmp_path / "other.toml"), folder)
    assert (stated.teacher, stated.config) == ("none", tmp_path / "other.toml")
    keep_beginning(begun, folder, None)
    assert as_begun(plain, folder).teacher == "none"
    assert as_begun(plain, tmp_path / "elsewhere") == plain


def test_a_resumed_run_is_not_begun_with_another_policy(tmp_path):
    from tracking import TrackingError

    refs, first = (tmp_path / "a.npz",), Path("tracker-g1")
    keep_beginning(Arguments(ref=refs, begin=first), tmp_path / "run", None)
    for stated in (first, None):
        assert as_begun(Arguments(ref=refs, resume=True, begin=stated), tmp_path / "run").begin == first
    with pytest.raises(TrackingError, match="began with tracker-g1"):
        as_begun(Arguments(ref=refs, resume=True, begin=Path("groove-g1")), tmp_path / "run")


def test_a_run_that_is_not_there_and_a_file_that_is_no_teacher_are_refused_before_anything_is_written(
    tmp_path, groove_file, capsys
):
    from cli.train import main

    folder = tmp_path / "run"
    assert main(["--ref", str(groove_file), "-o", str(folder), "--resume"]) == 2
    assert "no run to go on with" in capsys.readouterr().err
    (tmp_path / "bad.pt").write_bytes(b"x")
    assert main(["--ref", str(groove_file), "-o", str(folder), "--teacher", str(tmp_path / "bad.pt")]) == 2
    assert "no teacher" in capsys.readouterr().err and not folder.exists()
