"""What `dance-view` is made of: which show a file is, and how long it stays on."""

from cli.viewing.mending_panel import show_of_result
from cli.viewing.serve import serve
from cli.viewing.shows import mending_of, show_of

__all__ = ["mending_of", "serve", "show_of", "show_of_result"]
