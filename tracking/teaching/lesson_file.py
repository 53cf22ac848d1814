"""A run of teaching on disk: what a resumed one goes on from, to the last digit."""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from dataclasses import asdict

import torch

from clips import write_whole
from tracking.config import TrainConfig
from tracking.errors import TrackingError
from tracking.task import NamedReference, motion_set_sha256
from tracking.teaching.distillation import Distillation
from tracking.training import CHECKPOINT, CURVES, Run, write_curves

FORMAT_VERSION = 1


def save_lesson(run: Run, lesson: Distillation, config: TrainConfig, pieces: Sequence[NamedReference]) -> None:
    """Everything that a resumed run needs; from here on both begin alike."""
    state = {
        "format_version": FORMAT_VERSION,
        "lesson": lesson.state_dict(),
        "config": json.dumps(asdict(config), sort_keys=True),
        "reference_sha256": motion_set_sha256(pieces),
        "progress": json.dumps(
            {"steps": run.steps, "seconds": run.seconds, "focus_s": run.focus_s, "curves": run.curves}
        ),
    }
    content = io.BytesIO()
    torch.save(state, content)  # to memory first: on a full disk torch names no disk
    with write_whole(run.folder / CHECKPOINT) as stream:
        stream.write(content.getbuffer())
    if run.curves:
        write_curves(run.folder / CURVES, run.curves)
    lesson.begin_anew()
    run.saved = run.steps


def restore_lesson(run: Run, lesson: Distillation, pieces: Sequence[NamedReference]) -> None:
    """Go on where a run was saved.

    Raises:
        TrackingError: it is no run of teaching, or one on other references.
    """
    path = run.folder / CHECKPOINT
    try:
        state = torch.load(path, weights_only=True, map_location="cpu")
        lesson_state = state["lesson"]
    except Exception as e:  # torch raises a different type for every way in which a file can be broken
        raise TrackingError(
            str(path), found=f"no run of teaching ({type(e).__name__})", expected="the checkpoint of one",
            cure="resume with the teacher that the run began with",
        ) from e  # fmt: skip
    if state["reference_sha256"] != motion_set_sha256(pieces):
        raise TrackingError(
            str(path), found="a run on other references", expected="those that it began with", cure="name the same ones",
            option="ref",
        )  # fmt: skip
    told = json.loads(state["progress"])
    run.steps, run.seconds, run.curves = told["steps"], told["seconds"], told["curves"]
    run.before_s, run.focus_s = run.seconds, told.get("focus_s", 0.0)
    run.saved = run.steps
    try:
        lesson.load_state_dict(lesson_state)
    except ValueError as e:
        raise TrackingError(
            str(path), found=f"a pupil that was shown other things ({e})", expected="one of this release's",
            cure="begin anew in another folder", option="output",
        ) from e  # fmt: skip
