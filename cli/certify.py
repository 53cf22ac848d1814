"""`dance-certify`: how often a policy finishes, known to a per cent; what it stands, and what nobody tried."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from pathlib import Path

from cli.shell import GATE, ClipPath, TellOptions, Verdict, command, line, progress, tell
from clips import write_whole
from tracking import TrackingError


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Write a policy's certificate: one page to read (HTML) and one for programs (JSON), which `dance-deploy` asks for.

    Rollouts on drawn robots until the share that finishes is known to within a per cent (95 %), then delays of 10 to 40 ms,
    floors and pushes in every engine, the hardest seconds, what was not tried, and the hashes of all that it holds for.

    Examples:
        dance-certify bundle
        dance-certify groove-g1 --engine all --page groove-g1.html
        dance-certify runs/dance --half-width 0.02 --each 50
    """

    bundle: ClipPath
    """Folder of the bundle, or the name of a policy that comes with the package."""
    engine: str = "mujoco"
    """For the conditions: mujoco, physx-isaac, physx-motor, physx, or all."""
    half_width: float = 0.01
    """Of the 95 % interval of the share that finishes."""
    most: int = 4000
    """Rollouts at most, where the interval is still wider."""
    each: int = 100
    """Rollouts of each condition."""
    seed: int = 1
    """Seed of noise and robots."""
    jobs: int = 0
    """Processes; 0: as many as the cores that this process may use."""
    certificate: Path | None = None
    """Where the certificate goes; by default into the bundle, as certificate.json."""
    page: Path | None = None
    """Where the page goes; by default into the bundle, as certificate.html."""
    tell: TellOptions = field(default_factory=TellOptions)


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-certify`."""
    return command(Arguments, run, name="dance-certify", argv=argv)


def run(args: Arguments) -> int:
    """Roll out, write both pages, say the main lines."""
    from cli.recordings import certificate_page
    from robot_models.maths import available_threads
    from tracking import engine_names, load_bundle
    from tracking.evaluation import CERTIFICATE, certify, write_certificate

    if not (0.0 < args.half_width < 0.5 and args.each > 0 and args.most > 0):
        found = f"{args.half_width}, {args.each}, {args.most}"
        raise TrackingError("--half-width, --each, --most", found=found, expected="a share below 0.5, positive numbers")
    folder = load_bundle(args.bundle).folder
    with progress("rollouts") as follow:
        certificate = certify(
            args.bundle, half_width=args.half_width, most=args.most, engines=engine_names(args.engine), each=args.each,
            seed=args.seed, jobs=args.jobs or available_threads(), progress=follow,
        )  # fmt: skip
    path, page = args.certificate or folder / CERTIFICATE, args.page or folder / "certificate.html"
    write_certificate(path, certificate)
    with write_whole(page) as stream:
        stream.write(certificate_page(args.bundle.name, certificate).encode())
    first, *more = certificate.lines()
    verdict = Verdict(
        passed=certificate.finished.interval[0] >= GATE - args.half_width,
        line=f"{args.bundle.name}: {first}",
        notes=tuple(more),
        written=(path, page),
        steps=((line("dance-deploy", args.bundle, "--rehearse"), "over a robot's own messages, on this machine (G1)"),),
        data={"certificate": asdict(certificate)},
    )
    return tell(verdict, args.tell)
