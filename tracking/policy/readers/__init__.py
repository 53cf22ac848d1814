"""Policies that other tools trained: BeyondMimic's and mjlab's ONNX, Unitree's deploy.yaml, trackers by their contracts."""

from tracking.policy.readers.beyondmimic import read_beyondmimic
from tracking.policy.readers.policy_import import read_unitree
from tracking.policy.readers.tracker import is_tracker, read_tracker

__all__ = [
    "is_tracker",
    "read_beyondmimic",
    "read_tracker",
    "read_unitree",
]
