"""The processes of one training run: one alone, or those that `torchrun` started, on one machine or several.

Each has robots of its own and a copy of the network. rsl-rl averages their gradients and normalises with all of their
observations; the leader evaluates, decides and writes, and the others are told.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, TypeVar

from robot_models.maths import available_threads
from tracking.errors import TrackingError

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class Team:
    """This process's place among all."""

    rank: int = 0
    size: int = 1
    neighbours: int = 1  # processes on this machine, this one counted

    @property
    def is_leader(self) -> bool:
        """Whether this process evaluates, decides and writes."""
        return self.rank == 0

    @property
    def for_rsl_rl(self) -> dict[str, int] | None:
        """As rsl-rl's algorithms want to be told."""
        return {"global_rank": self.rank, "world_size": self.size} if self.size > 1 else None

    def share(self, whole: int, of: str) -> int:
        """This process's part of a number.

        Raises:
            TrackingError: it cannot be shared evenly, which would weigh some robots' gradients more than others'.
        """
        if whole % self.size:
            raise TrackingError(of, found=str(whole), expected=f"a multiple of the {self.size} processes")
        return whole // self.size

    def threads(self, wanted: int) -> int:
        """Threads of this process: as wanted, or an even part of the cores."""
        return wanted or max(1, available_threads() // self.neighbours)

    def broadcast(self, value: T) -> T:
        """The leader's value, in every process."""
        if self.size == 1:
            return value
        import torch

        box = [value]
        torch.distributed.broadcast_object_list(box, src=0)
        return box[0]

    def mean(self, value: float) -> float:
        """Mean over the processes."""
        return sum(self.gather(value)) / self.size

    def gather(self, value: T) -> list[T]:
        """Everyone's value in order of rank, in every process."""
        if self.size == 1:
            return [value]
        import torch

        everyone: list[Any] = [None] * self.size
        torch.distributed.all_gather_object(everyone, value)
        return everyone

    def leave(self) -> None:
        """The end of the run."""
        if self.size > 1:
            import torch

            torch.distributed.destroy_process_group()


def join_team() -> Team:
    """The team that `torchrun` names in the environment; alone where it does not."""
    size = int(os.environ.get("WORLD_SIZE", "1"))
    if size == 1:
        return Team()
    import torch

    torch.distributed.init_process_group("gloo")
    return Team(
        rank=torch.distributed.get_rank(), size=size, neighbours=int(os.environ.get("LOCAL_WORLD_SIZE", str(size)))
    )
