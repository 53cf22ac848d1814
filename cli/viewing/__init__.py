"""What `dance-view` is made of: which show a file is, what can be done beside looking, and how long it stays on."""

from cli.viewing.policy_page import policy_page
from cli.viewing.serve import serve
from cli.viewing.shows import is_motion, panel_of, show_of
from cli.viewing.training_page import training_page

__all__ = ["is_motion", "panel_of", "policy_page", "serve", "show_of", "training_page"]
