"""Robots of collections by name, from a checkout; what is not there is refused with a way on."""

import pytest
from any_pose import dancer_xml

import cli.robot
from robot_models import RobotError, find_profile, load_robot
from robot_models.draft import in_collection, listed_robot, menagerie_humanoids

pytest.importorskip("mujoco_menagerie")


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """Menagerie's folder of one robot, which is our own in disguise; and a place for own profiles."""
    folder = tmp_path / "menagerie" / "unitree_h1"
    folder.mkdir(parents=True)
    (folder / "h1.xml").write_text(dancer_xml())
    monkeypatch.setenv("MENAGERIE_ROOT", str(tmp_path / "menagerie"))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setattr(
        "robot_models.catalogue.platformdirs.user_config_dir", lambda *_, **__: str(tmp_path / "config")
    )
    return folder


def test_a_robot_is_found_with_its_licence(checkout):
    listed = listed_robot("menagerie:unitree_h1")
    assert listed.path == checkout / "h1.xml" and listed.name == "unitree_h1" and listed.licence.startswith("BSD")
    assert "unitree_h1" in menagerie_humanoids() and "franka_emika_panda" not in menagerie_humanoids()


def test_it_is_drafted_kept_and_then_known_by_that_name(checkout, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(RobotError, match="dance-robot add menagerie:unitree_h1"):
        find_profile("menagerie:unitree_h1")
    assert cli.robot.main(["add", "menagerie:unitree_h1", "--keep"]) in (0, 1)
    profile = find_profile("menagerie:unitree_h1")
    assert profile.source.licence.startswith("BSD") and "Menagerie" in profile.source.origin
    assert load_robot("unitree_h1").joint_names
    assert cli.robot.main(["list"]) == 0 and "menagerie:NAME" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["menagerie:nonsense", "menagerie:", "menagerie:booster_t1", "description:nonsense"])
def test_what_is_not_there_is_refused(checkout, name):
    if name.startswith("description"):
        pytest.importorskip("robot_descriptions")
    with pytest.raises(RobotError):
        listed_robot(name)


def test_only_names_of_collections_are_taken_for_them():
    assert in_collection("menagerie:x") and not in_collection("menagerie") and not in_collection("C:/robots/x.urdf")
