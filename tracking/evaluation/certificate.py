"""A policy's certificate: how often it finishes, over so many drawn robots that one knows; what it stands; what nobody tried.

It holds for the very files that it names by their hashes, and for nothing else.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

from clips import write_whole
from robot_models import __version__
from robot_models.incoming import MAX_CONFIG, parsed, read_bytes, read_text, reading
from robot_models.maths import Progress, silent
from tracking.config import TaskConfig
from tracking.errors import TrackingError
from tracking.evaluation.condition_sweep import sweep
from tracking.evaluation.rollouts import Evaluation, evaluate, evaluation_task
from tracking.evaluation.share import Share, wilson
from tracking.policy import CONTRACT, GOLDEN, POLICY, REFERENCE, Bundle, load_bundle

CERTIFICATE = "certificate.json"
FORMAT = 1
CONDITIONS = (
    "as trained, no pushes", "delay 10 ms", "delay 20 ms", "delay 30 ms", "delay 40 ms", "friction 0.3", "friction 0.5",
    "friction 0.8", "friction 1.2", "pushes as trained", "pushes twice that",
)  # fmt: skip
NOT_TRIED = (
    "a real robot",
    "floors that are uneven, soft, inclined or wet; shoes",
    "motors that grow hot, a battery that sags, backlash and friction beyond the model's",
    "the parallel mechanisms of ankles and waist",
    "an IMU that drifts; delays that change within a dance",
    "people and things within reach",
)


@dataclass(frozen=True, kw_only=True)
class Tried:
    """One condition in one engine."""

    condition: str
    engine: str
    finished: Share
    stood: Share


@dataclass(frozen=True, kw_only=True)
class Certificate:
    """What was measured on one policy, and on which files."""

    robot: str
    robot_hash: str
    dance_s: float
    finished: Share  # over drawn robots, as trained, without pushes
    fell: Share
    strayed: Share  # a hand or a foot too far off; the robot stood
    hardest: tuple[tuple[float, int], ...]  # seconds of the dance [s] and how many failed there, the worst first
    tried: tuple[Tried, ...]
    not_tried: tuple[str, ...]
    sha256: dict[str, str]  # of the bundle's files
    versions: dict[str, str]
    seed: int
    minutes: float

    def lines(self) -> list[str]:
        """For somebody who is about to run it."""
        late = {t.condition.removeprefix("delay "): t.finished for t in self.tried if t.condition.startswith("delay")}
        delays = ", ".join(f"{100 * s.count / s.of:.0f} % at {name}" for name, s in late.items())
        seconds = ", ".join(f"{at:.0f} s ({n})" for at, n in self.hardest) or "none"
        return [
            f"finishes {self.finished}, falls {self.fell}, strays {self.strayed}",
            f"hardest seconds: {seconds}; with delay: {delays or 'not tried'}",
            f"never tried: {'; '.join(self.not_tried)}",
        ]


def certify(
    bundle: Path,
    *,
    half_width: float = 0.01,
    most: int = 4000,
    engines: Sequence[str] = ("mujoco",),
    conditions: Sequence[str] = CONDITIONS,
    each: int = 100,
    seed: int = 1,
    jobs: int = 1,
    progress: Progress = silent,
) -> Certificate:
    """Roll out until the share that finishes is known to `half_width`, then under every condition in every engine.

    Args:
        bundle: as for `load_bundle`.
        half_width: of the 95 % interval.
        most: rollouts, where that is not reached before.
        engines: names in `ENGINES`; the main number is MuJoCo's.
        conditions: names in `condition_sweep.CONDITIONS`.
        each: rollouts of each condition.
        seed: of noise and robots; every round has its own.
        jobs: processes of the conditions.
        progress: told after every round.
    """
    began = time.perf_counter()
    loaded = load_bundle(bundle)
    files = _hashes(loaded.folder)
    rounds = _rounds(loaded, half_width, most, each, seed, progress)
    count = sum(r.rollouts for r in rounds)
    cells = sweep(bundle, engines, conditions=conditions, rollouts=each, seed=seed, jobs=jobs, progress=progress)
    tried = tuple(
        Tried(
            condition=c.condition, engine=c.engine, finished=_share(c.result.finished, each), stood=_share(c.result.stood, each)
        )
        for c in cells
    )  # fmt: skip
    if _hashes(loaded.folder) != files:
        raise TrackingError(
            str(bundle), found="files that changed meanwhile", expected="one bundle", cure="certify it again"
        )
    failures = {s.at_s: sum(r.seconds[k].failed for r in rounds) for k, s in enumerate(rounds[0].seconds)}
    return Certificate(
        robot=loaded.robot.name,
        robot_hash=loaded.robot.hash,
        dance_s=rounds[0].duration_s,
        finished=Share(count=sum(r.outcomes["finished"].count for r in rounds), of=count),
        fell=Share(count=sum(r.outcomes["fell"].count for r in rounds), of=count),
        strayed=Share(count=sum(r.outcomes["strayed"].count for r in rounds), of=count),
        hardest=tuple(sorted(((at, n) for at, n in failures.items() if n), key=lambda pair: -pair[1])[:3]),
        tried=tried,
        not_tried=(*NOT_TRIED, *(f"the engine {e}" for e in ("physx-isaac", "physx-motor") if e not in engines)),
        sha256=files,
        versions={"dance-retarget": __version__, **{p: version(p) for p in ("numpy", "mujoco", "onnxruntime")}},
        seed=seed,
        minutes=(time.perf_counter() - began) / 60.0,
    )


def _rounds(bundle: Bundle, half_width: float, most: int, each: int, seed: int, progress: Progress) -> list[Evaluation]:
    """Evaluations on ever new robots until the interval is narrow enough."""
    rounds: list[Evaluation] = []
    while not rounds or (_too_wide(rounds, half_width) and sum(r.rollouts for r in rounds) < most):
        result = evaluate(
            bundle.runner, bundle.robot, bundle.reference, evaluation_task(TaskConfig()), rollouts=each,
            seed=seed + 1000 + len(rounds),
        )  # fmt: skip
        rounds.append(replace(result, shown={}))
        progress("rollouts", sum(r.rollouts for r in rounds), most)
    return rounds


def _too_wide(rounds: Sequence[Evaluation], half_width: float) -> bool:
    low, high = wilson(sum(round(r.finished * r.rollouts) for r in rounds), sum(r.rollouts for r in rounds))
    return high - low > 2.0 * half_width


def _share(of_all: float, rollouts: int) -> Share:
    return Share(count=round(of_all * rollouts), of=rollouts)


def _hashes(folder: Path) -> dict[str, str]:
    files = (folder / name for name in (POLICY, CONTRACT, REFERENCE, GOLDEN))
    return {
        f.name: hashlib.sha256(read_bytes(f, expected="a file of the bundle", error=TrackingError)).hexdigest()
        for f in files
        if f.exists()
    }


def write_certificate(path: Path, certificate: Certificate) -> None:
    """Write it as JSON, whole or not at all."""
    with write_whole(path) as stream:
        stream.write(json.dumps({"format": FORMAT, **asdict(certificate)}, indent=1).encode())


def read_certificate(folder: Path) -> Certificate | None:
    """The certificate beside a bundle; None where there is none.

    Raises:
        TrackingError: it is none, or was made for other files than those that lie there.
    """
    path = folder / CERTIFICATE
    if not path.exists():
        return None
    expected = "a certificate that dance-certify wrote"
    text = read_text(path, expected=expected, most=MAX_CONFIG, error=TrackingError)
    told = parsed(json.loads, text, str(path), expected=expected, error=TrackingError)
    with reading(str(path), expected=expected, error=TrackingError):
        if told.pop("format") != FORMAT:
            raise ValueError("another format")
        shares: dict[str, Any] = {name: Share(**told.pop(name)) for name in ("finished", "fell", "strayed")}
        tried = tuple(
            Tried(
                condition=t["condition"], engine=t["engine"], finished=Share(**t["finished"]), stood=Share(**t["stood"])
            )
            for t in told.pop("tried")
        )
        hardest = tuple((float(at), int(n)) for at, n in told.pop("hardest"))
        not_tried = tuple(map(str, told.pop("not_tried")))
        certificate = Certificate(**told, **shares, tried=tried, hardest=hardest, not_tried=not_tried)
        certificate.lines()
        if not isinstance(certificate.sha256, dict):
            raise ValueError("no hashes")
    now = _hashes(folder)
    other = [name for name in {*now, *certificate.sha256} if now.get(name) != certificate.sha256.get(name)]
    if other:
        raise TrackingError(
            str(path), found=f"a certificate for another {', '.join(sorted(other))}", expected="one for these files",
            cure="certify this bundle anew",
        )  # fmt: skip
    return certificate
