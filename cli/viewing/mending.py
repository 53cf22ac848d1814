"""Mending a dance on the page: what is changed is kept as the words of the command that does the same."""

from __future__ import annotations

import tempfile
from contextvars import copy_context
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cli.retargeting import Arguments, check_one, read_dances, save_result, solve_dances
from cli.shell import FileOptions, line, parse
from cli.viewing.weight_controls import option_of
from clips import clip_stem, read_clip, write_whole
from retarget import ContactEdit, KeyFrame, Retargeted, RetargetError
from robot_models import load_robot
from robot_models.maths import Progress, silent

TOUCHES, KEYS = "touches", "keys"


@dataclass(frozen=True, kw_only=True)
class Edits:
    """What is asked of a recording."""

    robot: str
    start: float = 0.0  # [s] of the recording
    end: float | None = None
    drop: tuple[str, ...] = ()
    speed: float = 1.0
    mirror: bool = False
    touches: tuple[ContactEdit, ...] = ()  # seconds of the dance
    keys: tuple[KeyFrame, ...] = ()
    weights: tuple[tuple[str, float], ...] = ()  # of the solver, that are not the usual ones

    def words(self, clip: Path, file: FileOptions, folder: Path) -> list[str]:
        """What is typed after the command; CSVs of touches and key frames lie in the folder."""
        words = [str(clip), "--robot", self.robot, *file.words()]
        words += ["--start", f"{self.start:g}"] * (self.start > 0.0)
        words += [] if self.end is None else ["--end", f"{self.end:g}"]
        words += ["--drop", *self.drop] if self.drop else []
        words += ["--speed", f"{self.speed:g}"] * (self.speed != 1.0) + ["--mirror"] * self.mirror
        words += ["--contacts", str(csv_beside(clip, TOUCHES, folder))] * bool(self.touches)
        words += ["--keys", str(csv_beside(clip, KEYS, folder))] * bool(self.keys)
        for name, value in self.weights:
            words += [option_of(name), f"{value:g}"]
        return words


def csv_beside(clip: Path, what: str, folder: Path) -> Path:
    """Where the touches or key frames of a clip stand."""
    return folder / f"{clip_stem(clip)}_{what}.csv"


class Mending:
    """A recording, what is asked of it, and what came of it; every step can be taken back."""

    def __init__(self, clip: Path, robot: str, file: FileOptions, progress: Progress = silent) -> None:
        """Begin with the whole recording.

        Args:
            clip: a file of a person, or of a robot that another shall follow.
            robot: who shall dance it.
            file: what is stated about the file.
            progress: told as the solver goes on.

        Raises:
            DanceError: the recording cannot be used.
        """
        self._clip, self._file = clip, file
        self._done: list[tuple[Edits, Retargeted]] = []
        self.edits = Edits(robot=robot)
        whole = read_clip(clip, file.reading())
        self.length_s = (whole.frames - 1) / whole.fps
        self.recognised: tuple[str, ...] = ()
        self.solve(self.edits, progress)

    @property
    def result(self) -> Retargeted:
        """What came of the last step."""
        return self._done[-1][1]

    @property
    def command(self) -> str:
        """What does the same."""
        return line("dance-retarget", *self.edits.words(self._clip, self._file, Path()))

    def solve(self, edits: Edits, progress: Progress) -> Retargeted:
        """Solve with these edits and keep what comes of it.

        Raises:
            DanceError: edits that cannot go together, or that the recording does not allow.
        """
        with tempfile.TemporaryDirectory() as folder:
            result = copy_context().run(self._solved, edits, Path(folder), progress)
        self.edits = edits
        self._done.append((edits, result))
        return result

    def _solved(self, edits: Edits, folder: Path, progress: Progress) -> Retargeted:
        args = self._arguments(edits, folder)
        dances = read_dances(args)
        told, doubts = dances[0].clip.source, [f"doubtful: {doubt}" for doubt in dances[0].doubts]
        rate = f"{dances[0].clip.frames} frames at {dances[0].fps:.6g} fps"
        self.recognised = (
            told.dialect,
            rate,
            *map(str, told.findings),
            *(f"mended: {r}" for r in told.repairs),
            *doubts,
        )
        return solve_dances(dances, load_robot(args.robot), args, progress)[0]

    def undo(self) -> bool:
        """Take the last step back; whether there was one."""
        if len(self._done) < 2:
            return False
        self._done.pop()
        self.edits = self._done[-1][0]
        return True

    def write(self) -> list[Path]:
        """Write the reference, its recording, and the CSVs that the command names, in the current folder."""
        written = copy_context().run(self._written)
        csvs = ((TOUCHES, self.edits.touches), (KEYS, self.edits.keys))
        return written + [csv_beside(self._clip, what, Path()) for what, rows in csvs if rows]

    def _written(self) -> list[Path]:
        args = self._arguments(self.edits, Path())
        return save_result(self.result, read_dances(args), args)

    def _arguments(self, edits: Edits, folder: Path) -> Arguments:
        touches = [f"{t.start:.3f},{t.end:.3f},{t.edge},{t.kind}" for t in edits.touches]
        keys = [f"{k.time:.3f},{k.joint},{k.value:.6f}" for k in edits.keys]
        _write(csv_beside(self._clip, TOUCHES, folder), "start,end,edge,kind", touches)
        _write(csv_beside(self._clip, KEYS, folder), "time,joint,value", keys)
        words = edits.words(self._clip, self._file, folder)
        args = parse(Arguments, words, "dance-retarget")
        check_one(args)
        return args

    def mended(self, **changes: Any) -> Edits:
        """The edits of now with something changed.

        Raises:
            RetargetError: another cut, of a dance whose seconds touches or joints are stated in.
        """
        now = self.edits
        new = replace(now, **changes)
        if new.drop and (new.touches or new.keys):
            raise RetargetError(
                "touches and joints", found="seconds that are dropped beside them", expected="a dance in one piece",
                cure="keep one stretch of seconds, and drop none",
            )  # fmt: skip
        cut = replace(new, touches=now.touches, keys=now.keys, weights=now.weights)
        if (now.touches or now.keys) and cut != now:
            raise RetargetError(
                "another cut, speed, side or robot", found="touches or joints that are stated in this dance's seconds",
                expected="cut first, then state them", cure="take the last steps back",
            )  # fmt: skip
        return new


def _write(path: Path, head: str, rows: list[str]) -> None:
    if rows:
        with write_whole(path) as stream:
            stream.write("\n".join([head, *rows, ""]).encode())
