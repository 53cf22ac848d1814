"""Trackers: policies that follow any reference of their robot, described by a contract in TOML beside the network.

The contract says what each input of the network is, term by term (`observation_terms.TERMS`), and what its output means;
docs/trackers.md tells it by example. Contracts of known trackers come with the package; their networks do not.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips import Reference
from robot_models import RobotModel, expand_patterns
from robot_models.incoming import MAX_CONFIG, check_pattern, parsed, read_text, reading
from tracking.errors import TrackingError
from tracking.policy.contract import FARTHEST, FROM_DEFAULT, FROM_ZERO, Row
from tracking.policy.motion import motion_of
from tracking.policy.network import Policy, open_onnx
from tracking.policy.observation_terms import TERMS, row_of
from tracking.policy.readers.policy_import import contract_for, reordered
from tracking.policy.runner import Runner

KNOWN = Path(__file__).parents[2] / "trackers"
_ACTIONS = {"default": FROM_DEFAULT, "target": FROM_ZERO}


def is_tracker(path: Path) -> bool:
    """Whether an ONNX file is a tracker: a contract lies beside it, or it looks like a known one."""
    if path.suffix != ".onnx" or not path.is_file():
        return False
    return path.with_suffix(".toml").is_file() or _known(open_onnx(path)) is not None


def read_tracker(path: Path, robot: RobotModel, reference: Reference) -> Runner:
    """A tracker on its way through a reference.

    Args:
        path: the network; its contract is the TOML of the same name beside it, or a known tracker's.
        robot: its robot.
        reference: what it shall follow.

    Raises:
        TrackingError: no contract, one that says what nobody knows, or sizes that do not add up.
    """
    session = open_onnx(path)
    beside = path.with_suffix(".toml")
    file = beside if beside.is_file() else _known(session)
    if file is None:
        raise TrackingError(
            str(path), found="a network without a contract", expected=f"{beside.name} beside it, or a known tracker",
            cure="write one: docs/trackers.md",
        )  # fmt: skip
    told = _read(file)
    with reading(f"{file}", expected="a tracker's contract (docs/trackers.md)", error=TrackingError):
        return _made(path, session, told, file, robot, reference)


def _made(
    path: Path, session: Any, told: Mapping[str, Any], file: Path, robot: RobotModel, reference: Reference
) -> Runner:
    """The runner of a contract, whatever stands in it."""
    source = f"{path} ({told['name']})"
    if told.get("robot", robot.name) != robot.name:
        raise TrackingError(
            source, found=f"a tracker of {told['robot']}", expected=f"one of {robot.name}, whose reference this is"
        )
    joints = robot.joint_names if told.get("joints", "robot") == "robot" else tuple(told["joints"])
    rows = [_rows(entry, told, joints, len(robot.profile.tracked), source) for entry in told["input"]]
    _same_sizes(session, told, rows, source)
    ids = [robot.joint(name) for name in joints]
    given = {
        name: _per_joint(told[name], joints, f"{file}, {name}") for name in ("kp", "kd", "default") if name in told
    }
    default = given.get("default", robot.default_joint_pos[ids])
    action = told["action"]
    scale = _per_joint(action["scale"], joints, f"{file}, action.scale") if "scale" in action else np.ones(len(joints))
    arrays = {
        "default_joint_pos": default, "kp": given.get("kp", robot.kp[ids]), "kd": given.get("kd", robot.kd[ids]),
        "action_scale": scale,
    }  # fmt: skip
    if "limit" in action:
        arrays |= {"target_lower": default - action["limit"] * scale, "target_upper": default + action["limit"] * scale}
    command = told.get("command", {})
    more = {
        "target": _ACTIONS[action["adds_to"]], "look_ahead": int(command.get("look_ahead", 0)),
        "heading_gain": float(command.get("heading_gain", 0.0)), "position_gain": float(command.get("position_gain", 0.0)),
        "feed_forward": tuple(_per_joint(command["feed_forward"], joints, f"{file}, command.feed_forward").tolist())
        if "feed_forward" in command else (),
    }  # fmt: skip
    flat = tuple(row for part in rows for row in part)
    anchor = told.get("anchor", robot.profile.anchor)
    contract = contract_for(robot, joints, flat, anchor, 1.0 / float(told["control_hz"]), source, more, **arrays)
    return Runner(contract, _policy(session, told, rows), motion_of(reordered(reference, joints), contract))


def _read(file: Path) -> dict[str, Any]:
    expected = "a tracker's contract in TOML"
    text = read_text(file, expected=expected, most=MAX_CONFIG, error=TrackingError)
    told = parsed(tomllib.loads, text, str(file), expected=expected, error=TrackingError)
    missing = sorted({"name", "control_hz", "input", "output", "action"} - set(told))
    action = told.get("action")
    adds_to = action.get("adds_to") if isinstance(action, dict) else None
    if missing or not isinstance(adds_to, str) or adds_to not in _ACTIONS:
        raise TrackingError(
            str(file), found=f"no {', '.join(missing) or 'action.adds_to of ' + ' or '.join(_ACTIONS)}",
            expected="name, control_hz, input, output, action", cure="docs/trackers.md tells them by example",
        )  # fmt: skip
    return told


def _known(session: Any) -> Path | None:
    """The contract of the known tracker whose inputs have these names and sizes."""
    inputs = {i.name: list(i.shape[1:]) for i in session.get_inputs()}
    for file in sorted(KNOWN.glob("*.toml")):
        told = tomllib.loads(file.read_text(encoding="utf-8"))
        if inputs == {entry["name"]: entry["shape"] for entry in told["input"]}:
            return file
    return None


def _rows(
    entry: Mapping[str, Any], told: Mapping[str, Any], joints: Sequence[str], bodies: int, source: str
) -> tuple[Row, ...]:
    """The rows of one input of the network: groups of terms, now or some periods on or back."""
    rows = []
    for part in entry["rows"]:
        terms = [term for name in part["groups"] for term in told["group"][name]] if "groups" in part else [part]
        for k in _periods(part):
            for term in terms:
                if term["kind"] not in TERMS:
                    raise TrackingError(
                        f"{source}, {term['kind']}", found="no such term", expected=f"of {', '.join(TERMS)}"
                    )
                zeroed = tuple(
                    i for i, j in enumerate(joints) if any(re.fullmatch(p, j) for p in _patterns(term, source))
                )
                scale = float(term.get("scale", 1.0))
                rows.append(row_of(term["kind"], len(joints), at=k, bodies=bodies, scale=scale, zeroed=zeroed))
    return tuple(rows)


def _patterns(term: Mapping[str, Any], source: str) -> list[str]:
    """Patterns of the joints that a term shows as zero."""
    return [check_pattern(str(p), f"{source}, zero", error=TrackingError) for p in term.get("zero", ())]


def _periods(part: Mapping[str, Any]) -> Sequence[int]:
    """Control periods from now: one, several, or all from one to another."""
    if "from" in part:
        first, last = int(part["from"]), int(part["to"])
        if not -FARTHEST <= first <= last <= FARTHEST:
            raise ValueError(f"from {first} to {last}, of at most {FARTHEST} control periods")
        return range(first, last + 1)
    at = part.get("at", 0)
    return at if isinstance(at, list) else [at]


def _per_joint(table: Mapping[str, float], joints: Sequence[str], where: str) -> Float[ndarray, "J"]:
    for pattern in table:
        check_pattern(pattern, where, error=TrackingError)
    return np.array(expand_patterns(table, joints, where=where), dtype=float)


def _same_sizes(session: Any, told: Mapping[str, Any], rows: Sequence[tuple[Row, ...]], source: str) -> None:
    inputs = {i.name: i.shape for i in session.get_inputs()}
    for entry, part in zip(told["input"], rows, strict=True):
        size = sum(row.size for row in part)
        if entry["name"] not in inputs or size != np.prod(entry["shape"]):
            table = ", ".join(f"{row.name} {row.size}" for row in part)
            raise TrackingError(
                f"{source}, input {entry['name']}", found=f"{size} numbers: {table}",
                expected=f"{np.prod(entry['shape'])}, of an input among {', '.join(inputs)}",
            )  # fmt: skip
    outputs = [o.name for o in session.get_outputs()]
    if told["output"] not in outputs:
        raise TrackingError(f"{source}, output", found=told["output"], expected=f"one of {', '.join(outputs)}")


def _policy(session: Any, told: Mapping[str, Any], rows: Sequence[tuple[Row, ...]]) -> Policy:
    """The network as a function of one row of numbers per robot."""
    ends = np.cumsum([0, *(sum(row.size for row in part) for part in rows)])
    batched = all(not isinstance(i.shape[0], int) for i in session.get_inputs())

    def asked(observation: Float[ndarray, "n A"]) -> ndarray:
        feeds = {
            entry["name"]: np.ascontiguousarray(observation[:, a:b]).reshape(len(observation), *entry["shape"])
            for entry, (a, b) in zip(told["input"], pairwise(ends), strict=True)
        }
        return np.asarray(session.run([told["output"]], feeds)[0], dtype=np.float64).reshape(len(observation), -1)

    def policy(observation: Float[ndarray, "N A"]) -> Float[ndarray, "N J"]:
        return asked(observation) if batched else np.concatenate([asked(o[None]) for o in observation])

    return policy
