"""The sample dance, made by a script, in two formats; and a song."""

from clips.samples.mistakes import exchanged, tilted, travelling, with_rest
from clips.samples.song import beats_of, write_song

__all__ = ["beats_of", "exchanged", "tilted", "travelling", "with_rest", "write_song"]
