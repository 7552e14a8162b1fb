"""A branch: the active factor of every condition in every element, read by contact."""

from __future__ import annotations

import pytest

from fesd_robot.complementarity import ActiveFactor, Branch, Label
from fesd_robot.errors import DimensionError, ModelError

CONDITIONS = (
    Label("force at a distance", contact="left foot"),
    Label("lambda _|_ theta", "R1"),
    Label("force at a distance", contact="right foot"),
    Label("sliding", "forwards", "left foot"),
    Label("sliding", "backwards", "left foot"),
)
FACTORS = (
    (ActiveFactor.H, ActiveFactor.G, ActiveFactor.G, ActiveFactor.H, ActiveFactor.H),
    (ActiveFactor.G, ActiveFactor.H, ActiveFactor.COMPLEMENT, ActiveFactor.H, ActiveFactor.G),
)
BRANCH = Branch(CONDITIONS, FACTORS, (False, True))


def test_contacts_are_in_the_order_of_their_conditions() -> None:
    """Every contact once; conditions of none are left out."""
    assert BRANCH.contacts == ("left foot", "right foot")


def test_the_conditions_of_a_contact() -> None:
    """A contact's conditions in an element by kind and subject; a contact without conditions has none."""
    assert BRANCH.of_contact(0, "left foot") == {
        ("force at a distance", ""): ActiveFactor.H,
        ("sliding", "forwards"): ActiveFactor.H,
        ("sliding", "backwards"): ActiveFactor.H,
    }
    assert BRANCH.of_contact(1, "left foot")["sliding", "backwards"] is ActiveFactor.G
    assert BRANCH.of_contact(1, "right foot") == {("force at a distance", ""): ActiveFactor.COMPLEMENT}
    assert BRANCH.of_contact(0, "hand") == {}


def test_a_problem_without_elements_is_one_element() -> None:
    """The branch of pairs alone has one element, which has a length."""
    branch = Branch.of_pairs(CONDITIONS[1:2], [ActiveFactor.G])
    assert branch == Branch((CONDITIONS[1],), ((ActiveFactor.G,),), (False,))
    assert branch.contacts == () and branch == Branch.of_pairs(list(CONDITIONS[1:2]), (ActiveFactor.G,))


def test_a_branch_fits_together() -> None:
    """Every element has a length or none, and one factor a condition."""
    with pytest.raises(DimensionError, match=r"without_length has shape \(1,\), expected \(2,\)"):
        Branch(CONDITIONS, FACTORS, (False,))
    with pytest.raises(DimensionError, match="element 1 has 2 factors for 5 conditions"):
        Branch(CONDITIONS, (FACTORS[0], FACTORS[1][:2]), (False, True))


def test_pairs_without_elements_have_no_modes() -> None:
    """Where a condition of a contact stands twice, as among all pairs of a problem, no mode can be read."""
    branch = Branch.of_pairs([CONDITIONS[0], CONDITIONS[0]], [ActiveFactor.G, ActiveFactor.H])
    with pytest.raises(ModelError, match="stands twice in element 0, expected the branch of elements"):
        branch.of_contact(0, "left foot")
