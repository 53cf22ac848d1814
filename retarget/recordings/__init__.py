"""What a person looks at: Rerun recordings, films, pictures of reports. The one room that knows Rerun."""

from retarget.recordings.film import write_film
from retarget.recordings.off_screen import Shot, as_it_looks, veil
from retarget.recordings.pictures import save_still
from retarget.recordings.plots import plot_report
from retarget.recordings.retargeting_film import save_film
from retarget.recordings.sound import Soundtrack
from retarget.recordings.stories import save_comparison, save_rehearsal, save_retargeting, save_rollouts
from retarget.recordings.viewer import show

__all__ = [
    "Shot",
    "Soundtrack",
    "as_it_looks",
    "plot_report",
    "save_comparison",
    "save_film",
    "save_rehearsal",
    "save_retargeting",
    "save_rollouts",
    "save_still",
    "show",
    "veil",
    "write_film",
]
