"""Fields of settings that had another name in older versions, and their names now."""

from collections.abc import Iterable, Mapping

RENAMED_FIELDS: Mapping[str, Mapping[str, str]] = {
    "": {
        "rig": "simulated_robot",
        "judge": "terminations",
        "look_every": "perception_decimation",
        "local_map": "local_planner",
        "final_pace": "final_lr_scale",
        "smoothing": "tau",
        "entropy": "target_entropy",
        "averaging": "ema_rate",
        "steps_per_decision": "updates_per_step",
        "minibatch": "batch_size",
        "batch": "episodes_per_iteration",
        "capacity": "buffer_size",
        "discount": "gamma",
        "trust": "clip_range",
        "largest_difference": "max_td_error",
        "hold": "action_repeat",
    },
    "sensing": {"site": "geo_reference"},
    "compass": {"iron": "hard_iron"},
    "gnss": {
        "detour": "multipath_rate",
        "detour_shift": "multipath_error",
        "detour_time": "multipath_time",
        "shade": "canopy_factor",
        "shade_range": "canopy_range",
        "vertical": "vertical_ratio",
        "wander": "correlated_error",
        "wander_time": "correlation_time",
    },
    "filter": {
        "start": "initial_sigma",
        "rough_start": "rough_initial_sigma",
        "vertical": "vertical_ratio",
        "memory": "max_delay",
        "overtaking": "max_lead",
        "imu_silence": "imu_timeout",
        "wheel_silence": "wheel_timeout",
        "compass_silence": "compass_timeout",
        "fix_silence": "gnss_timeout",
        "doubt": "inflation_time",
        "steady_doubt": "multipath_inflation_time",
        "steady": "multipath_spread",
        "detour": "multipath_offset",
    },
    "local_planner": {
        "bumps": "low_obstacles",
        "squares": "ground",
        "cells": "occupancy.cells",
        "cell": "occupancy.cell",
        "mark_every": "occupancy.update_every",
        "surely_red": "occupancy.certain_blocked",
        "surely_green": "occupancy.certain_free",
        "blocked": "occupancy.blocked_gain",
        "free": "occupancy.free_gain",
        "void": "occupancy.unknown_gain",
        "void_reach": "occupancy.unknown_range",
        "red_reach": "occupancy.blocked_range",
        "fade": "occupancy.range_scale",
        "certain": "occupancy.max_log_odds",
        "trail": "occupancy.driven_memory",
        "wall": "occupancy.lethal_log_odds",
        "plan_every": "replan_every",
        "unseen": "costs.unknown_cost",
        "doubt": "costs.uncertain_cost",
        "sure": "costs.lethal_cost",
        "room": "costs.inscribed_radius",
        "shy": "costs.inflation_radius",
        "tight": "costs.inscribed_cost",
        "crowd": "costs.inflation_cost",
        "near": "min_lookahead",
        "reach": "max_lookahead",
    },
    "ground": {"most": "max_log_odds", "miss": "miss_cost", "near": "near_range"},
    "low_obstacles": {
        "nearest": "min_range",
        "reach": "max_range",
        "most": "max_height",
        "enough": "min_points",
        "memory": "max_points",
        "rise": "min_height",
        "roughness": "roughness_factor",
        "doubt": "free_log_odds",
        "keep": "decay",
    },
    "rollouts": {
        "leg_time": "arc_time",
        "legs": "arcs",
        "patience": "no_progress_time",
        "squeeze": "clearance_relaxation",
        "crowd": "cost_share",
        "hold": "action_repeat",
        "pause": "stop_cost",
        "trust": "override_margin",
        "haste": "max_speed_scale",
        "close": "full_speed_clearance",
    },
}
"""New names by the old ones, in groups named by the last part of the path before the field.

The group "" holds names that are the same in every group.
"""


def new_name(path: Iterable[str]) -> str | None:
    """Return the name that a field of an older version has now, or None if it was never renamed.

    Args:
        path: Parts of the field's dotted path.

    Returns:
        The whole dotted path with all old words replaced.
    """
    found: list[str] = []
    renamed = False
    for part in path:
        # A new name of several parts, such as "costs.lethal_cost", ends with the field itself.
        group = found[-1].rpartition(".")[2] if found else ""
        new = RENAMED_FIELDS.get(group, {}).get(part) or RENAMED_FIELDS[""].get(part)
        renamed |= new is not None
        found.append(new or part)
    return ".".join(found) if renamed else None
