"""What a person looks at: Rerun recordings, films, pictures."""

from cli.recordings.certificate_page import certificate_page
from cli.recordings.chart import save_sweep
from cli.recordings.film import write_film
from cli.recordings.pictures import save_still
from cli.recordings.rehearsal import save_performance
from cli.recordings.stories import save_comparison, save_evaluation, save_rehearsal, save_retargeting, save_rollouts
from cli.recordings.training import save_training
from cli.recordings.window import has_display, show_live

__all__ = [
    "certificate_page",
    "has_display",
    "save_comparison",
    "save_evaluation",
    "save_performance",
    "save_rehearsal",
    "save_retargeting",
    "save_rollouts",
    "save_still",
    "save_sweep",
    "save_training",
    "show_live",
    "write_film",
]
