"""Settings: the defaults are consistent, and numbers that cannot be are refused by name."""

import dataclasses
import math

import pytest

from retarget import ContactConfig, Gates, IkConfig, ObjectiveWeights, RetargetConfig, RetargetError, WholeClipConfig
from retarget.config import FeetConfig, JumpConfig, SequenceConfig
from retarget.rules import DynamicsConfig

FLOATS = [f.name for f in dataclasses.fields(RetargetConfig) if isinstance(getattr(RetargetConfig(), f.name), float)]


@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf, 1e7])
@pytest.mark.parametrize("name", FLOATS)
def test_numbers_that_cannot_be_are_refused_by_name(name, value):
    with pytest.raises(RetargetError, match=f"setting {name}"):
        RetargetConfig(**{name: value})


@pytest.mark.parametrize("fps", [0.0, 4.9, 4])
def test_a_rate_that_no_dance_survives_is_refused(fps):
    with pytest.raises(RetargetError, match="at least 5 frames per second"):
        RetargetConfig(fps=fps)


def test_no_time_at_all_is_allowed_for_leads_and_stands():
    config = RetargetConfig(lead_in_s=0.0, lead_out_s=0.0, stand_s=0.0)
    assert (config.lead_in_s, config.lead_out_s, config.stand_s) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("name", ["lead_in_s", "stand_s", "reach"])
def test_whole_numbers_that_cannot_be_are_refused_as_well(name):
    with pytest.raises(RetargetError, match=f"setting {name}"):
        RetargetConfig(**{name: -3})


@pytest.mark.parametrize("kind", [ContactConfig, ObjectiveWeights, WholeClipConfig, IkConfig, Gates, RetargetConfig])
def test_settings_cannot_be_changed_once_made(kind):
    config = kind()
    for f in dataclasses.fields(config):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(config, f.name, 0.0)


def test_the_loose_thresholds_of_touching_are_no_tighter_than_the_tight_ones():
    config = ContactConfig()
    assert config.tight_speed <= config.loose_speed and config.tight_height <= config.loose_height


def test_what_touches_is_held_more_firmly_than_what_turns_on_purpose_and_that_than_what_swings():
    w = ObjectiveWeights()
    assert w.planted > w.pivot > w.swing and w.planted_roll > w.swing_roll
    assert w.pin > max(w.free_joint, w.posture)  # a key frame is a statement, a posture a wish


def test_what_the_solvers_keep_is_within_what_the_gates_ask():
    """A margin for rounding, or the gates would fail on what the limits just allow."""
    gates, whole, ik = Gates(), WholeClipConfig(), IkConfig()
    assert whole.speed_share < gates.speed_share and ik.speed_share < gates.speed_share
    assert whole.acceleration_share < gates.acceleration_share
    assert whole.limit_margin > gates.joint_limit_rad and ik.limit_margin > gates.joint_limit_rad


def test_grids_go_from_coarse_to_fine_and_the_last_is_the_clips_own():
    config = WholeClipConfig()
    widths = [stage.step_s for stage in (config.coarse, *config.fine)]
    assert widths == sorted(widths, reverse=True) and widths[-1] == 0.0
    assert config.overlap_s < config.window_s
    assert config.fine[-1].clearance and config.fine[-1].more_iterations > 0


@pytest.mark.parametrize(
    "group", [ContactConfig, FeetConfig, JumpConfig, WholeClipConfig, Gates, DynamicsConfig, SequenceConfig]
)
def test_every_group_of_settings_refuses_by_itself_what_no_number_of_it_can_be(group):
    for field in dataclasses.fields(group):
        value = getattr(group(), field.name)
        if isinstance(value, int | float) and not isinstance(value, bool):
            for bad in (-1, 10_000_000) if isinstance(value, int) else (-1.0, float("nan"), 1e7):
                with pytest.raises(RetargetError, match=f"setting {field.name}"):
                    group(**{field.name: bad})
        elif isinstance(value, tuple) and value and isinstance(value[0], float):
            with pytest.raises(RetargetError, match=f"setting {field.name}"):
                group(**{field.name: (-1.0, *value[1:])})
