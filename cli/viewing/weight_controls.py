"""What matters how much, on the page: the solver's weights."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

from retarget import ObjectiveWeights

_SHOWN = {
    "arm": "arms as the person's", "leg": "legs as the person's", "torso_orientation": "trunk as the person's",
    "pelvis_position": "way over the floor", "pelvis_orientation": "pelvis as the person's", "planted": "feet that stand stand",
}  # fmt: skip
_PLAIN = asdict(ObjectiveWeights())
_FACTORS = ("1/4", "1/2", "1", "2", "4")


def option_of(weight: str) -> str:
    """What states it on the command line."""
    return f"--weights.{weight.replace('_', '-')}"


@dataclass(kw_only=True)
class WeightControls:
    """A folder of controls.

    Args:
        stated: weights that are not the usual ones.
        state: told what they are now.
    """

    stated: dict[str, float]
    state: Callable[[dict[str, float]], None]

    def build(self, gui: Any) -> None:
        """Add them."""
        with gui.add_folder("what matters more", expand_by_default=bool(self.stated)):
            chosen = {name: self._choice(gui, name, label) for name, label in _SHOWN.items()}

            def asked(_: Any) -> None:
                factors = {name: _number(choice.value) for name, choice in chosen.items()}
                self.state({name: factor * _PLAIN[name] for name, factor in factors.items() if factor != 1.0})

            gui.add_button("solve with these").on_click(asked)

    def _choice(self, gui: Any, name: str, label: str) -> Any:
        factor = self.stated.get(name, _PLAIN[name]) / _PLAIN[name]
        now = min(_FACTORS, key=lambda text: abs(_number(text) - factor))
        return gui.add_dropdown(label, _FACTORS, initial_value=now, hint=f"times its weight of {_PLAIN[name]:g}")


def _number(text: str) -> float:
    over, _, under = text.partition("/")
    return float(over) / float(under or 1)
