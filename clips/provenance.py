"""Where a clip came from: the file, what was recognised in it and on which evidence, what was converted."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from clips.errors import ClipError
from robot_models.incoming import read_bytes

SLOWEST, FASTEST = 1.0, 2000.0  # frames per second of a recording


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One decision about a file and the numbers that made it."""

    what: str  # "quaternion order"
    value: str  # "xyzw"
    why: str  # the evidence, with numbers
    confidence: Literal["stated", "measured", "assumed"]
    option: str = ""  # the reading option that overrides it

    def __str__(self) -> str:
        return f"{self.what}: {self.value} ({self.confidence}: {self.why})"


@dataclass(frozen=True, kw_only=True)
class Repair:
    """Damage that was mended: what was done, to how many frames or samples, and where."""

    what: str
    count: int
    where: str = ""
    of: Literal["frames", "samples", "points"] = "frames"

    def __str__(self) -> str:
        return f"{self.what}: {self.count} {self.of}" + (f", {self.where}" if self.where else "")


@dataclass(frozen=True, kw_only=True)
class Provenance:
    """Provenance of a clip. It travels into the reference file, so it holds nothing that changes between runs."""

    file: str  # name without folder
    sha256: str
    dialect: str
    findings: tuple[Finding, ...] = ()
    conversions: tuple[str, ...] = ()  # everything done to the numbers since, in order
    repairs: tuple[Repair, ...] = ()  # damage among the numbers, mended

    def stated(self, what: str) -> bool:
        """Whether the user stated this of the file, so that nothing may change it."""
        return any(f.what == what and f.confidence == "stated" for f in self.findings)

    def noting(self, *conversions: str) -> Provenance:
        """The same source with more conversions on record."""
        return replace(self, conversions=(*self.conversions, *conversions))

    def mended(self, *repairs: Repair) -> Provenance:
        """The same source with more repairs on record."""
        return replace(self, repairs=(*self.repairs, *repairs))


@dataclass(frozen=True, kw_only=True)
class ReadOptions:
    """What the user states about a file; a statement beats every guess. None: find out or refuse."""

    fps: float | None = None  # frames per second
    unit: str | None = None  # "m", "cm", "mm", "inch", "cmu" (1/0.45 inch) or a number of metres
    up: str | None = None  # "x", "y", "z", with a minus for the other way
    stature: float | None = None  # height of the person [m]; settles the scale of a file in unknown units
    quat_order: str | None = None  # "wxyz" or "xyzw"
    joint_order: str | None = None  # "mujoco" (depth-first) or "isaac" (breadth-first), of columns without names
    source_robot: str | None = None  # the robot that a joint-space file was made for
    skeleton: str | None = None  # path of the ASF that an AMC was recorded on
    mapping: str | None = None  # path of a file that says which point is which part of the body
    layout: str | None = None  # the order of points without names: a name, or the path of a text with one name a line
    body_model: str | None = (
        None  # path of a user's own SMPL, SMPL-H or SMPL-X model, whose shape a file's betas change
    )
    person: str | None = None  # of several people in one file: the name of the root, or a number from 1
    level: bool | None = None  # False: leave a floor that leans as it is
    travel: str | None = None  # "from-feet": the way over the floor made anew from the feet that stand
    travel_scale: float | None = None  # factor of the root's positions, where they stand in another unit than the rest

    def __post_init__(self) -> None:
        _one_of("fps", self.fps, self.fps is None or SLOWEST <= self.fps <= FASTEST, f"{SLOWEST:g} to {FASTEST:g}")
        _one_of("up", self.up, self.up in (None, "x", "y", "z", "-x", "-y", "-z"), "x, y, z, -x, -y or -z")
        _one_of("quat_order", self.quat_order, self.quat_order in (None, "wxyz", "xyzw"), "wxyz or xyzw")
        _one_of("joint_order", self.joint_order, self.joint_order in (None, "mujoco", "isaac"), "mujoco or isaac")
        _one_of("stature", self.stature, self.stature is None or 0.3 < self.stature < 3.0, "metres, 0.3 to 3")
        _one_of("travel", self.travel, self.travel in (None, "from-feet"), "from-feet")
        scale = self.travel_scale
        _one_of("travel_scale", scale, scale is None or 1e-4 < scale < 1e4, "a factor, 0.0001 to 10000")
        if self.unit is not None and self.unit not in UNITS:
            try:
                good = 1e-6 < float(self.unit) < 1e6
            except ValueError:
                good = False
            _one_of("unit", self.unit, good, f"one of {', '.join(UNITS)} or a number of metres above 0")


# Metres per unit. CMU's skeletons are in inches times 0.45 (its own ASF files say so).
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "inch": 0.0254, "cmu": 0.0254 / 0.45}


_UTF16 = (b"\xff\xfe", b"\xfe\xff")  # its byte-order marks


def _one_of(option: str, value: object, good: bool, expected: str) -> None:
    if not good:
        raise ClipError(f"option {option}", found=repr(value), expected=expected, option=option)


@dataclass(frozen=True, kw_only=True)
class RawFile:
    """A file read once: its bytes, and the helpers that every reader needs to speak of it."""

    path: Path
    data: bytes

    @classmethod
    def load(cls, path: Path) -> RawFile:
        """Read a file whole.

        Raises:
            ClipError: no file, a folder, no right to read it, empty, or absurdly large.
        """
        data = read_bytes(path, expected="a motion file", error=ClipError)
        if not data:
            raise ClipError(str(path), found="0 bytes", expected="a motion file")
        return cls(path=path, data=data)

    @property
    def name(self) -> str:
        """File name for messages."""
        return self.path.name

    @property
    def head(self) -> bytes:
        """The first bytes, without a byte-order mark; of a text in UTF-16 as UTF-8."""
        if self.data.startswith(_UTF16):
            return self.data[:8192].decode("utf-16", errors="ignore").encode()
        return self.data[:4096].removeprefix(b"\xef\xbb\xbf")

    def text(self) -> str:
        """The whole file as text: UTF-8, else the encodings that Chinese and Windows tools write."""
        for encoding in ("utf-16",) if self.data.startswith(_UTF16) else ("utf-8-sig", "gb18030"):
            try:
                return self.data.decode(encoding)
            except UnicodeDecodeError:
                continue
        raise ClipError(self.name, found="bytes that are no text", expected="a text file")

    def source(
        self,
        dialect: str,
        findings: Iterable[Finding],
        conversions: Iterable[str] = (),
        repairs: Iterable[Repair] = (),
    ) -> Provenance:
        """Provenance of a clip read from this file."""
        return Provenance(
            file=self.name,
            sha256=hashlib.sha256(self.data).hexdigest(),
            dialect=dialect,
            findings=tuple(findings),
            conversions=tuple(conversions),
            repairs=tuple(repairs),
        )

    def check_rate(self, fps: float) -> None:
        """Refuse a rate that no recording has: milliseconds for seconds, a period for a rate.

        Raises:
            ClipError: the rate lies outside of 1 to 2000 per second.
        """
        if not SLOWEST <= fps <= FASTEST:
            raise ClipError(
                self.name, found=f"{fps:g} frames per second", expected=f"{SLOWEST:g} to {FASTEST:g}",
                cure="was a time written in milliseconds? state the rate", option="fps", suggestion="30",
            )  # fmt: skip

    def no_fps(self) -> ClipError:
        """The refusal of a file that does not say its frame rate."""
        return ClipError(
            self.name,
            found="no frame rate in the file (no time column, no '# fps:' line)",
            expected="a stated one: a wrong guess would change every speed",
            cure="state it: Unitree's LAFAN1 files have 30, G1 Moves 60, SEED 120",
            option="fps",
        )
