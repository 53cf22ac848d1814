"""A policy to play with in a browser: its network, its robot and the physics as one file. The one room that is not all Python."""

from tracking.playground.page import BUILT, save_playground

__all__ = ["BUILT", "save_playground"]
