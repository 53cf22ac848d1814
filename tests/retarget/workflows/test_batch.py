"""A folder of clips: every pair done once, bad ones no end of the rest, the same arrays as one by one."""

import json
import os
import signal
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from conftest import SAMPLES

from clips import MetricKey, cut, load_reference, read_clip, save_reference
from retarget import RetargetConfig, RetargetError, retarget
from retarget.workflows.batch import BatchConfig, Job, jobs_for, motion_files, run_batch, run_job, summary_rows
from robot_models import load_robot

QUICK = BatchConfig(retargeting=RetargetConfig(lead_in_s=0.5, lead_out_s=0.5, dynamics=False))


@pytest.fixture(scope="module")
def folder(tmp_path_factory, groove):
    """Two good clips of a second or two, one that is cut off, and a file that is none."""
    path = tmp_path_factory.mktemp("clips")
    lines = (SAMPLES / "groove.bvh").read_text().splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("Frame Time")) + 1
    for name, a, b in (("a", 0, 60), ("b", 120, 200)):
        rows = [*lines[: first - 2], f"Frames: {b - a}", lines[first - 1], *lines[first + a : first + b]]
        (path / f"{name}.bvh").write_text("\n".join(rows) + "\n")
    (path / "cut.bvh").write_text("\n".join(lines[: first + 5]))
    (path / "notes.md").write_text("not a clip")
    return path


def arrays(path):
    with np.load(path) as data:
        return {k: data[k] for k in data.files}


def test_outputs_are_named_after_clip_and_robot_and_never_share_a_name(tmp_path):
    clips = [tmp_path / "x" / "walk.bvh", tmp_path / "y" / "walk.bvh", tmp_path / "run.csv"]
    outs = [job.out.name for job in jobs_for(clips, ["g1", "dancer"], tmp_path)]
    assert len(set(outs)) == 6 and "run_g1.npz" in outs and "x_walk_bvh_g1.npz" in outs
    deep = [tmp_path / "p" / "x" / "walk.bvh", tmp_path / "q" / "x" / "walk.bvh"]
    assert len({job.out for job in jobs_for(deep, ["g1"], tmp_path)}) == 2
    with pytest.raises(RetargetError, match="an output for each"):
        jobs_for([tmp_path / "a.bvh"], ["mine/r.toml", "yours/r.toml"], tmp_path)


def test_references_in_the_folder_are_no_clips_of_the_next_run(tmp_path):
    (tmp_path / "out").mkdir()
    for name in ("a.bvh", "out/a_g1.npz"):
        (tmp_path / name).write_text("x")
    assert [p.name for p in motion_files(tmp_path, but=tmp_path / "out")] == ["a.bvh"]


def test_a_folder_is_done_once_and_a_bad_clip_does_not_stop_it(folder, tmp_path):
    clips = motion_files(folder, but=tmp_path)
    assert [c.name for c in clips] == ["a.bvh", "b.bvh", "cut.bvh"]
    jobs = jobs_for(clips, ["dancer"], tmp_path)
    outcomes = {o.clip.rsplit("/", 1)[-1]: o for o in run_batch(jobs, QUICK, 1)}
    assert outcomes["cut.bvh"].verdict == "exclude" and "cut off" in outcomes["cut.bvh"].message
    assert outcomes["a.bvh"].verdict in ("keep", "quarantine") and not outcomes["a.bvh"].skipped
    load_reference(tmp_path / "a_dancer.npz", load_robot("dancer"))
    before = (tmp_path / "a_dancer.npz").stat().st_mtime_ns
    again = {o.clip.rsplit("/", 1)[-1]: o for o in run_batch(jobs, QUICK, 1)}
    assert again["a.bvh"].skipped and again["b.bvh"].skipped and again["cut.bvh"].verdict == "exclude"
    assert (tmp_path / "a_dancer.npz").stat().st_mtime_ns == before
    assert again["a.bvh"].metrics == outcomes["a.bvh"].metrics
    rows = summary_rows(outcomes.values())
    assert {r["verdict"] for r in rows} >= {"exclude"} and MetricKey.LIMB_DIRECTION_ERROR.label in rows[0]


def test_what_changed_is_done_again(folder, tmp_path):
    job = Job(clip=tmp_path / "a.bvh", robot="dancer", out=tmp_path / "a_dancer.npz")
    job.clip.write_bytes((folder / "a.bvh").read_bytes())
    assert not run_job(job, QUICK).skipped
    assert run_job(job, QUICK).skipped
    other = BatchConfig(retargeting=RetargetConfig(lead_in_s=0.6, lead_out_s=0.5, dynamics=False))
    assert not run_job(job, other).skipped  # another configuration
    job.clip.write_bytes((folder / "b.bvh").read_bytes())
    assert not run_job(job, other).skipped  # another clip
    note = job.out.with_suffix(".json")
    note.write_text(note.read_text()[:40])
    assert not run_job(job, other).skipped  # half a note
    job.out.unlink()
    assert not run_job(job, other).skipped  # no reference


def test_a_reference_that_was_put_there_by_hand_is_kept_with_its_own_verdict(folder, tmp_path):
    (job,) = jobs_for([folder / "a.bvh"], ["dancer"], tmp_path)
    first = run_job(job, QUICK)
    assert first.reference == str(job.out)
    by_hand = retarget(cut(read_clip(job.clip), 0.0, 0.8), load_robot("dancer"), QUICK.retargeting).reference
    save_reference(by_hand, job.out)
    for config in (QUICK, BatchConfig(strict=True)):  # of other settings too
        kept = run_job(job, config)
        assert kept.skipped and "by hand" in kept.message and kept.seconds == by_hand.duration_s
        assert kept.verdict == ("quarantine" if by_hand.failed_gates else "keep")
    job.out.unlink()
    assert not run_job(job, QUICK).skipped


def test_a_clip_that_is_refused_is_kept_where_it_was_brought_there_by_itself(groove, tmp_path):
    (tmp_path / "m.csv").write_text("1,2,3\n")
    (job,) = jobs_for([tmp_path / "m.csv"], ["dancer"], tmp_path)
    assert run_job(job, QUICK).verdict == "exclude"
    save_reference(groove.reference, job.out)
    assert run_job(job, QUICK).verdict == "keep" and "by hand" in run_job(job, QUICK).message
    job.out.write_bytes(b"nothing")
    assert run_job(job, QUICK).verdict == "exclude"


def test_processes_give_the_arrays_that_one_gives(folder, tmp_path):
    one, two = tmp_path / "one", tmp_path / "two"
    one.mkdir(), two.mkdir()
    clips = [folder / "a.bvh", folder / "b.bvh"]
    list(run_batch(jobs_for(clips, ["dancer"], one), QUICK, 1))
    list(run_batch(jobs_for(clips, ["dancer"], two), QUICK, 2))
    for name in ("a_dancer.npz", "b_dancer.npz"):
        ours, theirs = arrays(one / name), arrays(two / name)
        assert set(ours) == set(theirs)
        for key in ours:
            np.testing.assert_array_equal(ours[key], theirs[key])


@pytest.mark.slow
def test_a_killed_process_loses_nothing_and_doubles_nothing(folder, tmp_path):
    clips = [folder / "a.bvh", folder / "b.bvh", folder / "cut.bvh"]
    jobs = jobs_for(clips, ["dancer", "g1"], tmp_path)

    killed = []

    def kill_a_child():
        """One of the pool's, once the first reference is there and the others are in the making."""
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline and not any(tmp_path.glob("*.npz")):
            time.sleep(0.01)
        for process in Path("/proc").glob("[0-9]*"):
            try:
                parent = (process / "stat").read_text().rsplit(")", 1)[1].split()[1]
                if parent == str(os.getpid()) and b"spawn_main" in (process / "cmdline").read_bytes():
                    os.kill(int(process.name), signal.SIGKILL)
                    killed.append(process.name)
                    return
            except OSError:  # it ended in between
                continue

    killer = threading.Thread(target=kill_a_child)
    killer.start()
    outcomes = list(run_batch(jobs, QUICK, 2))
    killer.join()
    assert killed and len(outcomes) == len(jobs) == len({(o.clip, o.robot) for o in outcomes})
    assert sum(o.verdict == "exclude" for o in outcomes) == 2  # the clip that is cut off, on both robots
    for job in jobs[:4]:
        load_reference(job.out, load_robot(job.robot))
        assert json.loads(job.out.with_suffix(".json").read_text())["verdict"] != "exclude"


def test_the_command_takes_a_folder_and_prints_one_table(folder, tmp_path, monkeypatch, capsys):
    from cli.retarget import main

    monkeypatch.chdir(tmp_path)
    assert main([str(folder), "-o", "out", "--jobs", "1", "--lead-in", "0.5", "--lead-out", "0.5"]) == 3
    said = capsys.readouterr().out
    assert "a.bvh" in said and "1 x refused: " in said and "cut.bvh on dancer" in said and "2 references in out" in said
    table = (tmp_path / "out" / "summary.csv").read_text().splitlines()
    assert len(table) == 4 and table[0].startswith("clip,robot,verdict")
    assert main([str(folder), "--end", "2"]) == 2
    assert "retarget that clip by itself" in capsys.readouterr().err
    assert main([str(tmp_path / "nothing*.bvh")]) == 2


def test_the_result_is_the_single_commands(folder, tmp_path):
    job = Job(clip=folder / "a.bvh", robot="dancer", out=tmp_path / "a.npz")
    run_job(job, QUICK)
    alone = retarget(cut(read_clip(folder / "a.bvh"), 0.0, None), load_robot("dancer"), QUICK.retargeting)
    save_reference(alone.reference, tmp_path / "alone.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "alone.npz").read_bytes()
