"""Random numbers where the task computes: NumPy's generator in main memory, torch's on its device."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from robot_models.maths import Array

if TYPE_CHECKING:
    import torch


@runtime_checkable
class Rng(Protocol):
    """What the task asks of a generator; NumPy's gives it."""

    def random(self, size: Any) -> Array:
        """Numbers in [0, 1)."""

    def uniform(self, low: Any, high: Any, size: Any) -> Array:
        """Numbers in [low, high)."""

    def integers(self, low: int, high: int, size: Any) -> Array:
        """Whole numbers in [low, high)."""

    @property
    def bit_generator(self) -> Any:
        """Holds `state`, which can be kept and put back."""


class TorchRng:
    """The part of NumPy's generator that the task uses, on a device of torch."""

    def __init__(self, seed: int, device: torch.device) -> None:
        import torch

        self._torch, self._device = torch, device
        self._generator = torch.Generator(device).manual_seed(seed)

    def random(self, size: Any) -> Array:
        """Numbers in [0, 1)."""
        shape = (size,) if isinstance(size, int) else size
        return self._torch.rand(shape, generator=self._generator, device=self._device)

    def uniform(self, low: Any, high: Any, size: Any) -> Array:
        """Numbers in [low, high)."""
        return low + (high - low) * self.random(size)

    def integers(self, low: int, high: int, size: Any) -> Array:
        """Whole numbers in [low, high)."""
        shape = (size,) if isinstance(size, int) else size
        return self._torch.randint(low, high, shape, generator=self._generator, device=self._device)

    @property
    def bit_generator(self) -> TorchRng:
        """As NumPy keeps its state: `rng.bit_generator.state`."""
        return self

    @property
    def state(self) -> list[int]:
        """All that is needed to go on with the same numbers."""
        return list(self._generator.get_state().tolist())

    @state.setter
    def state(self, state: list[int]) -> None:
        self._generator.set_state(self._torch.tensor(state, dtype=self._torch.uint8))
