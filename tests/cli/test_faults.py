"""Signals, kills, full disks and two of one kind: outputs are whole or absent, and nobody works on for a dead parent."""

import os
import shutil
import signal
import subprocess
import sys
import time

import pytest
from conftest import ROOT, SAMPLES

import cli.export
from clips import OutputError, folder_aside, write_whole
from tracking import TrackingError
from tracking.training.folder_lock import alone_in

BATCH = "import sys, cli.retarget as m; sys.exit(m.main(sys.argv[1:]))"


def test_a_folder_is_held_by_one_run_and_let_go_at_its_end(tmp_path):
    with alone_in(tmp_path), pytest.raises(TrackingError, match="another run"), alone_in(tmp_path):
        pass
    with alone_in(tmp_path):
        pass


def test_a_run_that_is_killed_lets_go_of_its_folder(tmp_path):
    script = (
        "import sys, time\nfrom pathlib import Path\nfrom tracking.training.folder_lock import alone_in\n"
        "with alone_in(Path(sys.argv[1])):\n print('in', flush=True); time.sleep(60)"
    )
    child = subprocess.Popen([sys.executable, "-c", script, str(tmp_path)], stdout=subprocess.PIPE, cwd=ROOT)
    assert child.stdout.readline() == b"in\n"
    with pytest.raises(TrackingError, match="another run"), alone_in(tmp_path):
        pass
    child.kill()
    child.wait()
    child.stdout.close()
    with alone_in(tmp_path):
        pass


def test_a_folder_aside_is_whole_or_absent_and_what_a_kill_left_is_cleared(tmp_path):
    (tmp_path / ".b.part").mkdir()
    (tmp_path / ".b.part" / "old").touch()
    with pytest.raises(ValueError, match="mine"), folder_aside(tmp_path / "b") as beside:
        (beside / "x").touch()
        raise ValueError("mine")
    assert not list(tmp_path.iterdir())
    with folder_aside(tmp_path / "b") as beside:
        assert not list(beside.iterdir())
        (beside / "x").touch()
    assert [p.name for p in (tmp_path / "b").iterdir()] == ["x"] and [p.name for p in tmp_path.iterdir()] == ["b"]


@pytest.fixture
def full(tmp_path):
    """A folder of a quarter of a megabyte, on a file system of its own where we may make one."""
    folder = tmp_path / "full"
    folder.mkdir()
    if subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(folder)], capture_output=True
    ).returncode:
        pytest.skip("nobody may mount here")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def test_a_full_disk_is_a_refusal_in_export_and_leaves_nothing(full, capsys):
    pytest.importorskip("onnxruntime")
    assert cli.export.main(["groove-dancer", "-o", str(full / "bundle")]) == 2
    assert "disk with room" in capsys.readouterr().err and not list(full.iterdir())


def test_a_full_disk_is_a_refusal_in_training_and_the_last_checkpoint_stays(full):
    torch = pytest.importorskip("torch")
    import io

    for size in (1000, 100_000):
        content = io.BytesIO()
        torch.save({"x": torch.zeros(size)}, content)
        if size == 1000:
            with write_whole(full / "checkpoint.pt") as stream:
                stream.write(content.getbuffer())
        else:
            with pytest.raises(OutputError, match="disk with room"), write_whole(full / "checkpoint.pt") as stream:
                stream.write(content.getbuffer())
    assert len(torch.load(full / "checkpoint.pt", weights_only=True)["x"]) == 1000
    assert [p.name for p in full.iterdir()] == ["checkpoint.pt"]


def children(group):
    """Processes of a group that are still there."""
    told = subprocess.run(["ps", "-eo", "pgid=,stat="], capture_output=True, text=True, check=True).stdout.split("\n")
    return [line for line in told if line.split()[:1] == [str(group)] and "Z" not in line]


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("ps") is None, reason="no ps")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGKILL])
def test_a_batch_that_is_stopped_ends_its_workers_and_tells_what_was_done(number, tmp_path):
    (tmp_path / "clips").mkdir()
    for k in range(16):
        shutil.copy(SAMPLES / "groove.csv", tmp_path / "clips" / f"c{k}.csv")
    out = tmp_path / "out"
    child = subprocess.Popen(
        [sys.executable, "-c", BATCH, str(tmp_path / "clips"), "-o", str(out), "--jobs", "2"], cwd=ROOT, start_new_session=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    until = time.monotonic() + 120.0
    # Of two workers: the first of four files belong to clips whose recordings too are written.
    while len(list(out.glob("*.npz"))) < 4 and time.monotonic() < until:
        time.sleep(0.05)
    os.kill(child.pid, number)
    child.wait(30)
    until = time.monotonic() + 10.0
    while children(child.pid) and time.monotonic() < until:
        time.sleep(0.1)
    assert not children(child.pid)
    assert len(list(out.glob("*.npz"))) < 16
    if number != signal.SIGKILL:
        assert any(f"c{k}" in (out / "summary.csv").read_text() for k in range(16))
