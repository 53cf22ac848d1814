"""What is shown, and when a window or a renderer is opened and closed, by doubles that need no GL."""

import sys
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

from tracking import TrackingError
from tracking.envs.viewer import Screen


class Window:
    """Stands in for the viewer and for the renderer."""

    def __init__(self, opened, model, data):
        self.model, self.data, self.seen, self.camera, self.open = model, data, [], None, True
        opened.append(self)

    def sync(self):
        self.seen.append(self.data.qpos.copy())

    def update_scene(self, data, camera):
        self.data, self.camera = data, camera

    def render(self):
        self.sync()
        return np.full((4, 5, 3), len(self.seen), dtype=np.uint8)

    def close(self):
        self.open = False


@pytest.fixture
def opened(monkeypatch):
    """Every window that was opened."""
    windows = []
    viewer = SimpleNamespace(launch_passive=lambda model, data: Window(windows, model, data))
    monkeypatch.setitem(sys.modules, "mujoco.viewer", viewer)
    monkeypatch.setattr(mujoco, "viewer", viewer, raising=False)
    monkeypatch.setattr(mujoco, "Renderer", lambda model, height, width: Window(windows, model, None))
    return windows


@pytest.mark.parametrize("mode", ["ansi", "", "rgb", "Human"])
def test_a_mode_that_nobody_knows_is_refused_at_once(dancer, mode):
    with pytest.raises(TrackingError, match="render_mode.*'human' or 'rgb_array'"):
        Screen(dancer, mode)


def test_without_a_mode_nothing_is_opened_or_drawn(dancer, opened):
    screen = Screen(dancer, None)
    assert screen.draw(dancer.default_qpos) is None and not opened
    screen.close()


@pytest.mark.parametrize("mode", ["human", "rgb_array"])
def test_one_window_opened_with_the_first_picture_shows_every_pose_until_it_is_closed(dancer, opened, mode):
    screen = Screen(dancer, mode)
    assert not opened
    screen.close()  # before anything was opened: nothing to do
    poses = dancer.default_qpos + np.linspace(0.0, 0.3, 3)[:, None]
    pictures = [screen.draw(pose) for pose in poses]
    assert len(opened) == 1 and opened[0].open
    np.testing.assert_array_equal(opened[0].seen, poses)
    assert [p is None for p in pictures] == [mode == "human"] * 3
    screen.close()
    screen.close()
    assert not opened[0].open
    screen.draw(poses[0])  # after that: a new one
    assert len(opened) == 2 and opened[1].open


def test_pictures_follow_the_robot_and_are_the_callers_own(dancer, opened):
    screen, pose = Screen(dancer, "rgb_array"), dancer.default_qpos.copy()
    pose[:2] = 3.0, -4.0
    first = screen.draw(pose)
    assert tuple(opened[0].camera.lookat[:2]) == (3.0, -4.0)
    height = opened[0].camera.lookat[2]
    pose[2] += 1.0
    second = screen.draw(pose)
    assert opened[0].camera.lookat[2] == height  # a jump is seen as a jump
    assert (first == 1).all() and (second == 2).all() and first.dtype == np.uint8
