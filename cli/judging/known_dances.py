"""Dances that a tracker knows, where a reference is asked for: they lie beside it, in few bits."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console

from cli.judging.as_reference import reference_for
from cli.shell import FileOptions
from clips import save_reference
from tracking import TrackingError


@contextmanager
def followed(
    policy: Path, ref: Path | None, dance: str | None, options: FileOptions, console: Console
) -> Iterator[Path | None]:
    """What a policy shall follow, as a file for as long as it is needed: the reference that is named, or a dance that it knows.

    Args:
        policy: a bundle, a tracker, or the name of one.
        ref: a reference, or another tool's motion.
        dance: the name of a dance that the tracker knows.
        options: what is stated about another tool's motion.
        console: told what was taken as it stands.

    Raises:
        TrackingError: both, or neither for a tracker that knows dances; no such tracker, or no dance of that name.
    """
    if dance is None:
        if ref is None and (known := names_of_known_dances(policy)):
            raise TrackingError(
                str(policy), found="a tracker, and no dance", expected=f"one that it knows: {', '.join(known)}; or any reference",
                cure=f"--dance {known[0]}, or --ref FILE",
            )  # fmt: skip
        with reference_for(ref, options, console) as file:
            yield file
        return
    if ref is not None:
        raise TrackingError(f"--ref {ref}", found=f"--dance {dance} beside it", expected="one of the two")
    with known_dances(policy, dance) as files:
        yield files[dance]


@contextmanager
def known_dances(policy: Path, *names: str) -> Iterator[dict[str, Path]]:
    """References of the dances that a tracker knows, by name, for as long as they are needed.

    Args:
        policy: the tracker's folder, or its name.
        names: which; all where there are none.

    Raises:
        TrackingError: no tracker that knows dances, or none of that name.
    """
    from robot_models import load_robot
    from tracking import REHEARSAL
    from tracking.policy import CONTRACT, find_policy, read_contract
    from tracking.task import read_rehearsal_set

    known = names_of_known_dances(policy)
    for name in names:
        if name not in known:
            raise TrackingError(
                f"--dance {name}", found=f"no dance of that name with {policy}",
                expected=f"one of: {', '.join(known)}" if known else "a tracker that knows dances, as tracker-g1",
            )  # fmt: skip
    folder = find_policy(policy)
    robot = load_robot(read_contract(folder / CONTRACT).robot)
    with tempfile.TemporaryDirectory() as aside:
        files = {}
        for piece in read_rehearsal_set(folder / REHEARSAL, robot, names):
            files[piece.name] = Path(aside) / f"{piece.name}.npz"
            save_reference(piece.reference, files[piece.name])
        yield files


def names_of_known_dances(policy: Path) -> list[str]:
    """The dances that come with a tracker; none of a policy that is no tracker of ours."""
    from tracking import REHEARSAL
    from tracking.policy import find_policy
    from tracking.task import rehearsal_names

    file = find_policy(policy) / REHEARSAL
    return rehearsal_names(file) if file.is_file() else []
