"""The contract of a policy bundle, `contract.json`: everything that a runner must know beside the network.

Nothing here needs a simulator or a trainer.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips import write_whole
from robot_models.incoming import MAX_CONFIG, MAX_NAME, parsed, read_text, reading
from tracking.errors import TrackingError

FORMAT_VERSION = 2
FROM_REFERENCE, FROM_DEFAULT, FROM_ZERO = "reference", "default", "zero"
_TARGETS = {
    FROM_REFERENCE: "the next frame's joint_pos + (joint_torque + kd * joint_vel) / kp, in the middle of the period",
    FROM_DEFAULT: "the default pose, and feed_forward * kd / kp * the next frame's joint_vel",
    FROM_ZERO: "nothing: the scaled action is the target",
}

FARTHEST = 500  # control periods that an observation looks ahead or back: ten seconds
_LARGEST = 100_000  # numbers in one row
_LARGEST_NUMBER = 1e6  # of gains, efforts, angles: no robot's comes near


def _number(value: object, lowest: float, highest: float) -> bool:
    """Whether it is a finite number between two others; truth values are none."""
    return isinstance(value, int | float) and not isinstance(value, bool) and lowest <= value <= highest


@dataclass(frozen=True, kw_only=True)
class Row:
    """One row of the observation table: `scale` times some numbers."""

    kind: str  # key of `observation_terms.TERMS`
    at: int  # control periods from now, ahead in the reference, back in time (negative) in all else
    size: int
    scale: float
    unit: str  # before the scale
    frame: str
    noise: float = 0.0  # half width of the uniform noise in training, after the scale
    measurable: bool = True  # whether a robot has a sensor for it
    zeroed: Sequence[int] = ()  # places in it that are shown as 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "zeroed", tuple(self.zeroed))  # a list in files

    @property
    def name(self) -> str:
        """Kind, and when."""
        return self.kind + (f"_{self.at}" if self.at > 0 else f"_{-self.at}_ago" if self.at < 0 else "")


@dataclass(frozen=True, kw_only=True)
class ChainLink:
    """One body on the way from the IMU's body to the anchor: a fixed turn, then the joint's."""

    pos: tuple[float, ...]  # of the body in its parent [m]
    quat: tuple[float, ...]  # wxyz, parent_from_body at joint zero
    joint: str | None
    axis: tuple[float, ...]  # of the joint, in the body


@dataclass(frozen=True, kw_only=True, eq=False)
class Contract:
    """What a policy was made for. J joints in the policy's own order."""

    robot: str
    robot_hash: str  # of names, tree, axes and limits; empty in a foreign policy
    reference_sha256: str  # empty in a tracker, which follows any
    control_dt: float  # [s]
    joint_names: tuple[str, ...]
    default_joint_pos: Float[ndarray, "J"]  # [rad]
    kp: Float[ndarray, "J"]  # [N m/rad]
    kd: Float[ndarray, "J"]  # [N m s/rad]
    effort: Float[ndarray, "J"]  # [N m]
    velocity: Float[ndarray, "J"]  # largest speed of the motors [rad/s]
    lower: Float[ndarray, "J"]  # range of the joints [rad]
    upper: Float[ndarray, "J"]  # [rad]
    stand_kp: Float[ndarray, "J"]  # servos that stand without a policy [N m/rad]
    stand_kd: Float[ndarray, "J"]  # [N m s/rad]
    action_scale: Float[ndarray, "J"]  # [rad]
    target: str  # what the scaled action is added to: a key of `_TARGETS`
    target_lower: Float[ndarray, "J"]  # [rad]
    target_upper: Float[ndarray, "J"]  # [rad]
    anchor: str
    anchor_chain: tuple[ChainLink, ...]
    observation: tuple[Row, ...]
    delay_trained_with_s: tuple[float, float]
    # Of trackers, whose command can be improved without training.
    look_ahead: int = 0  # frames by which the reference is shown ahead of time
    heading_gain: float = 0.0  # yaw rate asked for per heading that is missing [1/s]
    position_gain: float = 0.0  # velocity asked for per way that is missing, where the place is known [1/s]
    feed_forward: tuple[float, ...] = ()  # per joint, share of the reference's velocity that is compensated; none: 0
    versions: dict[str, str] = field(default_factory=dict)
    source: str = ""  # where it was read [file]

    def __post_init__(self) -> None:
        j = len(self.joint_names)
        for name in _ARRAYS:
            array = np.asarray(getattr(self, name), dtype=float)
            if array.shape != (j,) or not (np.abs(array) <= _LARGEST_NUMBER).all():
                found = f"shape {array.shape} or numbers that are not finite"
                raise self._refused(name, found, f"{j} finite numbers up to {_LARGEST_NUMBER:g}")
            object.__setattr__(self, name, array)
        if len(set(self.joint_names)) < j or not j:
            raise self._refused("joint_names", f"{j} names, some twice or none", "one name per joint")
        self._check_words()
        self._check_command()
        for row in self.observation:
            self._check_row(row)
        if not 0.0 < self.control_dt < 1.0:
            raise self._refused("control_dt", repr(self.control_dt), "seconds between 0 and 1")
        above, not_below = (self.kp, self.effort, self.velocity), (self.kd, self.stand_kp, self.stand_kd)
        if any((x <= 0.0).any() for x in above) or any((x < 0.0).any() for x in not_below):
            names = "kp, kd, effort, velocity, stand_kp, stand_kd"
            raise self._refused(names, "a gain, an effort or a speed that is not positive", "positive numbers")
        if self.target not in _TARGETS:
            raise self._refused("target", repr(self.target), f"one of {', '.join(_TARGETS)}")
        self._check_chain()
        if (self.lower > self.upper).any() or (self.target_lower > self.target_upper).any():
            raise self._refused(
                "lower, upper, target_lower, target_upper", "a range whose ends are exchanged", "ranges"
            )

    def _check_chain(self) -> None:
        strange = {link.joint for link in self.anchor_chain} - {None, *self.joint_names}
        if strange:
            raise self._refused("anchor_chain", f"joints {strange}", "joints of the policy")
        for link in self.anchor_chain:
            if len(link.quat) != 4 or not abs(np.linalg.norm(link.quat) - 1.0) <= 1e-6:
                raise self._refused("anchor_chain", f"quat {link.quat}", "unit quaternions wxyz")
            if len(link.pos) != 3 or len(link.axis) != 3 or not np.isfinite((*link.pos, *link.axis)).all():
                raise self._refused("anchor_chain", f"pos {link.pos}, axis {link.axis}", "three finite numbers each")

    def _check_words(self) -> None:
        for name in ("robot", "robot_hash", "reference_sha256", "target", "anchor"):
            if not isinstance(getattr(self, name), str):
                raise self._refused(name, repr(getattr(self, name))[:40], "a word")
        for name in self.joint_names:
            if not isinstance(name, str) or not 0 < len(name) <= MAX_NAME or not name.isprintable():
                raise self._refused("joint_names", repr(name)[:40], f"printable words of at most {MAX_NAME} characters")
        if not isinstance(self.versions, dict):
            raise self._refused("versions", repr(self.versions)[:40], "versions by the name of a package")

    def _check_command(self) -> None:
        """Of the numbers by which a command is improved: each finite and of a size that means something."""
        for name, most in (("look_ahead", FARTHEST), ("heading_gain", 100.0), ("position_gain", 100.0)):
            if not _number(getattr(self, name), 0.0, most):
                raise self._refused(name, repr(getattr(self, name))[:40], f"between 0 and {most:g}")
        shares, delays = self.feed_forward, self.delay_trained_with_s
        if len(shares) not in (0, len(self.joint_names)) or not all(_number(x, -10.0, 10.0) for x in shares):
            raise self._refused("feed_forward", f"{len(shares)} numbers", "one finite share a joint, or none")
        if not (all(_number(x, 0.0, 1.0) for x in delays) and delays[0] <= delays[1]):
            raise self._refused("delay_trained_with_s", repr(delays)[:40], "shortest and longest, up to a second")

    def _check_row(self, row: Row) -> None:
        fine = (
            isinstance(row.kind, str)
            and _number(row.at, -FARTHEST, FARTHEST)
            and _number(row.size, 1, _LARGEST)
            and isinstance(row.at, int)
            and isinstance(row.size, int)
            and _number(row.scale, -1e6, 1e6)
            and _number(row.noise, 0.0, 1e6)
            and all(isinstance(place, int) and 0 <= place < row.size for place in row.zeroed)
        )
        if not fine:
            raise self._refused(
                "observation", f"a row {row}"[:120], "kind, time, size, scale and noise that are possible"
            )

    @property
    def follows_any(self) -> bool:
        """Whether it is a tracker of ours: trained for no reference of its own."""
        return not self.reference_sha256 and bool(self.robot_hash)

    @property
    def observation_size(self) -> int:
        """Numbers in one observation."""
        return sum(row.size for row in self.observation)

    def as_dict(self) -> dict[str, Any]:
        """For a file: at full precision, with slices and meanings for people."""
        told = {k: v.tolist() if isinstance(v, ndarray) else v for k, v in vars(self).items() if k != "source"}
        ends = np.cumsum([row.size for row in self.observation])
        rows = [
            {"name": row.name, "slice": [int(end) - row.size, int(end)], **asdict(row)}
            for row, end in zip(self.observation, ends, strict=True)
        ]
        return {
            "format_version": FORMAT_VERSION,
            **told,
            "observation": rows,
            "anchor_chain": [asdict(link) for link in self.anchor_chain],
            "meaning": {
                "servo target": "target + action_scale * action, within target_lower and target_upper",
                "target": _TARGETS[self.target],
                "observation": "scale * numbers of that kind, side by side; quaternions are wxyz",
            },
        }

    def _refused(self, what: str, found: str, expected: str) -> TrackingError:
        return TrackingError(f"{self.source or 'contract'}, {what}", found=found, expected=expected)


OF_ROBOT = ("default_joint_pos", "kp", "kd", "effort", "velocity", "lower", "upper")
"""Arrays that a robot has under the same names."""
_ARRAYS = (*OF_ROBOT, "stand_kp", "stand_kd", "action_scale", "target_lower", "target_upper")


def write_contract(path: Path, contract: Contract) -> None:
    """Write `contract.json`, whole or not at all."""
    with write_whole(path) as stream:
        stream.write(json.dumps(contract.as_dict(), indent=1).encode())


def read_contract(path: Path) -> Contract:
    """Read and check `contract.json`.

    Raises:
        TrackingError: not a contract, of another format version, or numbers that do not fit together.
    """
    expected = "contract.json of a policy bundle"
    text = read_text(path, expected=expected, most=MAX_CONFIG, error=TrackingError)
    told = parsed(json.loads, text, str(path), expected=expected, error=TrackingError)
    version = told.get("format_version") if isinstance(told, dict) else None
    if version != FORMAT_VERSION:
        raise TrackingError(
            f"{path}, format_version", found=repr(version), expected=str(FORMAT_VERSION),
            cure="update dance-retarget" if isinstance(version, int) and version > FORMAT_VERSION else "export it again",
        )  # fmt: skip
    names = {f.name for f in fields(Contract)}
    with reading(str(path), expected="every key of a contract", error=TrackingError):
        rows = tuple(Row(**{k: r[k] for k in _names(Row) if k in r}) for r in told["observation"])
        chain = tuple(
            ChainLink(pos=tuple(link["pos"]), quat=tuple(link["quat"]), joint=link["joint"], axis=tuple(link["axis"]))
            for link in told["anchor_chain"]
        )
        made = {
            "observation",
            "anchor_chain",
            "joint_names",
            "source",
            "delay_trained_with_s",
            "feed_forward",
            *_ARRAYS,
        }
        shortest, longest = told["delay_trained_with_s"]
        arrays: dict[str, Any] = {k: np.asarray(told[k], dtype=float) for k in _ARRAYS}
        contract = Contract(
            **{k: v for k, v in told.items() if k in names - made},
            **arrays,
            joint_names=tuple(told["joint_names"]), observation=rows, anchor_chain=chain, source=str(path),
            delay_trained_with_s=(float(shortest), float(longest)), feed_forward=tuple(told.get("feed_forward", ())),
        )  # fmt: skip
        slices = [tuple(r["slice"]) for r in told["observation"]]
    ends = np.cumsum([0, *(row.size for row in rows)]).tolist()
    if slices != list(pairwise(ends)):
        raise TrackingError(
            f"{path}, observation", found="slices that overlap or leave gaps", expected="rows side by side"
        )
    return contract


def _names(kind: type) -> list[str]:
    return [f.name for f in fields(kind)]
