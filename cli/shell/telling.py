"""How a verdict is told: first its line, then what it follows from; for machines as JSON."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.text import Text

from cli.shell.console import make_console
from cli.shell.options import make_folder
from cli.shell.verdict import Verdict
from clips import write_whole

_STDOUT = Path("-")


@dataclass(frozen=True, kw_only=True)
class TellOptions:
    """How a result is told."""

    verbose: bool = False
    """Print everything that was measured and recognised, not the verdict alone."""
    json: Path | None = None
    """Write the verdict with every number here; -: to standard output, and the words to standard error."""

    def console(self, **options: Any) -> Console:
        """Where words go."""
        return make_console(stderr=self.json == _STDOUT, **options)


def tell(
    verdict: Verdict,
    options: TellOptions,
    details: Sequence[Any] = (),
    shown: Sequence[Any] = (),
    console: Console | None = None,
) -> int:
    """Print a verdict, and with --verbose what it follows from; returns the exit code.

    Args:
        verdict: of a command.
        options: how to tell it.
        details: tables and lines of everything that was measured.
        shown: tables that are the answer, and come without being asked for.
        console: where words go, if elsewhere.
    """
    console = console or options.console()
    if not console.is_terminal:
        console.width = 200  # tables in pipes and logs are not cut to a screen
    console.print(_mark(console, verdict))
    for line in (f"  {'; '.join(verdict.numbers)}" if verdict.numbers else None, *(f"  {n}" for n in verdict.notes)):
        if line is not None:
            console.print(line)
    for doubt in verdict.doubts:
        console.print(f"  doubtful: {doubt}", style="yellow")
    for trouble in verdict.troubles:
        console.print(f"  {trouble.what}", style="red")
        for what, command in trouble.cures:
            console.print(f"    {what}{': ' if command else ''}{command}")
    for detail in (*shown, *(details if options.verbose else ())):
        console.print(detail)
    for path in verdict.written:
        console.print(f"wrote {path} ({_size(path)})")
    if verdict.steps:
        console.print("next:")
        width = max(len(command) for command, _ in verdict.steps)
        for command, why in verdict.steps:
            console.print(f"  {command:<{width}}   {why}")
    if options.json is not None:
        _write(json.dumps(verdict.as_dict(), indent=1), options.json, console)
    return verdict.exit_code


def _mark(console: Console, verdict: Verdict) -> Text:
    """The verdict's line behind its mark, in words where the terminal has no such sign."""
    mark, word = ("✓", "ok:") if verdict.passed else ("✗", "below the gate:")
    try:
        mark.encode(console.encoding)
    except (UnicodeEncodeError, LookupError):
        mark = word
    return Text(f"{mark} {verdict.line}", style="bold green" if verdict.passed else "bold red")


def _size(path: Path) -> str:
    megabytes = path.stat().st_size / 1e6
    return f"{megabytes:.1f} MB" if megabytes >= 0.1 else f"{1e3 * megabytes:.0f} kB"


def _write(text: str, path: Path, console: Console) -> None:
    if path == _STDOUT:
        make_console().print(text)
        return
    make_folder(path)
    with write_whole(path) as stream:
        stream.write(text.encode())
    console.print(f"wrote {path}")
