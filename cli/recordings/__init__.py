"""Recordings, pages and windows of what tracking came to."""

from cli.recordings.certificate_page import certificate_page
from cli.recordings.chart import save_sweep
from cli.recordings.evaluation import save_evaluation
from cli.recordings.film import FilmOptions, film_of, lost_song
from cli.recordings.rehearsal import save_performance
from cli.recordings.training import save_training
from cli.recordings.window import show_live

__all__ = [
    "FilmOptions",
    "certificate_page",
    "film_of",
    "lost_song",
    "save_evaluation",
    "save_performance",
    "save_sweep",
    "save_training",
    "show_live",
]
