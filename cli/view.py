"""`dance-view`: a dance as a page in the browser, live or as one file to send to a friend."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated

import tyro

from cli.judging import followed
from cli.shell import DONE, FileOptions, TellOptions, Verdict, command, make_folder, progress, some, tell
from clips import OutputError
from robot_models import DanceError


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Look at a dance in the browser: robot and person, what the feet do, the floor's forces, and where it goes wrong.

    Without a file the page waits for one to be dropped on it.

    Examples:
        dance-view
        dance-view groove_g1.npz
        dance-view dance.bvh --robot g1
        dance-view before.npz after.npz
        dance-view groove-g1
        dance-view tracker-g1 --ref groove_g1.npz
        dance-view tracker-g1 --dance groove --web groove.html
        dance-view groove_g1.npz --web groove.html
    """

    what: Annotated[tuple[Path, ...], tyro.conf.Positional] = ()
    """References, recordings of people, other tools' motions; several stand side by side. Or one policy: a folder, or the
    name of one that comes with the package."""
    robot: str | None = None
    """The robot that a recording is brought to; or the profile of a reference's."""
    ref: Path | None = None
    """What a tracker shall follow: any reference of its robot."""
    dance: str | None = None
    """The same by the name of a dance that the tracker knows; any other name tells which there are."""
    tracker: str = "auto"
    """What dances a recording with physics at a click: another lab's tracker (an ONNX), a name, none; auto: the robot's own
    where one comes with the package."""
    web: Path | None = None
    """Write the page as one file (.html) that opens from disk without a network, and end."""
    host: str = "127.0.0.1"
    """Address to listen at; 0.0.0.0 lets other machines look on."""
    port: int = 8080
    """The first port to try."""
    browser: bool = True
    """Open the browser, where there is a display."""
    file: FileOptions = field(default_factory=FileOptions)
    tell: TellOptions = field(default_factory=TellOptions)


def main(argv: list[str] | None = None) -> int:
    """Entry point of `dance-view`."""
    return command(Arguments, run, name="dance-view", argv=argv)


def run(args: Arguments) -> int:
    """Gather what there is to see, and show or write it."""
    from cli.viewing import is_motion, panel_of, serve, show_of
    from retarget.workflows import SUFFIXES

    if args.web is not None and args.web.suffix != ".html":
        raise OutputError(f"--web {args.web}", found="that name", expected="a file that ends in .html")
    if args.web is not None or args.dance is not None:
        some(args.what, "a file or a policy")
    if (args.ref or args.dance) and any(what.suffix in SUFFIXES for what in args.what):
        given = f"--dance {args.dance}" if args.dance else f"--ref {args.ref}"
        raise OutputError(given, found="motions beside it", expected="a tracker, which follows it")
    what = args.what, args.robot, args.file
    with contextlib.ExitStack() as stack:
        ref = args.ref
        if args.dance is not None or (ref is None and len(args.what) == 1 and not is_motion(args.what[0])):
            ref = stack.enter_context(followed(args.what[0], ref, args.dance, args.file, args.tell.console()))
        if args.web is not None:
            return tell(_page(replace(args, ref=ref), args.web), args.tell)
        panel = panel_of(*what, stack, ref, args.tracker)
        show = show_of(*what, ref) if panel is None else panel.show
        serve(show, panel, args.host, args.port, args.browser)
    return DONE


def _page(args: Arguments, web: Path) -> Verdict:
    """Write the page: a policy with its physics where a page can compute both, else what it danced here."""
    from cli.viewing import is_motion, policy_page, show_of
    from retarget.stage import save_page

    make_folder(web)
    alone = ""
    if len(args.what) == 1 and not is_motion(args.what[0]):
        try:
            return policy_page(args.what[0], args.robot, args.ref, web)
        except DanceError as e:
            alone = f"what it danced here, without its physics: {e}"
    show = show_of(args.what, args.robot, args.file, args.ref)
    with progress("frames") as follow:
        save_page(web, show, follow)
    return Verdict(
        passed=show.passed,
        code=DONE,  # the page is there
        line=f"{show.title}: {show.verdict}; one page of {web.stat().st_size / 1e6:.1f} MB that needs no network",
        notes=(alone,) if alone else (),
        written=(web,),
    )
