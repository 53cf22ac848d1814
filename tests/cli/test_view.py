"""`dance-view`: what it takes, what it refuses, and that mending on the page is the command that it shows."""

import contextlib
import math
import re
import shlex
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import SAMPLES

pytest.importorskip("viser")

import cli.retarget
import cli.view
from cli.shell import FileOptions
from cli.viewing import panel_of, show_of
from cli.viewing.live_panel import tracker_of
from cli.viewing.mending import Edits, Mending
from cli.viewing.mending_panel import MendingPanel, show_of_result
from cli.viewing.shows import mending_of
from cli.viewing.touch_controls import moved, touches_of
from cli.viewing.upload_panel import UploadPanel
from clips import save_reference
from retarget import ContactEdit, KeyFrame, RetargetError

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")


@pytest.fixture
def clip(tmp_path, monkeypatch):
    """A recording in the current folder."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "groove.csv"
    path.write_bytes((SAMPLES / "groove.csv").read_bytes())
    return path.relative_to(tmp_path)


def test_a_mended_dance_is_what_its_command_writes(clip, tmp_path, capsys):
    mending = Mending(clip, "dancer", FileOptions())
    touch = ContactEdit(start=0.2, end=0.9, edge="left_heel", kind="planted")
    key = KeyFrame(time=1.0, joint="left_elbow", value=-0.8)
    changes = {
        "start": 1.0,
        "end": 4.0,
        "mirror": True,
        "speed": 0.9,
        "weights": (("arm", 9.5), ("pelvis_position", 40.0)),
    }
    mending.solve(mending.mended(touches=(touch,), keys=(key,), **changes), lambda *_: None)
    assert mending.command.endswith("--weights.arm 9.5 --weights.pelvis-position 40")
    written = [path.name for path in mending.write()]
    assert written == ["groove_dancer.npz", "groove_dancer.rrd", "groove_touches.csv", "groove_keys.csv"]
    ours = (tmp_path / "groove_dancer.npz").read_bytes()
    name, *words = shlex.split(mending.command)
    assert name == "dance-retarget" and cli.retarget.main(words) == 0, capsys.readouterr().err
    assert (tmp_path / "groove_dancer.npz").read_bytes() == ours


def test_a_step_that_is_refused_changes_nothing_and_each_other_is_taken_back(clip):
    mending = Mending(clip, "dancer", FileOptions())
    first, whole = mending.edits, mending.result
    with pytest.raises(RetargetError, match="key frame"):
        mending.solve(mending.mended(keys=(KeyFrame(time=99.0, joint="left_elbow", value=0.0),)), lambda *_: None)
    assert mending.edits == first and mending.result is whole
    mending.solve(mending.mended(end=3.0), lambda *_: None)
    assert mending.result.reference.frames < whole.reference.frames
    assert mending.undo() and mending.result is whole and mending.edits == first
    assert not mending.undo()


def test_words_say_only_what_was_changed(tmp_path):
    plain = Edits(robot="g1")
    assert plain.words(tmp_path / "a.bvh", FileOptions(), tmp_path) == [str(tmp_path / "a.bvh"), "--robot", "g1"]
    changed = Edits(robot="g1", start=0.5, drop=("2-3",), speed=2.0, mirror=True)
    words = changed.words(tmp_path / "a.bvh", FileOptions(fps=30.0), tmp_path)
    assert words[3:] == ["--fps", "30", "--start", "0.5", "--drop", "2-3", "--speed", "2", "--mirror"]


class Gui:
    """The controls of a page, to be pressed by their labels."""

    def __init__(self):
        self.by_label = {}

    def __getattr__(self, name):
        def add(label, *values, **options):
            value = options.get("initial_value", values[-1] if values else None)
            if isinstance(value, tuple | list) and value and isinstance(value[0], str):
                value = value[0]  # a choice
            handle = SimpleNamespace(value=value, content=label, press=None)
            handle.on_click = handle.on_update = handle.on_upload = lambda act: setattr(handle, "press", act)
            self.by_label[label] = handle
            return contextlib.nullcontext() if name == "add_folder" else handle

        return add


def test_controls_become_edits_and_a_refusal_is_told_in_its_place(clip):
    mending = Mending(clip, "dancer", FileOptions())
    panel, gui = MendingPanel(mending), Gui()
    shown = []
    panel.page = SimpleNamespace(seconds=2.5, change=shown.append)
    panel.build(gui)
    gui.by_label["seconds to keep"].value = (1.0, 4.0)
    gui.by_label["left and right exchanged"].value = True
    gui.by_label["solve again"].press(None)
    assert (mending.edits.start, mending.edits.end, mending.edits.mirror) == (1.0, 4.0, True)
    assert shown[-1].frames < 400
    gui.by_label["joint"].value = "left_elbow"
    gui.by_label["degrees"].value = -40.0
    gui.by_label["hold it at the second that is shown"].press(None)
    reference = mending.result.reference
    at = 2.5 - reference.dance.start / reference.fps
    assert mending.edits.keys == (KeyFrame(time=round(at, 3), joint="left_elbow", value=math.radians(-40.0)),)
    held = reference.joint_pos[reference.dance][round(at * reference.fps), reference.joint_names.index("left_elbow")]
    assert held == pytest.approx(math.radians(-40.0), abs=0.01)
    gui.by_label["seconds to keep"].value = (0.5, 4.0)  # the joint's second would be another
    gui.by_label["solve again"].press(None)
    assert len(shown) == 2 and "refused: another cut" in panel._news.content
    gui.by_label["take the last step back"].press(None)
    gui.by_label["seconds to drop"].value = "nonsense"
    gui.by_label["solve again"].press(None)
    assert len(shown) == 3 and "refused" in panel._news.content
    gui.by_label["take the last step back"].press(None)
    assert mending.edits == Edits(robot="dancer") and len(shown) == 4


def test_a_touch_is_dragged_by_its_end_and_weights_are_chosen(clip):
    mending = Mending(clip, "dancer", FileOptions())
    panel, gui = MendingPanel(mending), Gui()
    panel.page = SimpleNamespace(seconds=2.5, change=lambda show: None)
    panel.build(gui)
    before = touches_of(mending.result.reference, "right_heel")
    gui.by_label["part"].value = "right_heel"
    gui.by_label["part"].press(None)
    assert len(gui.by_label["touch"].options) == len(before) + 1
    assert gui.by_label["its ends"].value == (round(before[0].start, 2), round(before[0].end, 2))
    end = round(before[0].end - 0.3, 2)
    gui.by_label["its ends"].value = (before[0].start, end)
    gui.by_label["solve with it"].press(None)
    after = touches_of(mending.result.reference, "right_heel")
    assert after[0].end == pytest.approx(end, abs=0.03) and before[0].end - after[0].end > 0.2
    assert [t.kind for t in mending.edits.touches] == ["free", before[0].kind]
    gui.by_label["arms as the person's"].value = "4"
    gui.by_label["solve with these"].press(None)
    assert mending.edits.weights == (("arm", 76.0),) and len(mending.edits.touches) == 2


def test_a_hand_is_dragged_and_held_there(clip):
    mending = Mending(clip, "dancer", FileOptions())
    panel, gui = MendingPanel(mending), Gui()
    arrows = SimpleNamespace(position=None)

    def handle(place_w):
        arrows.position = place_w + (0.0, 0.0, 0.08)  # dragged up
        return arrows

    panel.page = SimpleNamespace(seconds=3.0, frame=150, change=lambda show: None, handle=handle)
    panel.build(gui)
    gui.by_label["hold it where it is dragged"].press(None)
    assert not mending.edits.keys  # take it first
    gui.by_label["hand"].value = "right hand"
    gui.by_label["take it"].press(None)
    gui.by_label["hold it where it is dragged"].press(None)
    begin = mending.result.reference.dance.start
    assert {key.time for key in mending.edits.keys} == {round((150 - begin) / 50.0, 3)}
    robot, reference = mending.result.robot, mending.result.reference
    now = robot.landmark_pos(("right_wrist",), reference.body_pos_w[150], reference.body_quat_w[150])[0]
    assert np.linalg.norm(now - arrows.position) < 0.03


def test_what_is_dropped_is_kept_solved_or_asked_about(clip, tmp_path):
    panel, gui, presented = UploadPanel("dancer", FileOptions(), "none"), Gui(), []
    panel.page = SimpleNamespace(present=presented.append)
    assert panel.show.figures[0].robot.name == "dancer"
    panel.build(gui)
    content = (SAMPLES / "groove.csv").read_bytes()
    panel._came("../../dance.csv", content)  # a name is no path
    assert (tmp_path / "dance.csv").read_bytes() == content
    assert isinstance(presented[0], MendingPanel) and "fps" in " ".join(presented[0]._mending.recognised)
    panel._came("dance.csv", b"another")
    assert "another file of that name" in panel._news.content
    gui.by_label["what you state about it"].value = "--nonsense 3"
    panel._came("more.csv", content)
    assert "not understood" in panel._news.content and len(presented) == 1
    gui.by_label["what you state about it"].value = "--stature 1.5"
    gui.by_label["try again"].press(None)
    assert len(presented) == 2 and presented[1]._mending.command.endswith("--stature 1.5")


def test_who_dances_a_recording_with_physics():
    pytest.importorskip("onnxruntime")
    assert tracker_of("none", "g1") is None and tracker_of("auto", "talos") is None
    assert tracker_of("auto", "g1") == Path("tracker-g1") and tracker_of("mine.onnx", "talos") == Path("mine.onnx")


def test_what_is_left_of_a_touch_that_moves_is_free():
    old = ContactEdit(start=1.0, end=2.0, edge="left_toe", kind="planted")
    new = ContactEdit(start=1.5, end=2.5, edge="left_toe", kind="pivoting")
    assert moved(old, new) == (ContactEdit(start=1.0, end=1.5, edge="left_toe", kind="free"), new)
    assert moved(None, new) == (new,) and moved(old, old) == (old,)


def test_what_is_shown_of_each_kind_of_file(groove, groove_file, clip, tmp_path):
    options = FileOptions()
    assert mending_of([groove_file], None, options) is None
    show = show_of([groove_file], None, options)
    assert show.verdict == "every gate holds" and show.arrows
    assert len(show_of([groove_file, clip], "dancer", options).figures) == 2
    mending = mending_of([clip], "dancer", options)
    assert show_of_result(mending.result).people
    other = tmp_path / "same_again.npz"
    save_reference(groove.reference, other)
    assert [f.name for f in show_of([groove_file, other], None, options).figures] == ["groove.npz", "same_again.npz"]


def test_a_policy_dances_beside_its_ghost():
    pytest.importorskip("torch")
    show = show_of([Path("groove-dancer")], None, FileOptions())
    robot, ghost = show.figures
    assert ghost.ghost and robot.body_pos_w.shape == ghost.body_pos_w.shape
    assert np.abs(robot.body_pos_w - ghost.body_pos_w).max() > 1e-3  # it was simulated
    assert re.match(r"12\.\d of 12\.\d s$", show.verdict)


def test_a_live_policy_is_simulated_as_it_is_shown_pushed_and_begun_again():
    pytest.importorskip("torch")
    with contextlib.ExitStack() as stack:
        panel = panel_of([Path("groove-dancer")], None, FileOptions(), stack)
        gui, moved = Gui(), []
        panel.page = SimpleNamespace(go_to=moved.append)
        panel.build(gui)
        robot, ghost = panel.show.figures
        assert panel.ahead(50) == 50
        assert np.abs(robot.body_pos_w[1:51] - ghost.body_pos_w[1:51]).max() > 1e-3
        np.testing.assert_array_equal(robot.body_pos_w[51:], ghost.body_pos_w[51:])  # not danced yet
        assert panel.ahead(20) == 20 and "falls: 0" in panel._news.content  # what was danced stays
        gui.by_label["m/s"].value = 4.0
        gui.by_label["towards"].press(SimpleNamespace(target=SimpleNamespace(value="▲")))
        fell = panel.ahead(400)
        assert fell < 150 and "fell at" in panel._news.content
        shown = [panel.ahead(fell + k) for k in range(60)]
        assert set(shown[:40]) == {fell} and 0 in shown  # it is looked at, then begins again
        gui.by_label["friction"].value = 0.4
        gui.by_label["begin again, so hindered"].press(None)
        assert moved == [0] and panel._dance.frame == 0


def test_the_command_writes_one_page_or_refuses(groove_file, tmp_path, capsys):
    out = tmp_path / "deep" / "page.html"
    assert cli.view.main([str(groove_file), "--web", str(out)]) == 0
    assert out.stat().st_size > 1e6 and "page of" in capsys.readouterr().out
    for words, said in (
        (["--web", "page.html"], "no file named"),
        ([str(groove_file), "--web", "page.rrd"], "ends in .html"),
        ([str(tmp_path / "no.npz")], "no such file"),
    ):
        assert cli.view.main(words) == 2
        assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nothing.bvh"], "nothing.bvh: found no such file"),
        (["GROOVE", "groove-dancer"], "show a policy alone"),
        (["GROOVE", "--ref", "GROOVE"], "a tracker, which follows it"),
        (["GROOVE", "--port", "99999", "--no-browser"], "port 99999"),
        (["GROOVE", "--host", "nonsense.invalid", "--no-browser"], "no address"),
    ],
)
def test_what_cannot_be_shown_is_refused_at_once(words, said, groove_file, capsys):
    assert cli.view.main([str(groove_file) if word == "GROOVE" else word for word in words]) == 2
    assert said in capsys.readouterr().err


def test_a_click_while_it_solves_is_no_second_solve(clip):
    mending = Mending(clip, "dancer", FileOptions())
    panel, gui, told = MendingPanel(mending), Gui(), []
    panel.build(gui)
    solve = mending.solve

    def impatient(edits, progress):
        told.append(edits)
        gui.by_label["solve again"].press(None)  # from within: the first is not done yet
        return solve(edits, progress)

    mending.solve = impatient
    gui.by_label["times as fast"].value = 0.8
    gui.by_label["solve again"].press(None)
    assert len(told) == 1 and mending.edits.speed == 0.8


def test_touches_and_dropped_seconds_exclude_one_another(clip):
    mending = Mending(clip, "dancer", FileOptions())
    mending.solve(mending.mended(drop=("3-4",)), lambda *_: None)
    with pytest.raises(RetargetError, match="keep one stretch of seconds"):
        mending.mended(keys=(KeyFrame(time=1.0, joint="left_elbow", value=-0.5),))
