"""One reader per kind of file. Each has `recognises(raw)`, by content, and `read(raw, options)`."""

from clips.readers.read import read_clip, read_of_several

__all__ = [
    "read_clip",
    "read_of_several",
]
