"""What every command shares: parsing, refusals in two lines, exit codes.

Exit codes: 0 done; 1 done, below the quality gate; 2 input refused; 3 done, but of several inputs some were refused.
"""

from __future__ import annotations

import contextlib
import inspect
import json
import os
import shlex
import sys
from collections.abc import Callable, Sequence
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any, TypeVar, get_args, get_type_hints

import tyro

from cli.shell.console import as_any_terminal_can, make_console
from cli.shell.extras import refusal_of
from cli.shell.settings import split_dotted
from cli.shell.typed import again, remember, typed_name
from clips import OutputError, write_whole
from clips.identify import MappingNeededError
from robot_models import DanceError, __version__
from robot_models.incoming import printable

DONE, BELOW_GATE, REFUSED, SOME_REFUSED = 0, 1, 2, 3
GATE = 0.95  # share of a policy's rollouts that shall finish
T = TypeVar("T")


def command(arguments: type[T], body: Callable[[T], int], *, name: str, argv: list[str] | None) -> int:
    """Parse, run, and turn every refusal into two lines and an exit code."""
    words = sys.argv[1:] if argv is None else argv
    if words == ["--version"]:
        print(name, __version__)
        return DONE
    as_any_terminal_can()
    options = parse(arguments, words, name)
    try:
        refuse_repeated(words)
        return body(options)
    except MappingNeededError as e:
        _offer_draft(e)
        complain(e, option_names(arguments))
        return REFUSED
    except DanceError as e:
        complain(e, option_names(arguments))
        _refuse_as_json(e, options)
        return REFUSED
    except ModuleNotFoundError as e:
        complain(refusal_of(e), option_names(arguments))
        return REFUSED
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)
        return 130


def parse(arguments: type[T], words: Sequence[str], name: str) -> T:
    """The arguments that words state; settings with dotted names are kept for whoever asks (`from_words`)."""
    left, dotted = split_dotted(words) if "config" in option_names(arguments) else (list(words), {})
    remember(name, words, dotted)
    return tyro.cli(
        arguments,
        prog=name,
        args=[_harmless(word) for word in left],
        description=inspect.cleandoc(arguments.__doc__ or ""),
        config=(tyro.conf.OmitArgPrefixes,),
    )


def _refuse_as_json(error: DanceError, options: Any) -> None:
    """The refusal where a machine reads: --json."""
    path = getattr(getattr(options, "tell", None), "json", None)
    if path is None:
        return
    text = json.dumps({"passed": False, "exit_code": REFUSED, "verdict": f"refused: {error}"}, indent=1)
    if path == Path("-"):
        print(text)
    else:
        with (
            contextlib.suppress(OutputError),
            write_whole(path) as stream,
        ):  # that it cannot be written was told, or is less
            stream.write(text.encode())


def refuse_repeated(words: Sequence[str]) -> None:
    """Refuse an option that is stated twice: one of the two would be forgotten in silence.

    Raises:
        DanceError: it names the option.
    """
    flags = [word.partition("=")[0] for word in words if word.startswith("--") and len(word) > 2]
    twice = sorted({flag for flag in flags if flags.count(flag) > 1})
    if twice:
        raise DanceError(twice[0], found="it twice", expected="it once: the second would take the place of the first")


def _harmless(word: str) -> str:
    """A word as it was typed where it is a file's name; else without what could move the cursor in a message about it."""
    return word if word.isprintable() or os.path.lexists(word) else printable(word)


def _offer_draft(error: MappingNeededError) -> None:
    """Write the mapping to confirm into the current folder; one that is there already stays as it is."""
    path = Path(error.suggestion)
    if path.exists():
        make_console(stderr=True).print(f"{path} is there already and was left as it is")
        return
    with write_whole(path) as stream:
        stream.write(error.draft.encode())
    make_console(stderr=True).print(f"wrote {path}: check every line of it")


def option_names(arguments: Any) -> frozenset[str]:
    """Names of the options of a command, those of its groups and sub-commands too."""
    if not (isinstance(arguments, type) and is_dataclass(arguments)):
        return frozenset().union(*map(option_names, get_args(arguments)))
    hints = get_type_hints(arguments, include_extras=True)
    return frozenset(_typed(*pair) for pair in hints.items()).union(*map(option_names, hints.values()))


def _typed(field: str, hint: Any) -> str:
    """An option's name where it is typed: a field cannot be called as a word of the language."""
    return next((more.name for more in getattr(hint, "__metadata__", ()) if getattr(more, "name", None)), field)


def complain(error: DanceError, options: frozenset[str]) -> None:
    """The refusal, and the command to type where an option of this command would settle it."""
    console = make_console(stderr=True)
    console.print(f"refused: {error}", style="red")
    if error.option not in options:
        return
    if error.suggestion:
        value = shlex.join(error.suggestion.split(None, 0))  # one word, whatever stands in it
        console.print(f"try: {again({flag(error.option): value})}")
    else:
        console.print(f"see: {typed_name()} --help, {flag(error.option)}")


def flag(option: str) -> str:
    """The command-line flag of a library option."""
    return "--" + option.replace("_", "-")
