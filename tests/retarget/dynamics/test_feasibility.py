"""Where a motion is hard, in words, and flights: stretches are merged, ordered and told by their worst part."""

import numpy as np
import pytest
from dynamics_by_hand import dynamics_by_hand

from retarget.dynamics.feasibility import flight_fit, hardest_stretches

G, FRAMES = 9.81, 100


def peaks(*places, axis=0, frames=FRAMES):
    """Missing force or moment: (first, end, height) along an axis."""
    out = np.zeros((frames, 3))
    for a, b, height in places:
        out[a:b, axis] = height
    return out


def test_stretches_come_worst_first_and_each_frame_that_is_hard_is_in_one_of_them():
    d = dynamics_by_hand(FRAMES, force=peaks((10, 15, 1.0), (40, 42, 3.0), (70, 90, 2.0)))
    found = hardest_stretches(d)
    assert [h.score for h in found] == pytest.approx([3.0, 2.0, 1.0])
    covered = np.zeros(FRAMES, dtype=bool)
    for h in found:
        covered[round(h.start_s * d.fps) : round(h.end_s * d.fps) + 1] = True
    np.testing.assert_array_equal(covered, d.score > 0.5)
    assert hardest_stretches(d, most=2) == found[:2] and hardest_stretches(d, above=2.5) == found[:1]
    assert not hardest_stretches(dynamics_by_hand(FRAMES))


@pytest.mark.parametrize(("gap", "count"), [(4, 1), (5, 2)])
def test_stretches_nearer_than_the_gap_are_one(gap, count):
    d = dynamics_by_hand(FRAMES, force=peaks((20, 25, 1.0), (25 + gap, 40, 2.0)))
    assert len(hardest_stretches(d, gap_s=0.1)) == count  # 5 frames
    assert len(hardest_stretches(d, gap_s=0.0)) == 2


@pytest.mark.parametrize("factor", [2, 4])
def test_the_same_motion_at_a_finer_rate_is_hard_at_the_same_times(factor):
    force = peaks((20, 30, 1.5), (60, 61, 2.0))
    coarse = hardest_stretches(dynamics_by_hand(FRAMES, force=force))
    fine = hardest_stretches(dynamics_by_hand(factor * FRAMES, factor * 50.0, force=np.repeat(force, factor, axis=0)))
    for a, b in zip(coarse, fine, strict=True):
        assert (a.score, a.cause) == (b.score, b.cause)
        assert a.start_s == pytest.approx(b.start_s) and abs(a.end_s - b.end_s) < 0.02  # a frame of the coarse one


@pytest.mark.parametrize(
    ("axis", "height", "said"),
    [(2, 2.0, "mostly upwards"), (2, -2.0, "mostly downwards"), (1, 2.0, "mostly horizontally")],
)
def test_missing_force_is_told_with_its_direction_and_size(axis, height, said):
    (worst,) = hardest_stretches(dynamics_by_hand(FRAMES, force=peaks((10, 20, height), axis=axis)))
    assert worst.cause == "force" and said in worst.text
    assert "0.50 of the weight" in worst.text  # two gates of a quarter


@pytest.mark.parametrize(("axis", "said"), [(2, "turning about the vertical"), (0, "tipping")])
def test_missing_moment_is_told_with_its_axis_and_arm(axis, said):
    (worst,) = hardest_stretches(dynamics_by_hand(FRAMES, moment=peaks((10, 20, 1.5), axis=axis)))
    assert worst.cause == "moment" and said in worst.text and "times 15 cm" in worst.text


def test_the_cause_is_the_part_that_makes_the_score():
    effort = np.zeros(FRAMES)
    effort[30:35] = 4.0
    d = dynamics_by_hand(FRAMES, force=peaks((30, 35, 3.0)), moment=peaks((30, 35, 2.0)), effort=effort)
    (worst,) = hardest_stretches(d)
    assert (worst.cause, worst.score) == ("effort", pytest.approx(4.0)) and "knee needs 2.00" in worst.text
    for parts in d.parts.values():
        assert (parts <= d.score).all()
    assert str(worst).startswith("0.60 to 0.68 s (score 4.0)")


def test_the_frame_that_is_named_is_the_worst_and_tells_what_touches_there():
    in_contact = np.ones(FRAMES, dtype=bool)
    in_contact[52:] = False
    force = peaks((50, 55, 1.0))
    for t, said in ((51, "8 of 8 points touching"), (53, "nothing touching the floor")):
        one = force.copy()
        one[t] *= 3.0
        (worst,) = hardest_stretches(dynamics_by_hand(FRAMES, force=one, in_contact=in_contact))
        assert f"at {t / 50.0:.2f} s" in worst.text and said in worst.text


def flying(frames=20, fps=50.0, gravity=G, drift=0.0):
    """A centre of mass that is thrown for so many frames between two stands at heights that differ by `drift`."""
    in_contact = np.ones(frames + 20, dtype=bool)
    in_contact[10 : 10 + frames] = False
    t = np.clip((np.arange(frames + 20) - 9) / fps, 0.0, (frames + 1) / fps)
    z = 0.9 + 0.5 * gravity * t * (t.max() - t) + drift * t / t.max()
    lift = np.where(in_contact, 1.0, 1.0 - gravity / G)
    return dynamics_by_hand(frames + 20, fps, in_contact=in_contact, com_z=z, lift=lift)


@pytest.mark.parametrize("drift", [0.0, 0.2, -0.3])
@pytest.mark.parametrize("fps", [50.0, 100.0])
def test_a_thrown_body_rises_as_its_time_says_at_any_rate_and_between_any_heights(fps, drift):
    (flight,) = flight_fit(flying(19, fps, drift=drift))  # 20 steps, so that the middle is a frame
    assert flight.end_s - flight.start_s == pytest.approx(20.0 / fps)
    assert flight.rise == pytest.approx(flight.ballistic_rise) == pytest.approx(G * (20.0 / fps) ** 2 / 8.0)
    assert flight.off_gravity == pytest.approx(0.0, abs=1e-12)


def test_half_of_gravity_is_half_of_the_rise_and_half_off():
    (flight,) = flight_fit(flying(19, gravity=0.5 * G))
    assert flight.rise == pytest.approx(0.5 * flight.ballistic_rise) and flight.off_gravity == pytest.approx(0.5 * G)


@pytest.mark.parametrize(("frames", "count"), [(5, 0), (6, 1)])
def test_flights_shorter_than_asked_are_left_out(frames, count):
    assert len(flight_fit(flying(frames), longer_than_s=0.1)) == count


def test_a_flight_at_either_end_of_the_clip_ends_with_it():
    in_contact = np.ones(40, dtype=bool)
    in_contact[:10] = in_contact[30:] = False
    first, last = flight_fit(dynamics_by_hand(40, in_contact=in_contact))
    assert (first.start_s, first.end_s) == (0.0, 0.2) and (last.start_s, last.end_s) == (29 / 50.0, 39 / 50.0)
