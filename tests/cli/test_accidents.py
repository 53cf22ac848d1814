"""A full disk, Ctrl-C, kill -9, two runs on one output, a source that changed: whole files or the old ones, and one line."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from conftest import ROOT, SAMPLES

from clips import load_reference
from robot_models import load_robot

RUN = [sys.executable, "-c", "import sys; from cli.retarget import main; sys.exit(main(sys.argv[1:]))"]
SHORT = ["--end", "3", "--lead-in", "0.5", "--lead-out", "0.5"]


def started(folder, *words, limit=None):
    """A retargeting in a process of its own, whose files may not grow over `limit` bytes."""

    def small_disk():
        import resource

        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    return subprocess.Popen(
        [*RUN, str(SAMPLES / "groove.bvh"), *words], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env=os.environ | {"PYTHONPATH": str(ROOT)}, preexec_fn=small_disk if limit else None,
    )  # fmt: skip


@pytest.mark.skipif(sys.platform == "win32", reason="limits of POSIX")
@pytest.mark.parametrize(("limit", "file"), [(200_000, "o.npz"), (600_000, "o.rrd")], ids=["reference", "recording"])
def test_a_full_disk_is_one_line_and_leaves_the_old_files(tmp_path, limit, file):
    (tmp_path / "o.npz").write_bytes(b"old")
    (tmp_path / "o.rrd").write_bytes(b"old")
    run = started(tmp_path, "-o", "o.npz", "--float32", *SHORT, limit=limit)
    _, said = run.communicate(timeout=120)
    assert run.returncode == 2
    assert f"refused: {file}: found" in said and "expected a disk with room" in said and "Traceback" not in said
    assert (tmp_path / "o.rrd").read_bytes() == b"old"
    assert ((tmp_path / "o.npz").read_bytes() == b"old") == (file == "o.npz")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["o.npz", "o.rrd"]


@pytest.mark.slow
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
@pytest.mark.parametrize("after", [1.0, 2.0, 3.0])
def test_an_interrupted_run_leaves_the_old_file_or_a_whole_new_one(tmp_path, how, after):
    (tmp_path / "o.npz").write_bytes(b"old")
    run = started(tmp_path, "-o", "o.npz")
    time.sleep(after)
    run.send_signal(how)
    run.communicate(timeout=120)
    if (tmp_path / "o.npz").read_bytes() != b"old":
        load_reference(tmp_path / "o.npz", load_robot("dancer"))
    if how == signal.SIGINT:
        assert run.returncode in (0, 1, 130, -signal.SIGINT)
        assert not [p for p in tmp_path.iterdir() if p.name.startswith(".")]


@pytest.mark.slow
def test_two_runs_on_one_output_do_not_mix(tmp_path):
    words = ("-o", "o.npz", "--lead-in", "0.5", "--lead-out", "0.5")
    runs = [started(tmp_path, *words, "--end", end) for end in ("2", "3")]
    for run in runs:
        run.communicate(timeout=120)
    assert {run.returncode for run in runs} <= {0, 1}
    alone = []
    for end in ("2", "3"):
        started(tmp_path, "-o", f"{end}.npz", *words[2:], "--end", end, "--no-recording").communicate(timeout=120)
        alone.append((tmp_path / f"{end}.npz").read_bytes())
        (tmp_path / f"{end}.npz").unlink()
    assert (tmp_path / "o.npz").read_bytes() in alone
    assert sorted(p.name for p in tmp_path.iterdir()) == ["o.npz", "o.rrd"]


def test_verify_tells_a_changed_source_from_the_one_it_was_made_from(groove_file, tmp_path, capsys):
    from cli.verify import main

    same, other = tmp_path / "groove.bvh", tmp_path / "other.bvh"
    same.write_bytes((SAMPLES / "groove.bvh").read_bytes())
    other.write_bytes(same.read_bytes() + b"\n")
    assert main([str(groove_file), "--source", str(same)]) == 0
    assert "is what it was made from" in capsys.readouterr().out
    assert main([str(groove_file), "--source", str(other)]) == 1
    assert "other bytes" in capsys.readouterr().out
    with np.load(groove_file) as data:
        arrays = dict(data)
    arrays["body_pos_w"][40, 5] += 1e-6
    np.savez(tmp_path / "bent.npz", **arrays)
    assert main([str(tmp_path / "bent.npz")]) == 2
    assert "the file was edited" in capsys.readouterr().err
