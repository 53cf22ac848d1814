"""One reader per kind of file. Each has `recognises(raw)`, by content, and `read(raw, options)`."""
