"""The page and the file, on viser's own server: what is drawn is where the reference has it, and nothing is fetched."""

import re
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("viser")

from clips import OutputError
from retarget.stage import Page, close_server, open_server, save_page, show_retargeting, show_side_by_side
from retarget.stage.scene import SIDE_M, Scene
from robot_models import load_robot, lowest_point, surface, visual_parts

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")


@pytest.fixture
def server():
    made = open_server("127.0.0.1", 8300)
    yield made
    close_server(made)


@pytest.fixture(scope="module")
def show(groove):
    return show_retargeting(
        groove.robot, groove.reference, groove.report, groove.diagnoses, groove.sources, groove.dynamics
    )


def handles(server):
    return server.scene._handle_from_node_name


def test_bodies_stand_where_the_reference_has_them(groove, show, server):
    scene, name, t = Scene(server.scene, show), groove.robot.body_names[5], 77
    scene.go_to(t)
    body = handles(server)[f"/world/figure_0/{name}"]
    np.testing.assert_allclose(body.position, groove.reference.body_pos_w[t, 5])
    np.testing.assert_allclose(body.wxyz, groove.reference.body_quat_w[t, 5])
    scene.go_to(10**6)  # beyond the end: the last pose
    np.testing.assert_allclose(body.position, groove.reference.body_pos_w[-1, 5])


def test_the_person_is_there_during_the_dance_alone(groove, show, server):
    scene, dance = Scene(server.scene, show), groove.reference.dance
    person, lines = handles(server)["/world/person_0"], handles(server)["/world/person_0/bones"]
    scene.go_to(dance.start - 1)
    assert not person.visible
    scene.go_to(dance.start + 30)
    assert person.visible
    np.testing.assert_allclose(lines.points, show.people[0].bones_w[30], atol=1e-6)
    scene.show_people(False)
    scene.go_to(dance.start + 31)
    assert not person.visible


def test_the_world_passes_under_who_is_followed(show, server):
    scene, world = Scene(server.scene, show), handles(server)["/world"]
    scene.go_to(120)
    np.testing.assert_allclose(np.asarray(world.position)[:2], -show.figures[0].body_pos_w[120, 0, :2], atol=0.1)
    scene.follow(False)
    scene.go_to(120)
    np.testing.assert_array_equal(world.position, 0.0)


def test_side_by_side_or_over_one_another(groove, server):
    scene = Scene(server.scene, show_side_by_side(dict.fromkeys("ab", (groove.robot, groove.reference))))
    assert handles(server)["/world/figure_1"].position[1] == SIDE_M
    scene.stand_apart(False)
    assert handles(server)["/world/figure_1"].position[1] == 0.0


def test_the_surface_is_the_robots(dancer):
    """Its lowest vertex is where MuJoCo has the lowest point of its primitives."""
    from robot_models import forward_kinematics
    from robot_models.maths import rotation as rot

    pos, quat = forward_kinematics(dancer, dancer.default_qpos[None])
    low = min(
        (rot.rotate(np.broadcast_to(quat[0, b], (len(p.vertices), 4)), p.vertices) + pos[0, b])[:, 2].min()
        for p in surface(dancer)
        for b in [dancer.body_names.index(p.body)]
    )
    assert low == pytest.approx(float(lowest_point(dancer, pos, quat)[0]), abs=2e-3)


def test_meshes_are_thinned(shared):
    robot = load_robot("g1")
    if not any(part.kind == "mesh" for part in visual_parts(robot)):
        pytest.skip("the G1's meshes are not on this machine")
    pytest.importorskip("fast_simplification")
    assert 10_000 < sum(len(piece.faces) for piece in surface(robot)) < 60_000


def test_a_page_plays_pauses_steps_and_jumps(show, server):
    page = Page(server, show)
    frames = iter(range(6))
    page.play(until=lambda: next(frames, None) is None)
    assert 0 < page.frame < 40
    page._step(None)
    assert page.frame == 0 and not page._playing
    page._step(1)
    page._jump(2.0)
    assert page.seconds == pytest.approx(2.0, abs=0.02)
    page.go_to(10**9)
    assert page.frame == show.frames - 1


def test_a_show_that_comes_into_being_is_shown_as_far_as_it_is(show, server):
    asked = []

    def ahead(frame):
        asked.append(frame)
        return min(frame, 3)

    page, ticks = Page(server, show, ahead=ahead), iter(range(12))
    page.play(until=lambda: next(ticks, None) is None)
    assert page.frame == 3 and max(asked) > 3


def test_a_page_that_changes_keeps_its_second_and_its_panel(show, server):
    built = []
    page = Page(server, show, panel=built.append)
    page.go_to(100)
    page.change(replace(show, title="another"))
    assert page.frame == 100 and len(built) == 2


def test_one_file_holds_everything_and_fetches_nothing(show, tmp_path):
    out, told = tmp_path / "page.html", []
    save_page(out, show, lambda stage, done, total, note="": told.append(done))
    text = out.read_text()
    assert told[-1] <= show.frames and show.title in text and "left heel" in text
    outer = re.sub(r'atob\("[^"]+"\)', "", text)
    assert not re.findall(r"""(?:src|href)=["']?(?:https?:)?//""", outer)
    with pytest.raises(OutputError):
        save_page(tmp_path / "nowhere" / "page.html", show)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["page.html"]
