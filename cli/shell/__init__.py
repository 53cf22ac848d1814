"""What every command shares: words, consoles, progress, refusals, verdicts."""

from cli.shell.console import Background, make_console
from cli.shell.extras import PARTS, made_for
from cli.shell.interrupts import interrupted_by_signals
from cli.shell.options import ClipPath, FileOptions, Out, make_folder, recording_name, some
from cli.shell.progress_bar import progress
from cli.shell.settings import as_toml, from_file, from_words
from cli.shell.telling import TellOptions, tell
from cli.shell.terminal import BELOW_GATE, DONE, GATE, REFUSED, SOME_REFUSED, command, flag, parse
from cli.shell.typed import again, line
from cli.shell.verdict import Trouble, Verdict

__all__ = [
    "BELOW_GATE",
    "DONE",
    "GATE",
    "PARTS",
    "REFUSED",
    "SOME_REFUSED",
    "Background",
    "ClipPath",
    "FileOptions",
    "Out",
    "TellOptions",
    "Trouble",
    "Verdict",
    "again",
    "as_toml",
    "command",
    "flag",
    "from_file",
    "from_words",
    "interrupted_by_signals",
    "line",
    "made_for",
    "make_console",
    "make_folder",
    "parse",
    "progress",
    "recording_name",
    "some",
    "tell",
]
