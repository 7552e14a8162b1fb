"""How much friction a plan uses, in warnings."""

from __future__ import annotations

from fesd_robot.plans.outcome import ContactOutcome, FrictionUse
from fesd_robot.plans.use_words import use_warnings


def test_a_contact_that_uses_all_of_its_friction_is_named() -> None:
    """One sentence for those that stick so, one for those that land so, with the times; 99.9 % are not all."""
    all_of_it, most = FrictionUse(share=1.0, time=0.25), FrictionUse(share=0.999, time=0.5)
    found = use_warnings(
        {
            "left": ContactOutcome(sticking=all_of_it, landing=most),
            "right": ContactOutcome(sticking=all_of_it, landing=all_of_it),
            "floor": ContactOutcome(sticking=most),
        }
    )
    assert len(found) == 2
    assert found[0].startswith("Each of the contacts 'left' (at 0.25 s), 'right' (at 0.25 s) uses all of its friction")
    assert found[1].startswith("Contact 'right' (at 0.25 s) uses all of its friction where it lands")
