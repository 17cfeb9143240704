"""Contents of a world in numbers and in words."""

from collections import Counter
from typing import Any

import numpy as np

from worlds.traversability_map import Reason
from worlds.world import World


def world_summary(world: World) -> dict[str, Any]:
    """Return size, objects, shares of forbidden ground and tasks of a world, ready for JSON."""
    counts = Counter(each.semantic.name.lower() for each in world.objects)
    kinds = Counter(each.kind for each in world.movers if each.behaviour is not None)
    return {
        "name": world.name,
        "seed": world.seed,
        "difficulty": world.difficulty,
        "width_m": world.ground.width,
        "depth_m": world.ground.depth,
        "relief_m": float(np.ptp(world.ground.heights)),
        "datum": None
        if world.datum is None
        else {
            "latitude_deg": world.datum.latitude_deg,
            "longitude_deg": world.datum.longitude_deg,
            "altitude_m": world.datum.altitude,
        },
        "objects": dict(counts),
        "walkers": len(world.movers),
        "walkers_by_kind": dict(kinds),
        "share_of_ground": {
            reason.name.lower(): float((world.truth.reason == reason).mean()) for reason in Reason
        },
        "tasks": len(world.tasks),
        "goals_per_task": len(world.tasks[0].goals) if world.tasks else 0,
    }


def world_text(data: dict[str, Any]) -> str:
    """Return a summary as text, objects by decreasing number."""
    counts, shares = Counter(data["objects"]).most_common(), data["share_of_ground"].items()
    kinds = ", ".join(f"{count} {kind}" for kind, count in data["walkers_by_kind"].items())
    of_kind = f" ({kinds})" if kinds else ""
    walkers = [f"walkers: {data['walkers']}{of_kind}"] if data["walkers"] else []
    place = [datum_text(data["datum"])] if data["datum"] else []
    return "\n".join(
        [
            f"{data['name']}, seed {data['seed']}: {data['width_m']:.0f} x {data['depth_m']:.0f} m,"
            f" relief {data['relief_m']:.1f} m, difficulty {data['difficulty']}",
            *place,
            "objects: " + ", ".join(f"{count} {kind}" for kind, count in counts),
            *walkers,
            "ground: " + ", ".join(f"{share:.1%} {kind}" for kind, share in shares),
            f"tasks: {data['tasks']} with {data['goals_per_task']} goals in a row",
        ]
    )


def size_text(data: dict[str, Any]) -> str:
    """Return size and contents of a summary in one line."""
    return (
        f"world of {data['width_m']:.1f} x {data['depth_m']:.1f} m, relief "
        f"{data['relief_m']:.1f} m, {sum(data['objects'].values())} objects, {data['tasks']} tasks"
    )


def datum_text(datum: dict[str, float]) -> str:
    """Return where the middle of a world is on Earth, in one line."""
    return (
        f"its middle is at latitude {datum['latitude_deg']:.6f}, longitude "
        f"{datum['longitude_deg']:.6f}, altitude {datum['altitude_m']:.2f} m"
    )
