"""Films without a GL: which poses are drawn, how fast they play, and what is left when it does not work."""

import sys
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

import retarget.recordings.film
from clips import OutputError
from retarget.recordings.film import write_film
from retarget.recordings.off_screen import Shot, Stage

SIZE = 64, 48


@pytest.fixture
def studio(monkeypatch):
    """A stage and an encoder that keep what they are given."""
    kept = SimpleNamespace(drawn=[], frames=[], options={}, closed=[])

    class Double:
        def __init__(self, robot, size, shadows):
            kept.size = size

        def look_beside(self, aside, width_m):
            kept.beside = (aside, width_m)

        def draw(self, shot):
            kept.drawn.append((shot.qpos, shot.ghost))
            return np.zeros((SIZE[1], SIZE[0], 3), dtype=np.uint8)[:, ::-1]  # not contiguous

        def close(self):
            kept.closed.append("stage")

    def write_frames(path, size, **options):
        kept.options = {"path": path, "size": size, **options}
        with open(path, "wb") as stream:
            try:
                while True:
                    frame = yield
                    if frame is not None:
                        assert frame.flags["C_CONTIGUOUS"]
                        kept.frames.append(frame)
                        stream.write(b"frame")
            finally:
                kept.closed.append("film")

    monkeypatch.setattr(retarget.recordings.film, "Stage", Double)
    monkeypatch.setattr(retarget.recordings.film, "encoder", lambda: SimpleNamespace(write_frames=write_frames))
    return kept


def poses(count):
    return (Shot(qpos=np.full(3, float(k)), ghost=None if k % 2 else np.full(3, -float(k))) for k in range(count))


@pytest.mark.parametrize(("fps", "every"), [(25.0, 1), (30.0, 1), (50.0, 2), (60.0, 2), (100.0, 4), (200.0, 8)])
def test_a_film_plays_in_real_time_at_no_more_frames_than_players_can_take(studio, dancer, tmp_path, fps, every):
    told = []
    assert (
        write_film(tmp_path / "a.mp4", dancer, poses(21), fps, SIZE, progress=lambda *what: told.append(what[1])) == 21
    )
    assert [q[0] for q, _ in studio.drawn] == list(range(0, 21, every))
    assert all((ghost is None) == bool(q[0] % 2) and (ghost is None or ghost[0] == -q[0]) for q, ghost in studio.drawn)
    assert studio.options["fps"] == pytest.approx(fps / every) and studio.options["fps"] <= 60.0
    assert studio.options["size"] == studio.size == SIZE
    # As many seconds of film as of dance, to a frame.
    assert len(studio.frames) / studio.options["fps"] == pytest.approx(21 / fps, abs=1 / studio.options["fps"])
    assert told == list(range(1, 22)) and studio.closed == ["film", "stage"]
    assert [p.name for p in tmp_path.iterdir()] == ["a.mp4"] and (tmp_path / "a.mp4").read_bytes().startswith(b"frame")


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_a_film_that_breaks_off_leaves_the_old_one(studio, dancer, tmp_path, error):
    (tmp_path / "a.mp4").write_bytes(b"old")

    def broken():
        yield from poses(3)
        raise error("mine")

    with pytest.raises(error):
        write_film(tmp_path / "a.mp4", dancer, broken(), 50.0, SIZE)
    assert (tmp_path / "a.mp4").read_bytes() == b"old" and [p.name for p in tmp_path.iterdir()] == ["a.mp4"]


@pytest.mark.parametrize("size", [(63, 48), (64, 47), (14, 48), (0, 0), (-64, 48)])
def test_a_size_that_encoders_do_not_take_is_refused_before_anything_is_drawn(studio, dancer, tmp_path, size):
    with pytest.raises(OutputError, match="even numbers"):
        write_film(tmp_path / "a.mp4", dancer, poses(3), 50.0, size)
    assert not studio.drawn and not list(tmp_path.iterdir())


def test_without_an_encoder_the_line_that_installs_it_is_told(dancer, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(OutputError, match="no package imageio_ffmpeg.*pip install imageio-ffmpeg"):
        write_film(tmp_path / "a.mp4", dancer, poses(3), 50.0, SIZE)
    assert not list(tmp_path.iterdir())


def test_without_opengl_the_ways_to_it_are_told(dancer, monkeypatch):
    def broken(*size):
        raise RuntimeError("no display")

    monkeypatch.setattr(mujoco, "Renderer", broken)
    with pytest.raises(OutputError, match=r"no OpenGL.*RuntimeError: no display.*MUJOCO_GL"):
        Stage(dancer, SIZE)


class Renderer:
    """Keeps the camera's aims; its scene is MuJoCo's own."""

    def __init__(self, model, height, width):
        self.scene, self.aims = mujoco.MjvScene(model, 500), []
        self.model = model

    def update_scene(self, data, camera):
        self.aims.append(camera.lookat.copy())
        mujoco.mjv_updateScene(
            self.model,
            data,
            mujoco.MjvOption(),
            mujoco.MjvPerturb(),
            camera,
            int(mujoco.mjtCatBit.mjCAT_ALL),
            self.scene,
        )

    def render(self):
        return np.array([self.scene.ngeom])


@pytest.fixture
def stage(dancer, monkeypatch):
    monkeypatch.setattr(mujoco, "Renderer", Renderer)
    return Stage(dancer, SIZE)


def at(dancer, x):
    qpos = dancer.default_qpos.copy()
    qpos[0] = x
    return qpos


def test_the_camera_begins_at_the_robot_and_trails_it_without_ever_overtaking(stage, dancer):
    stage.draw(Shot(qpos=at(dancer, 2.0)))
    for _ in range(80):
        stage.draw(Shot(qpos=at(dancer, 3.0)))
    x = np.array(stage._renderer.aims)[:, 0]
    assert x[0] == 2.0 and (np.diff(x) > 0.0).all() and 2.95 < x[-1] < 3.0
    assert x[1] < 2.2  # a step is seen as a step


def test_a_ghost_is_a_second_robot_as_a_veil_and_a_bone_one_more_shape(stage, dancer):
    plain = int(stage.draw(Shot(qpos=at(dancer, 0.0)))[0])
    with_ghost = int(stage.draw(Shot(qpos=at(dancer, 0.0), ghost=at(dancer, 1.0)))[0])
    veils = [g for g in stage._renderer.scene.geoms[:with_ghost] if g.transparent]
    assert plain < with_ghost < 2 * plain + 1 and len(veils) >= with_ghost - plain
    assert min(abs(g.pos[0] - 1.0) for g in veils) < 0.5
    bone = (np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.02, np.ones(4))
    stage.look_at(np.zeros(2), 0.8)
    assert int(stage.draw(Shot(qpos=at(dancer, 0.0), bones=[bone, bone]))[0]) == plain + 2
    assert tuple(stage._renderer.aims[-1][:2]) == (0.0, 0.0)  # a still's camera stays where it is put
