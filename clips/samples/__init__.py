"""The sample dance, made by a script, in two formats."""

from clips.samples.mistakes import exchanged, tilted, travelling, with_rest

__all__ = ["exchanged", "tilted", "travelling", "with_rest"]
