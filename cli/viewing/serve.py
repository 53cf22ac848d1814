"""A show on this machine's own address, until Ctrl-C."""

from __future__ import annotations

import contextlib
import webbrowser

from rich.console import Console

from cli.shell import interrupted_by_signals, make_console
from retarget.stage import Page, Panel, Show, close_server, open_server
from robot_models import has_display


def serve(show: Show, panel: Panel | None, host: str, port: int, browser: bool) -> None:
    """Open the page and play.

    Args:
        show: what there is to see.
        panel: more controls, where there is more to do than to look.
        host: address to listen at.
        port: the first to try; the next free one is taken.
        browser: open one, where there is a display.
    """
    server = open_server(host, port)
    console = make_console()
    console.print(f"{show.title}: {show.verdict}")
    address = announce(console, host, server.get_port(), "   (Ctrl-C ends it)")
    if panel is None:
        page = Page(server, show)
    else:
        page = panel.page = Page(server, show, panel.build, panel.ahead)
    if browser and has_display():
        webbrowser.open(address)
    try:
        with interrupted_by_signals(), contextlib.suppress(KeyboardInterrupt):
            page.play(until=lambda: False)
    finally:
        close_server(server)


def announce(console: Console, host: str, port: int, hint: str = "") -> str:
    """Say where the page is, and how to come there; the address."""
    address = f"http://{'localhost' if host in ('127.0.0.1', '0.0.0.0') else host}:{port}"
    console.print(f"look at it: {address}{hint}")
    if not has_display():
        console.print(f"from another machine: ssh -L {port}:localhost:{port} THIS_MACHINE, then the same address there")
    return address
