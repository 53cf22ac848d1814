"""One reader per kind of file. Each has `recognises(raw)`, by content, and `read(raw, options)`."""

from clips.readers.one_of_several import clip_stem, file_and_name
from clips.readers.read import clips_in, read_clip, read_of_several

__all__ = [
    "clip_stem",
    "clips_in",
    "file_and_name",
    "read_clip",
    "read_of_several",
]
