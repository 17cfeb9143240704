"""Contents of a world in numbers and in words."""

from collections import Counter
from typing import Any

import numpy as np

from worlds.traversability_map import Reason
from worlds.world import World


def world_summary(world: World) -> dict[str, Any]:
    """Return size, objects, shares of forbidden ground and tasks of a world, ready for JSON."""
    counts = Counter(each.semantic.name.lower() for each in world.objects)
    return {
        "name": world.name,
        "seed": world.seed,
        "difficulty": world.difficulty,
        "width_m": world.ground.width,
        "depth_m": world.ground.depth,
        "relief_m": float(np.ptp(world.ground.heights)),
        "objects": dict(counts),
        "walkers": len(world.movers),
        "share_of_ground": {
            reason.name.lower(): float((world.truth.reason == reason).mean()) for reason in Reason
        },
        "tasks": len(world.tasks),
        "goals_per_task": len(world.tasks[0].goals) if world.tasks else 0,
    }


def world_text(data: dict[str, Any]) -> str:
    """Return a summary as text, objects by decreasing number."""
    counts, shares = Counter(data["objects"]).most_common(), data["share_of_ground"].items()
    walkers = [f"walkers: {data['walkers']}"] if data["walkers"] else []
    return "\n".join(
        [
            f"{data['name']}, seed {data['seed']}: {data['width_m']:.0f} x {data['depth_m']:.0f} m,"
            f" relief {data['relief_m']:.1f} m, difficulty {data['difficulty']}",
            "objects: " + ", ".join(f"{count} {kind}" for kind, count in counts),
            *walkers,
            "ground: " + ", ".join(f"{share:.1%} {kind}" for kind, share in shares),
            f"tasks: {data['tasks']} with {data['goals_per_task']} goals in a row",
        ]
    )
