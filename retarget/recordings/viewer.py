"""Rerun's viewer, opened on something that can be saved as a recording."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from clips import OutputError
from robot_models import has_display


def show(save: Callable[[Path], object]) -> None:
    """Save a recording in the system's folder for such things and open the viewer, which goes on by itself.

    Args:
        save: writes a recording to a path.

    Raises:
        OutputError: Rerun's viewer is not installed, or there is no display.
    """
    if importlib.util.find_spec("rerun_cli") is None:
        raise OutputError("viewer", found="no Rerun viewer", expected="it installed", cure="pip install rerun-sdk")
    if not has_display():
        raise OutputError(
            "viewer", found="no display", expected="one", cure="save('dance.rrd') and open it where there is one"
        )
    path = Path(tempfile.mkdtemp(prefix="dance-")) / "recording.rrd"
    save(path)
    subprocess.Popen([sys.executable, "-m", "rerun_cli", str(path)], start_new_session=True)
