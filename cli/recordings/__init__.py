"""What a person looks at: Rerun recordings, films, pictures."""

from cli.recordings.chart import save_sweep
from cli.recordings.film import write_film
from cli.recordings.pictures import save_still
from cli.recordings.stories import save_comparison, save_rehearsal, save_retargeting, save_rollouts

__all__ = [
    "save_comparison",
    "save_rehearsal",
    "save_retargeting",
    "save_rollouts",
    "save_still",
    "save_sweep",
    "write_film",
]
