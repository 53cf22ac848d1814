"""What `dance-deploy` asks of a bundle before any wire is opened."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from cli.deploying.arguments import Arguments
from cli.shell import GATE
from tracking import TrackingError

if TYPE_CHECKING:
    from tracking.deploy import RobotLimits
    from tracking.policy import Runner


def checked(args: Arguments, say: Callable[[str], None]) -> tuple[Runner, RobotLimits]:
    """The policy, held against the robot's own profile and its golden trace; a tracker of ours has none."""
    from robot_models import load_robot
    from tracking import read_golden, replay
    from tracking.deploy import RobotLimits
    from tracking.policy import GOLDEN, read_runner

    limits = RobotLimits.of(load_robot("g1"))
    folder, runner = read_runner(args.bundle, args.ref)
    limits.check(runner.contract)
    if runner.contract.follows_any:
        say(f"a tracker, on {args.dance or args.ref}")
    else:
        say(f"golden trace repeated to {replay(runner, read_golden(folder / GOLDEN)):.1e}")
    _show_certificate(args, folder, say)
    return runner, limits


def _show_certificate(args: Arguments, folder: Path, say: Callable[[str], None]) -> None:
    """What is known of this policy; without a certificate nothing is sent to a real robot."""
    from tracking.evaluation import read_certificate

    certificate = read_certificate(folder)
    for line in [] if certificate is None else certificate.lines():
        say(f"certificate: {line}")
    if certificate is None:
        say(f"no certificate: dance-certify {folder} makes one")
    good = certificate is not None and certificate.finished.count >= GATE * certificate.finished.of
    if args.send and args.interface != "lo" and not (good or args.uncertified):
        raise TrackingError(
            str(folder), found="no certificate" if certificate is None else f"a policy that finishes {certificate.finished}",
            expected=f"a certificate of at least {100 * GATE:.0f} %, before a robot does it",
            cure=f"dance-certify {folder}, or --uncertified where you know better",
        )  # fmt: skip
