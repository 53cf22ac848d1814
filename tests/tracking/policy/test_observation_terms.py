"""One definition of each observation term: whatever computes, exports or reads one agrees with it."""

import numpy as np
import pytest

from tracking.policy.observation_terms import KIND_OF, TERMS, row_of
from tracking.policy.policy_export import _THEIRS
from tracking.policy.runner import MEASURES


def test_the_runner_computes_every_term_that_an_actor_may_see_and_no_other():
    only_simulated = {"body_pos", "phase", "height_error"}  # of critics and teachers
    of_teachers = {"reference_body_pos", "reference_anchor_vel", "reference_anchor_height"}
    assert set(MEASURES) == set(TERMS) - only_simulated - of_teachers
    assert all(not TERMS[kind].measurable for kind in only_simulated)


@pytest.mark.parametrize("kind", TERMS)
def test_a_row_is_what_the_definition_says(kind):
    term, row = TERMS[kind], row_of(kind, 29, at=-1, bodies=14, scale=0.5, noise=0.1)
    assert (row.kind, row.unit, row.frame, row.measurable) == (kind, term.unit, term.frame, term.measurable)
    assert row.size == term.size + 29 * term.per_joint + 14 * term.per_body > 0
    assert (row.at, row.scale, row.noise) == (-1, 0.5, 0.1)
    assert term.meaning


def test_a_name_of_the_field_means_one_term():
    names = [alias for term in TERMS.values() for alias in term.aliases]
    assert len(names) == len(set(names)) == len(KIND_OF)
    assert set(_THEIRS) <= set(KIND_OF)  # what BeyondMimic's deployers give is known here


def test_sizes_grow_with_joints_as_they_say():
    for kind, term in TERMS.items():
        few, many = row_of(kind, 10).size, row_of(kind, 11).size
        assert many - few == term.per_joint, kind
        assert np.sign(term.per_joint) + np.sign(term.size) + np.sign(term.per_body) == 1, kind
