"""What a training's page shows of a judgement."""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("viser")
pytest.importorskip("torch")

from cli.viewing.training_page import show_of_run, training_page
from tracking.evaluation import Evaluation
from tracking.evaluation.rollouts import Second
from tracking.task import read_named_reference

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")


@pytest.fixture
def judged(groove, groove_file):
    """A run whose policy fails in second 2 half of the time."""
    reference, piece = groove.reference, read_named_reference(groove_file)
    qpos = reference.qpos[reference.dance]
    seconds = tuple(Second(at_s=float(k), failed=5 * (k == 2), body_error_mm=20.0) for k in range(4))
    result = Evaluation(
        rollouts=10, finished=0.5, finished_low=0.2, finished_high=0.8, finished_in_place=0.5, survived_s=3.0, stood=0.6,
        stood_s=3.2, duration_s=4.0, body_error_mm=21.0, body_error_half_mm=1.0, global_error_mm=50.0, joint_error_rad=0.1,
        causes={"end_effector_height": 5}, terms={}, seconds=seconds,
        shown={"best: finished": qpos, "median: finished": qpos, "worst: fell at 2.0 s": qpos[:100]},
    )  # fmt: skip
    row = {"minutes": 1.0, "finished": 0.5, "stood": 0.6, "body_error_mm": 21.0}
    run = SimpleNamespace(
        evaluations={piece.name: result}, steps=1_200_000, seconds=66.0, curves=[row, {**row, "minutes": 2.0}]
    )
    return run, groove.robot, piece


def test_best_and_worst_stand_beside_what_is_meant_and_the_hard_second_is_red(judged):
    show = show_of_run(*judged)
    assert [f.name for f in show.figures if not f.ghost] == ["best: finished", "worst: fell at 2.0 s"]
    assert [f.place for f in show.figures] == [0, 1, 0, 1]
    assert show.verdict == "1.20 M steps, 1.1 min: 50 % finish"
    ((a, b, colour),) = show.lanes[0].stretches
    assert (a, b) == (100, 150) and colour == (230, 0, 0)
    assert show.moments == ((2.0, "hardest: 5 of 10 fail here"),)
    assert ("within the rules", "3.0 of 4.0 s") in [(row.what, row.value) for row in show.rows]


def test_the_page_is_there_before_during_and_not_after(judged, capsys):
    import urllib.error
    import urllib.request

    run, robot, piece = judged
    with training_page(robot, [piece], port=8440) as tell:
        address = capsys.readouterr().out.split("look at it: ")[1].split()[0]
        assert urllib.request.urlopen(address).status == 200
        tell(run)
        tell(run)
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(address, timeout=2)
    assert np.isfinite(run.seconds)
