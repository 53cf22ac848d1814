"""What `dance-view` is made of: which show a file is, what can be done beside looking, and how long it stays on."""

from cli.viewing.serve import serve
from cli.viewing.shows import panel_of, show_of
from cli.viewing.training_page import training_page

__all__ = ["panel_of", "serve", "show_of", "training_page"]
