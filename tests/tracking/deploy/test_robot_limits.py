"""The robot decides: every number of a contract against the robot's own profile, and whatever is sent within its limits."""

import dataclasses
import tomllib
from pathlib import Path

import numpy as np
import pytest

import tracking
from robot_models import DanceError, RobotError, load_robot, read_profile
from tracking import TrackingError, read_contract
from tracking.deploy.messages import Command
from tracking.deploy.robot_limits import RobotLimits
from tracking.deploy.transport import MOTORS, motor_order
from tracking.policy.gains import standing_gains

pytestmark = pytest.mark.usefixtures("as_users_run_it")  # refusals, and doubles of what is checked elsewhere

POLICIES = Path(tracking.__file__).parent / "policies"
C = read_contract(POLICIES / "groove-g1" / "contract.json")
G1 = load_robot("g1")
ROBOT = RobotLimits.of(G1)


def at(name, j, value):
    array = getattr(C, name).copy()
    array[j] = value
    return {name: array}


def of_arrays():
    """Every array of a contract with one number that no robot should be moved by."""
    for j in (0, 13, 28):
        values = {}
        for name in ("effort", "velocity", "lower", "upper"):
            own = getattr(C, name)[j]
            values[name] = (1.01 * own + 0.01, 0.9 * own - 0.01, 1e9, -1e9, 0.0 if own else 1.0, -1.0, np.nan, np.inf)
        for name, band in (("kp", ROBOT.kp_band), ("kd", ROBOT.kd_band)):
            values[name] = (1.1 * band[1][j], 0.9 * band[0][j] - 0.01, 0.0, -1.0, 1e9, np.nan)
        values |= dict.fromkeys(("stand_kp", "stand_kd"), (-0.1, -1.0, 1e9, np.nan, np.inf))
        values |= dict.fromkeys(
            ("target_lower", "target_upper", "default_joint_pos"), (1e9, -1e9, 100.0, -100.0, np.nan)
        )
        values["action_scale"] = (-0.1, 1e9, 10.0, np.nan, np.inf)
        yield from ((f"{name} {v:g} at {j}", at(name, j, v)) for name, some in values.items() for v in some)


def of_words_and_numbers():
    """Everything else of a contract."""
    names, chain = C.joint_names, C.anchor_chain
    told = {
        "control_dt": (0.0, -0.02, 1e-6, 0.2, 5.0, np.nan, np.inf),
        "robot": ("talos", ""),
        "robot_hash": ("0" * 64, ""),
        "joint_names": ((names[1], names[0], *names[2:]), names[::-1], (names[0], *names[:-1])),
        "anchor": ("pelvis", ""),
        "anchor_chain": ((), tuple(dataclasses.replace(x, pos=(0.0, 0.0, 1.0)) for x in chain), chain[:-1]),
        "look_ahead": (-1, 10**9),
        "heading_gain": (np.nan, 1e9, -1.0),
        "position_gain": (np.inf, -1.0, 1e9),
        "feed_forward": ((1.0,), (np.nan,) * 29, (1e9,) * 29),
        "delay_trained_with_s": ((-1.0, 0.0), (0.0, np.nan), (0.2, 0.1)),
        "target": ("anything", None),
    }
    yield from ((f"{name} {str(v)[:30]}", {name: v}) for name, some in told.items() for v in some)
    row = {
        "scale": (np.nan, np.inf), "size": (0, -1, 10**9), "at": (10**9, -(10**9)), "zeroed": ((10**6,), (-1,)),
        "noise": (np.nan, -1.0), "kind": (7,),
    }  # fmt: skip
    for name, some in row.items():
        for v in some:
            yield (
                f"observation {name} {v}",
                {"observation": (dataclasses.replace(C.observation[0], **{name: v}), *C.observation[1:])},
            )


def test_no_contract_that_differs_from_the_robots_profile_is_let_through():
    tried, passed = 0, []
    for name, changes in (*of_arrays(), *of_words_and_numbers()):
        tried += 1
        try:
            ROBOT.check(dataclasses.replace(C, **changes))
            passed.append(name)
        except DanceError as e:
            assert e.expected and e.found, name
    assert tried > 200 and not passed


@pytest.mark.parametrize("policy", ["groove-g1", "tracker-g1", "repertoire-g1"])
def test_what_comes_with_the_package_passes(policy):
    ROBOT.check(read_contract(POLICIES / policy / "contract.json"))


@pytest.mark.parametrize(
    ("legs", "waist", "arms", "kd"),
    [((100, 100, 100, 150, 40, 40), 150, 40, 2.0), ((100, 100, 100, 200, 20, 20), 400, 90, 5.0)],
)
def test_the_gain_sets_that_the_field_runs_on_this_robot_pass(legs, waist, arms, kd):
    kp = np.array([*legs, *legs, *[waist] * 3, *[arms, arms, arms, arms, 20, 20, 20] * 2], dtype=float)
    reach = C.effort / kp
    ROBOT.check(
        dataclasses.replace(C, kp=kp, kd=np.full(29, kd), target_lower=C.lower - reach, target_upper=C.upper + reach)
    )


def test_damping_and_stand_are_the_robots_whatever_the_contract_says():
    kp, kd = standing_gains(G1)
    np.testing.assert_array_equal(ROBOT.stand_kp, kp)
    soft = ROBOT.damping()
    assert not soft.kp.any() and (soft.kd == kd).all() and (soft.kd > 0.0).all()


def test_what_is_within_the_limits_is_left_alone(rng):
    command = Command(target=G1.default_joint_pos + 0.3 * rng.normal(size=29), kp=C.kp, kd=C.kd)
    out = ROBOT.bounded(command)
    for name in ("target", "kp", "kd"):
        np.testing.assert_array_equal(getattr(out, name), getattr(command, name))
    again = ROBOT.bounded(ROBOT.bounded(Command(target=np.full(29, 99.0), kp=np.full(29, 1e6), kd=np.full(29, -5.0))))
    np.testing.assert_array_equal(
        again.target, ROBOT.bounded(Command(target=np.full(29, 99.0), kp=np.full(29, 1e6), kd=np.full(29, -5.0))).target
    )


def test_a_robot_of_which_nobody_said_what_its_servos_stand_is_not_sent_anything(dancer):
    with pytest.raises(TrackingError, match="kp_band"):
        RobotLimits.of(dancer)


@pytest.mark.parametrize("band", ["[-1.0, 2.0]", "[3.0, 2.0]", "[0.1, inf]", "[nan, 1.0]", "[1.0]", "2.0"])
def test_a_band_that_is_none_is_refused_in_the_profile(band, tmp_path):
    text = (G1.profile.folder / "g1.toml").read_text().replace('".*" = [0.2, 10.0]', f'".*" = {band}')
    (tmp_path / "g1.toml").write_text(text)
    tomllib.loads(text)
    with pytest.raises(RobotError):
        read_profile(tmp_path / "g1.toml")


def test_every_joint_goes_to_the_motor_of_its_name_in_any_order(rng):
    values = dict(zip(MOTORS, rng.normal(size=29), strict=True))
    for names in (G1.joint_names, tuple(rng.permutation(G1.joint_names))):
        motor_of, joint_of = motor_order(names)
        ours = np.array([values[n] for n in names])
        np.testing.assert_array_equal(ours[joint_of], list(values.values()))
        np.testing.assert_array_equal(np.array(list(values.values()))[motor_of], ours)


@pytest.mark.parametrize("names", [MOTORS[:-1], (*MOTORS[:-1], MOTORS[0]), (*MOTORS[:-1], "tail_joint"), ()])
def test_joints_that_are_not_the_motors_are_refused(names):
    with pytest.raises(TrackingError, match="29 of a Unitree G1"):
        motor_order(names)
