"""What every command shares: parsing, progress on stderr, one summary on stdout, refusals in two lines.

Exit codes: 0 done; 1 done, below the quality gate; 2 input refused.
"""

from __future__ import annotations

import inspect
import shlex
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, is_dataclass
from pathlib import Path
from typing import Annotated, Any, Protocol, TypeVar, get_args, get_type_hints

import tyro
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from clips import ReadOptions, write_whole
from clips.identify import UnknownSkeleton
from retarget import Report
from robot_models import DanceError

DONE, BELOW_GATE, REFUSED = 0, 1, 2
_QUIET_S = 15.0  # between two lines of progress in a log
T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class FileOptions:
    """What you state about the clip; a statement beats every guess."""

    fps: float | None = None
    """Frame rate of the file, where it does not say."""
    unit: str | None = None
    """Unit of its positions: m, cm, mm, inch, cmu, or a number of metres."""
    up: str | None = None
    """Its up axis: x, y, z, -x, -y or -z."""
    stature: float | None = None
    """Height of the person in metres; settles the scale of a file in unknown units."""
    quat_order: str | None = None
    """Order of its root quaternions: wxyz or xyzw."""
    joint_order: str | None = None
    """Order of its joint columns, where they have no names: mujoco (depth-first) or isaac (breadth-first)."""
    source_robot: str | None = None
    """The robot that a joint-space file was made for."""
    skeleton: str | None = None
    """The ASF that an AMC was recorded on, where it does not lie beside it."""
    mapping: str | None = None
    """A file that says which point is which part of the body, for skeletons that no custom tells apart."""
    strict: bool = False
    """Refuse a clip that needs any repair."""

    def reading(self) -> ReadOptions:
        """The same for the readers."""
        return ReadOptions(
            fps=self.fps,
            unit=self.unit,
            up=self.up,
            stature=self.stature,
            quat_order=self.quat_order,
            joint_order=self.joint_order,
            source_robot=self.source_robot,
            skeleton=self.skeleton,
            mapping=self.mapping,
        )


ClipPath = Annotated[Path, tyro.conf.Positional]
Out = Annotated[Path | None, tyro.conf.arg(aliases=["-o"])]


def command(arguments: type[T], body: Callable[[T], int], *, name: str, argv: list[str] | None) -> int:
    """Parse, run, and turn every refusal into two lines and an exit code."""
    words = sys.argv[1:] if argv is None else argv
    options = tyro.cli(
        arguments,
        prog=name,
        args=words,
        description=inspect.cleandoc(arguments.__doc__ or ""),
        config=(tyro.conf.OmitArgPrefixes,),
    )
    try:
        return body(options)
    except UnknownSkeleton as e:
        _offer_draft(e)
        complain(e, name, words, option_names(arguments))
        return REFUSED
    except DanceError as e:
        complain(e, name, words, option_names(arguments))
        return REFUSED
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)
        return 130


def _offer_draft(error: UnknownSkeleton) -> None:
    """Write the mapping to confirm into the current folder; one that is there already stays as it is."""
    path = Path(error.suggestion)
    if path.exists():
        print(f"{path} is there already and was left as it is", file=sys.stderr)
        return
    with write_whole(path) as stream:
        stream.write(error.draft.encode())
    print(f"wrote {path}: check every line of it", file=sys.stderr)


def option_names(arguments: Any) -> frozenset[str]:
    """Names of the options of a command, those of its groups and sub-commands too."""
    if not (isinstance(arguments, type) and is_dataclass(arguments)):
        return frozenset().union(*map(option_names, get_args(arguments)))
    hints = get_type_hints(arguments, include_extras=True)
    return frozenset(hints).union(*map(option_names, hints.values()))


def complain(error: DanceError, name: str, words: list[str], options: frozenset[str]) -> None:
    """The refusal, and the command to type where an option of this command would settle it."""
    console = Console(stderr=True, highlight=False, soft_wrap=True)
    console.print(f"refused: {error}", style="red", markup=False)
    if error.option not in options:
        return
    if error.suggestion:
        value = shlex.join(error.suggestion.split(None, 0))  # one word, whatever stands in it
        said = (name, shlex.join(_without(words, flag(error.option))), flag(error.option), value)
        console.print(f"try: {' '.join(filter(None, said))}", markup=False)
    else:
        console.print(f"see: {name} --help, {flag(error.option)}", markup=False)


def _without(words: list[str], given: str) -> list[str]:
    """The words typed, without an option that is about to be given anew."""
    words = [word for word in words if not word.startswith(f"{given}=")]
    if given not in words:
        return words
    at = words.index(given)
    return words[:at] + words[at + 2 :]


def flag(option: str) -> str:
    """The command-line flag of a library option."""
    return "--" + option.replace("_", "-")


class Tell(Protocol):
    """Told how far a stage has come, with a note where there is something to say."""

    def __call__(self, stage: str, done: int, total: int, note: str = "") -> None:
        """One step further."""


@contextmanager
def progress(unit: str) -> Iterator[Tell]:
    """A bar per stage on stderr, with the time to go; a line now and then where stderr is no terminal."""
    if not sys.stderr.isatty():
        yield _Lines(unit)
        return
    bar = Progress(
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn(unit), TimeElapsedColumn(),
        TextColumn("eta"), TimeRemainingColumn(), TextColumn("{task.fields[note]}"), console=Console(stderr=True),
    )  # fmt: skip
    tasks: dict[str, Any] = {}
    with bar:

        def tell(stage: str, done: int, total: int, note: str = "") -> None:
            if stage not in tasks:
                tasks[stage] = bar.add_task(f"{stage:<18}", total=total, note=note, completed=done)
            bar.update(tasks[stage], completed=done, total=total, note=note)

        yield tell


class _Lines:
    """Progress for log files: a line every quarter of a minute."""

    def __init__(self, unit: str) -> None:
        self._unit, self._said = unit, time.monotonic()
        self._began: dict[str, tuple[float, int]] = {}  # when, and with how much done: a resumed run begins with some

    def __call__(self, stage: str, done: int, total: int, note: str = "") -> None:
        now = time.monotonic()
        began, before = self._began.setdefault(stage, (now, done))
        if now - self._said < _QUIET_S:
            return
        self._said = now
        left = (now - began) / max(1, done - before) * (total - done)
        print(f"{stage}: {done}/{total} {self._unit}, {left:.0f} s to go{', ' if note else ''}{note}", file=sys.stderr)


def print_report(report: Report, console: Console) -> None:
    """Every number of the report, the gates marked."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    for column in ("", "measured", "value", "gate"):
        table.add_column(column, justify="right" if column in ("value", "gate") else "left")
    for m in report.metrics:
        mark = "" if m.limit is None else "[green]ok[/]" if m.passed else "[red]FAIL[/]"
        table.add_row(mark, m.name, f"{m.value:.4g} {m.unit}", "" if m.limit is None else f"{m.limit:.4g}")
    console.print(table)
