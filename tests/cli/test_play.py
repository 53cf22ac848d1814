"""`dance-play`: a film where there is a GL to draw with, and a way out where there is no display."""

import os
import subprocess
import sys

import pytest
from excerpt import excerpt

from cli import play
from clips import load_reference, save_reference

pytest.importorskip("torch")


@pytest.fixture
def short(groove_file, tmp_path):
    """A reference file of a few frames, so that software rendering does not take minutes."""
    save_reference(excerpt(load_reference(groove_file), 60, 80), tmp_path / "short.npz")
    return tmp_path / "short.npz"


def test_without_a_display_it_is_a_page_or_the_way_to_a_film_is_shown(groove_file, monkeypatch, capsys):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    if not sys.platform.startswith("linux"):
        pytest.skip("other systems have a display")
    monkeypatch.setattr(play, "find_spec", lambda name: None)
    assert play.main([str(groove_file)]) == 2
    assert "--film out.mp4" in capsys.readouterr().err
    shown = []
    monkeypatch.setattr(play, "find_spec", lambda name: name == "viser")
    monkeypatch.setattr(play.view, "run", lambda args: shown.append(args.what) or 0)
    assert play.main([str(groove_file)]) == 0 and shown == [(groove_file,)]


def test_a_film_of_another_kind_or_size_is_refused(groove_file, tmp_path, capsys):
    assert play.main([str(groove_file), "--film", str(tmp_path / "a.gif")]) == 2
    assert play.main([str(groove_file), "--film", str(tmp_path / "a.mp4"), "--width", "101"]) == 2
    assert "even numbers" in capsys.readouterr().err and not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_policy_and_its_reference_as_films(short, tmp_path):
    pytest.importorskip("imageio_ffmpeg")
    from cli import train

    run = tmp_path / "run"
    words = ["--ref", str(short), "-o", str(run), "--steps", "384", "--envs", "16", "--no-recording", "--anyway"]
    assert train.main([*words, "--teacher", "none"]) in (0, 1)
    for what in (short, run):
        film = tmp_path / f"{what.stem}.mp4"
        words = [str(what), "--film", str(film), "--width", "160", "--height", "120"]
        done = subprocess.run(
            [sys.executable, "-c", f"import sys; from cli.play import main; sys.exit(main({words!r}))"],
            capture_output=True, text=True, env={**os.environ, "MUJOCO_GL": "egl"},
        )  # fmt: skip
        if "no OpenGL" in done.stderr or "EGL" in done.stderr:
            pytest.skip("no EGL on this machine")
        assert done.returncode in (0, 1), done.stderr
        assert film.stat().st_size > 1000 and "wrote" in done.stdout
