"""The per-frame streams, for live input and comparison: one frame of targets in, one configuration out."""

from retarget.per_frame.hands import hand_errors, hand_goals, hold_hands, wrists
from retarget.per_frame.reach import reach
from retarget.per_frame.streams import follow, frame_solver

__all__ = [
    "follow",
    "frame_solver",
    "hand_errors",
    "hand_goals",
    "hold_hands",
    "reach",
    "wrists",
]
