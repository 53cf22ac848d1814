"""A policy as a page in which it dances by itself, and can be pushed."""

from __future__ import annotations

from pathlib import Path

from cli.shell import DONE, Verdict, make_folder
from clips import OutputError


def policy_page(policy: Path, robot: str | None, reference: Path | None, web: Path) -> Verdict:
    """Write it.

    Args:
        policy: a bundle, or the name of one that comes with the package; or a tracker.
        robot: its robot's profile, where that is not a built-in one.
        reference: what a tracker shall follow.
        web: the page.

    Raises:
        OutputError: the name is no page's, or its parts are not built.
        TrackingError: no policy, or one that a page cannot compute.
    """
    from tracking import load_bundle
    from tracking.playground import save_playground

    if web.suffix != ".html":
        raise OutputError(f"--web {web}", found="that name", expected="a file that ends in .html")
    bundle = load_bundle(policy, robot=robot, reference=reference)
    make_folder(web)
    save_playground(web, bundle, policy.name)
    megabytes = web.stat().st_size / 1e6
    return Verdict(
        passed=True,
        code=DONE,
        line=f"{policy.name} on {bundle.robot.name}, with its physics; one page of {megabytes:.1f} MB that needs no network",
        written=(web,),
    )
