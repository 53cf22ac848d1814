"""A batch on a real Ray cluster of three nodes: the arrays of local work, and nothing lost when workers and nodes die."""

import dataclasses
import os
import signal
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from conftest import SAMPLES

ray = pytest.importorskip("ray")
pytestmark = [
    pytest.mark.slow,
    # Ray leaves its sockets and pipes to the end of the process.
    pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning"),
    pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::FutureWarning"),
]

from clips import cut, read_clip, save_reference
from retarget import RetargetConfig, RetargetError, retarget
from retarget.workflows import ray_cluster as on_cluster
from retarget.workflows.batch import BatchConfig, jobs_for, motion_files, run_batch
from robot_models import load_robot

QUICK = BatchConfig(retargeting=RetargetConfig(lead_in_s=0.3, lead_out_s=0.3, dynamics=False))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Twenty clips: thirteen BVH, six CSV, one npz."""
    path = tmp_path_factory.mktemp("twenty")
    for sample, count in (("groove.bvh", 13), ("groove.csv", 6)):
        lines = (SAMPLES / sample).read_text().splitlines()
        bvh = sample.endswith("bvh")
        first = 1 + next(i for i, line in enumerate(lines) if line.startswith("Frame Time:" if bvh else "time,"))
        for k in range(count):
            rows = lines[first + 25 * k : first + 25 * k + 60]
            head = [*lines[: first - 2], f"Frames: {len(rows)}", lines[first - 1]] if bvh else lines[:first]
            (path / f"{Path(sample).suffix[1:]}_{k:02d}{Path(sample).suffix}").write_text(
                "\n".join([*head, *rows]) + "\n"
            )
    clip = cut(read_clip(SAMPLES / "groove.bvh"), 3.0, 4.5)
    save_reference(retarget(clip, load_robot("g1"), QUICK.retargeting).reference, path / "made_here.npz")
    return path


@pytest.fixture
def cluster():
    """A head without cores and two nodes of one core each."""
    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    from ray.cluster_utils import Cluster

    small = {"object_store_memory": 80_000_000}
    made = Cluster(initialize_head=True, head_node_args={"num_cpus": 0, "include_dashboard": False, **small})
    made.workers = [made.add_node(num_cpus=1, **small) for _ in range(2)]
    yield made
    ray.shutdown()
    made.shutdown()


FINISHED = "[!.]*.npz"  # what a killed process leaves half written is hidden, and no command looks at it


def arrays(folder):
    for path in sorted(folder.glob(FINISHED)):
        with np.load(path) as data:
            yield from ((path.name, key, data[key]) for key in data.files)


def test_twenty_clips_for_two_robots_give_the_same_arrays_here_and_on_the_cluster(folder, cluster, tmp_path):
    here, there = tmp_path / "here", tmp_path / "there"
    here.mkdir(), there.mkdir()
    clips = motion_files(folder, but=tmp_path)
    assert len(clips) == 20
    local = list(run_batch(jobs_for(clips, ["dancer", "g1"], here), QUICK, 2))
    jobs = jobs_for(clips, ["dancer", "g1"], there)

    def kill_one_worker():
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline and not any(there.glob(FINISHED)):
            time.sleep(0.05)
        while time.monotonic() < deadline:
            for process in Path("/proc").glob("[0-9]*"):
                try:
                    if (process / "cmdline").read_bytes().startswith(b"ray::_work"):
                        os.kill(int(process.name), signal.SIGKILL)
                        killed.append(int(process.name))
                        return
                except OSError:
                    continue

    killed = []
    killer = threading.Thread(target=kill_one_worker)
    killer.start()
    remote = list(on_cluster.run_on_ray(jobs, QUICK, cluster.address))
    killer.join()
    assert killed
    assert sorted((o.clip, o.robot) for o in remote) == sorted((str(j.clip), j.robot) for j in jobs)  # each once
    by_pair = {(o.clip, o.robot): o for o in remote}
    for outcome in local:
        other = by_pair[outcome.clip, outcome.robot]
        assert (outcome.verdict, outcome.metrics, outcome.key) == (other.verdict, other.metrics, other.key)
    assert not any(o.verdict == "exclude" for o in local)
    ours, theirs = list(arrays(here)), list(arrays(there))
    assert len({name for name, *_ in ours}) == 40 and [x[:2] for x in ours] == [x[:2] for x in theirs]
    for (name, key, a), (_, _, b) in zip(ours, theirs, strict=True):
        np.testing.assert_array_equal(a, b, err_msg=f"{name}: {key}")
    again = list(on_cluster.run_on_ray(jobs, QUICK, cluster.address))
    assert len(again) == 40 and all(o.skipped for o in again)


def test_a_node_that_dies_costs_no_clip(folder, cluster, tmp_path):
    jobs = jobs_for(motion_files(folder, but=tmp_path)[:6], ["dancer"], tmp_path)
    outcomes = []
    for outcome in on_cluster.run_on_ray(jobs, QUICK, cluster.address):
        if not outcomes:
            cluster.remove_node(cluster.workers[0], allow_graceful=False)
        outcomes.append(outcome)
    assert sorted(o.clip for o in outcomes) == sorted(str(j.clip) for j in jobs)
    assert all(o.verdict != "exclude" for o in outcomes), [o.message for o in outcomes]


def test_a_node_with_other_versions_or_without_the_files_is_refused_by_name(folder, cluster, tmp_path, monkeypatch):
    jobs = jobs_for(motion_files(folder, but=tmp_path)[:1], ["dancer"], tmp_path)
    ours = on_cluster.versions()
    monkeypatch.setattr(on_cluster, "versions", lambda: ours | {"numpy": "1.0"})
    with pytest.raises(RetargetError, match=r"Ray node .*numpy"):
        list(on_cluster.run_on_ray(jobs, QUICK, cluster.address))
    monkeypatch.undo()
    gone = dataclasses.replace(jobs[0], clip=tmp_path / "elsewhere.bvh")
    with pytest.raises(RetargetError, match=r"Ray node .*elsewhere.bvh"):
        list(on_cluster.run_on_ray([gone], QUICK, cluster.address))


def test_no_cluster_is_refused_with_its_address(folder, tmp_path):
    jobs = jobs_for(motion_files(folder, but=tmp_path)[:1], ["dancer"], tmp_path)
    with pytest.raises(RetargetError, match="127.0.0.1:1"):
        list(on_cluster.run_on_ray(jobs, QUICK, "127.0.0.1:1"))
