"""Laws by name, and which of them are the null controllers of every comparison in rooms."""

from rl.goal_laws import (
    AheadPolicy,
    AwayPolicy,
    HeadingPolicy,
    Law,
    ProportionalPolicy,
    RandomPolicy,
)
from rl.seeing_law import SeeingPolicy

LAWS: dict[str, type[Law]] = {
    law.architecture: law
    for law in (
        ProportionalPolicy,
        HeadingPolicy,
        SeeingPolicy,
        RandomPolicy,
        AheadPolicy,
        AwayPolicy,
    )
}
"""Laws by name."""

NULL_LAWS = ("random", "ahead", "away", "heading", "sees")
"""Null controllers, the one list of all comparisons in rooms: noise, full speed ahead, full speed
away from the goal, the law that turns to the goal and sees no obstacle, and the one that sees."""
