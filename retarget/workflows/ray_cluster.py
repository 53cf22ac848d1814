"""The jobs of a batch on a Ray cluster: the same work as in local processes, the same outcomes.

Every node works on the files themselves, so all of them must see one folder of clips and one of results; that, and that
they run the versions of this machine, is asked of each node before the first job.
"""

from __future__ import annotations

import contextlib
import socket
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from retarget.errors import RetargetError
from retarget.workflows.batch import BatchConfig, Job, Outcome, lost, run_job, versions
from robot_models import import_or_refuse

_RETRIES = 2  # of a job whose process or node died
_PATIENCE = 5.0  # for a cluster's first word [s]
_LOOK_AGAIN = 60.0  # whether the cluster still has cores [s]
_AHEAD = 4  # jobs handed out per core of the cluster: enough to keep it busy, few enough to keep the books small


def run_on_ray(jobs: Sequence[Job], config: BatchConfig, address: str) -> Iterator[Outcome]:
    """Outcomes as they come; a worker or node that dies costs its jobs a second try elsewhere.

    Args:
        jobs: of one folder; no two share an output.
        config: what they share.
        address: of the cluster: `host:port`, `auto` for the one of this machine, or `local` to start one here.

    Raises:
        RetargetError: no Ray, no cluster there, or a node that does not see the files or runs other versions.
    """
    ray = _connected(address, jobs[0].out.parent)
    try:
        _check_nodes(ray, jobs[0], address)
        work = ray.remote(num_cpus=1, max_retries=_RETRIES)(_work)
        waiting = list(reversed(jobs))
        at_work: dict[Any, Job] = {}
        while waiting or at_work:
            while waiting and len(at_work) < _AHEAD * max(1.0, ray.cluster_resources().get("CPU", 0.0)):
                job = waiting.pop()
                at_work[work.remote(job, config, str(Path.cwd()))] = job
            finished, _ = ray.wait(list(at_work), timeout=_LOOK_AGAIN)
            if not finished and not ray.cluster_resources().get("CPU"):
                raise _without_cores(address)
            for done in finished:
                job = at_work.pop(done)
                try:
                    yield ray.get(done)
                except ray.exceptions.RayError as e:
                    yield lost(job, f"lost on the cluster, {1 + _RETRIES} tries at most ({type(e).__name__})")
    finally:
        ray.shutdown()


def _work(job: Job, config: BatchConfig, folder: str) -> Outcome:
    with contextlib.chdir(folder):
        return run_job(job, config)


def _connected(address: str, results: Path) -> Any:
    cure = "pip install 'dance-retarget[scale]'"
    where = f"Ray cluster {address}"
    ray = import_or_refuse("ray", RetargetError(where, found="no Ray", expected="it installed", cure=cure))
    try:
        if address not in ("auto", "local"):
            # Ray itself would try for ten minutes.
            host, _, port = address.rpartition("/")[2].rpartition(":")
            socket.create_connection((host, int(port)), timeout=_PATIENCE).close()
        # Ray puts the current folder first on its workers' path, where clips in `clips/` would hide our package.
        with contextlib.chdir(results):
            ray.init(address=address, log_to_driver=False, logging_level="ERROR")
    except (OSError, RuntimeError, ValueError) as e:
        raise RetargetError(
            f"Ray cluster {address}", found=f"no cluster ({str(e).splitlines()[0]})", expected="one, of this version of Ray",
            cure="start it with 'ray start --head' and give its host:port, or start one here with the address 'local'",
        ) from e  # fmt: skip
    return ray


def _check_nodes(ray: Any, job: Job, address: str) -> None:
    from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

    with tempfile.NamedTemporaryFile(dir=job.out.parent, prefix=".seen-by-all-", suffix=".tmp") as token:
        asked = {}
        for node in ray.nodes():
            if node["Alive"] and node["Resources"].get("CPU"):
                place = NodeAffinitySchedulingStrategy(node["NodeID"], soft=False)
                ask = ray.remote(num_cpus=0, scheduling_strategy=place)(_seen)
                asked[ask.remote(job, Path(token.name), str(Path.cwd()))] = node["NodeManagerAddress"]
        if not asked:
            raise _without_cores(address)
        for answer, name in asked.items():
            try:
                theirs = ray.get(answer)
            except ray.exceptions.RayError as e:
                raise RetargetError(
                    f"Ray node {name}", found=f"no answer ({type(e).__name__}: {str(e).splitlines()[-1]})",
                    expected="this toolkit installed there", cure="install the same environment on every node",
                ) from e  # fmt: skip
            if theirs["missing"]:
                raise RetargetError(
                    f"Ray node {name}", found=f"no {theirs['missing']}", expected="the files that this machine sees",
                    cure="put clips and results into a folder that all nodes mount at the same path",
                )  # fmt: skip
            for package, ours in versions().items():
                if theirs["versions"][package] != ours:
                    raise RetargetError(
                        f"Ray node {name}", found=f"{package} {theirs['versions'][package]}", expected=ours,
                        cure="install the same environment on every node",
                    )  # fmt: skip


def _without_cores(address: str) -> RetargetError:
    return RetargetError(
        f"Ray cluster at {address}", found="no node with a core", expected="one at least", cure="let workers join first"
    )


def _seen(job: Job, token: Path, folder: str) -> dict[str, Any]:
    """What a node sees and runs."""
    here = Path(folder)
    missing = [p for p in (here, here / job.clip, here / token) if not p.exists()]
    return {"missing": str(missing[0]) if missing else "", "versions": versions()}
