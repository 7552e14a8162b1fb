"""What the first line of every shipped task says, as numbers that a plan is held against."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product

from fesd_robot.plans import Plan
from fesd_robot.plans.outcome import ContactOutcome

REST = 0.0101
"""m/s or rad/s: slower is at rest, and m or rad: nearer is at the goal."""

LOWEST_FLIGHT = 5e-3
"""m; what stays lower is no flight that anyone would see."""


INSTANT = 1e-6
"""s; what is shorter is no time."""


@dataclass(frozen=True)
class ContactClaim:
    """What one contact does.

    Attributes:
        flights: fewest and most flights higher than `LOWEST_FLIGHT`.
        longest: the longest flight is at least so long, m.
        highest: some flight is at least so high, m.
        slides: fewest and most metres that it slips in all.
    """

    flights: tuple[int, int] = (0, 0)
    longest: float = 0.0
    highest: float = 0.0
    slides: tuple[float, float] = (0.0, 1e-3)

    def broken(self, name: str, contact: ContactOutcome) -> Iterator[str]:
        """Yield what a contact does otherwise."""
        flights = [flight for flight in contact.flights if flight.height > LOWEST_FLIGHT]
        fewest, most = self.flights
        if not fewest <= len(flights) <= most:
            yield f"{name} flies {len(flights)} times"
        if max((flight.length for flight in flights), default=0.0) < self.longest:
            yield f"no flight of {name} is {self.longest:g} m long"
        if max((flight.height for flight in flights), default=0.0) < self.highest:
            yield f"no flight of {name} is {self.highest:g} m high"
        if not self.slides[0] <= contact.slide_distance <= self.slides[1]:
            yield f"{name} slips {contact.slide_distance:.3g} m"


@dataclass(frozen=True)
class Claim:
    """What one task says.

    Attributes:
        contacts: name -> what it does; those not listed may do what they like.
        reaches_goal: whether it ends at its goal, and at rest there.
        carried: whether one of these contacts touches at any time.
        airborne: so long all of these contacts fly at once, s.
        in_order: contacts that come down first one after the other.
    """

    contacts: Mapping[str, ContactClaim] = field(default_factory=dict)
    reaches_goal: bool = True
    carried: bool = False
    airborne: float = 0.0
    in_order: tuple[str, ...] = ()

    def broken(self, plan: Plan) -> list[str]:
        """Return in which ways a plan does not do what its task says."""
        assert plan.outcome is not None
        found = [] if plan.status.solved else ["it is not solved"]
        for name, claim in self.contacts.items():
            found += claim.broken(name, plan.outcome.contacts[name])
        flying = list(_in_the_air([plan.outcome.contacts[name] for name in self.contacts]))
        if self.carried and flying:
            found.append(f"nothing touches at {sum(flying[0]) / 2:.3g} s")
        if (time := max((end - start for start, end in flying), default=0.0)) < self.airborne:
            found.append(f"it is in the air for {time:.3g} s, not for {self.airborne:g} s")
        down = [_first_landing(plan.outcome.contacts[name]) for name in self.in_order]
        if down != sorted(set(down)):
            found.append(f"{', '.join(self.in_order)} come down at {', '.join(f'{time:.3g} s' for time in down)}")
        missed = [entry.name for entry in plan.outcome.goal if not entry.missed_by <= REST]
        return found + ([f"it misses {', '.join(missed)}"] if self.reaches_goal and missed else [])


def _first_landing(contact: ContactOutcome) -> float:
    """Return when a contact comes down first after a flight that is seen, s."""
    return min((one.end for one in contact.flights if one.height > LOWEST_FLIGHT and not one.open_end), default=INSTANT)


def _in_the_air(contacts: Sequence[ContactOutcome]) -> Iterator[tuple[float, float]]:
    """Yield from when to when all contacts fly so high that it is seen, s."""
    flights = [
        [(flight.start, flight.end) for flight in contact.flights if flight.height > LOWEST_FLIGHT]
        for contact in contacts
    ]
    for chosen in product(*flights) if flights else ():
        start, end = max(first for first, _ in chosen), min(last for _, last in chosen)
        if end - start > INSTANT:
            yield start, end


FREE = (0.0, float("inf"))
"""Slips as far as it likes."""

FEET = ("FL", "FR", "HL", "HR")

CLAIMS: dict[str, Claim] = {
    "arm_push": Claim(
        {
            "tip": ContactClaim((2, 2), slides=(0.0, 0.05)),
            "floor_1": ContactClaim((0, 1), slides=FREE),  # the push may lift the rear corner a little
            "floor_2": ContactClaim(slides=(0.19, 0.21)),
        }
    ),
    "ball_bat": Claim({"hit": ContactClaim((2, 2), longest=0.9, highest=0.3)}),
    "biped_step": Claim({"left": ContactClaim(), "right": ContactClaim((1, 1), longest=0.45)}),
    "biped_walk": Claim(  # the next step may have begun at the end: left and right change places
        {"left": ContactClaim((0, 1)), "right": ContactClaim((1, 1), longest=0.5, highest=0.025)}, carried=True
    ),
    "block_push": Claim({name: ContactClaim(slides=(0.79, 0.81)) for name in ("rear", "front")}),
    "block_slope": Claim({name: ContactClaim() for name in ("rear", "front")}),
    "cart_pole_friction": Claim({"runner": ContactClaim(slides=FREE)}),
    "double_pendulum_wall": Claim({"tip": ContactClaim((1, 3), highest=0.9, slides=(0.0, 0.05))}),
    "go2_jump": Claim(
        {name: ContactClaim((1, 2), longest=0.3, highest=0.05) for name in ("FL", "FR", "RL", "RR")}, airborne=0.1
    ),
    "gripper_lift": Claim(
        {
            **{name: ContactClaim((0, 1)) for name in ("left", "right")},  # one on the way to the box
            **{name: ContactClaim((1, 1), highest=0.19) for name in ("floor_1", "floor_2")},
        }
    ),
    "hopper_downhill": Claim({"foot": ContactClaim((1, 2), longest=0.7)}),  # it may pull its foot up first
    "hopper_five_jumps": Claim(  # the first flight may be a step in place
        {"foot": ContactClaim((5, 6), longest=0.9, highest=0.3)}
    ),
    "hopper_in_space": Claim(  # it may pull its foot up at the start, to fall into a crouch
        {"foot": ContactClaim((1, 2), longest=0.65, highest=0.5)}, airborne=0.4
    ),
    "hopper_one_jump": Claim(  # it may pull its foot up at the start, to fall into a crouch
        {"foot": ContactClaim((1, 2), longest=0.8, highest=0.3)}
    ),
    "hopper_stairs": Claim({"foot": ContactClaim((2, 6), longest=0.3)}),
    "hopper_wedge": Claim({"foot": ContactClaim((1, 2), longest=0.7)}),  # it may pull its foot up first
    "monoped_three_holes": Claim({"foot": ContactClaim((3, 4), longest=0.9)}),
    "monoped_two_jumps": Claim({"foot": ContactClaim((2, 12), longest=0.3, highest=0.15)}),
    "pick_and_place": Claim(
        {
            **{name: ContactClaim() for name in ("left", "right")},
            "floor": ContactClaim((1, 1), longest=0.35, highest=0.13),
        }
    ),
    "published_hopper_five_jumps": Claim({"foot": ContactClaim((1, 20), slides=FREE)}, reaches_goal=False),
    "published_hopper_one_jump": Claim({"foot": ContactClaim((1, 20), slides=FREE)}, reaches_goal=False),
    "puck_shot": Claim({"sole": ContactClaim(slides=(0.78, 0.82)), "push": ContactClaim((2, 2))}),
    "pusher_slider": Claim({"sole": ContactClaim(slides=(0.39, 0.41)), "push": ContactClaim((2, 2))}),
    "solo12_bound": Claim(
        {name: ContactClaim((1, 2), longest=0.05, highest=0.015) for name in ("front", "hind")},
        in_order=("hind", "front"),
    ),
    "solo12_jump": Claim(  # it may lift one pair of feet at the start, to fall into a crouch
        {name: ContactClaim((1, 2), longest=0.25, highest=0.05) for name in ("front", "hind")}, airborne=0.15
    ),
    "solo12_jump_in_space": Claim(
        {name: ContactClaim((1, 1), longest=0.25, highest=0.05) for name in FEET}, airborne=0.15
    ),
    "solo12_onto_box": Claim(
        {
            **{name: ContactClaim((1, 4), longest=0.2, highest=0.05) for name in ("FL", "FR")},
            **{name: ContactClaim((1, 2), longest=0.4, highest=0.1) for name in ("HL", "HR")},
        }
    ),
    "solo12_sideways": Claim({name: ContactClaim((1, 1), longest=0.15, highest=0.03) for name in FEET}, airborne=0.1),
    "solo12_turn": Claim({name: ContactClaim((1, 1), longest=0.15, highest=0.05) for name in FEET}, airborne=0.1),
    "solo12_two_steps": Claim({name: ContactClaim((1, 1), longest=0.08, highest=0.02) for name in FEET}, carried=True),
    "table_push": Claim(
        {
            **{name: ContactClaim(slides=(0.09, 0.11)) for name in ("rear_left", "rear_right", "front")},
            "tip": ContactClaim((0, 1), slides=(0.0, 0.05)),
        }
    ),
    "wheel_hills": Claim({"rim": ContactClaim(slides=(0.0, 0.01))}),
}
"""Name of a task -> what it says."""
