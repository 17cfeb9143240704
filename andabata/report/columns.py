"""Words and units of columns: raw keys of results as people read them, on pages and consoles.

A row of a result has raw keys such as ``wilson_low`` or ``trespass_m``. Here each has a heading in
words with its unit, a form of its numbers, and, where it is the end of an interval, its place in
the cell of the figure that it bounds: ``0.83 [0.70, 0.92]``.
"""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

Row = Mapping[str, Any]

NONE = "–"
"""Text of a cell without a value."""


class Column(NamedTuple):
    """Words, unit and form of a column.

    Attributes:
        words: Heading without the unit.
        unit: Unit, empty for none.
        form: Format of its floating-point numbers.
        scale: Factor from the raw number to the shown one, such as 100 for per cent.
    """

    words: str
    unit: str = ""
    form: str = ".2f"
    scale: float = 1.0

    @property
    def heading(self) -> str:
        """Heading with the unit in brackets."""
        return f"{self.words} [{self.unit}]" if self.unit else self.words


HITS = ("hit_mover", "hit_by_mover", "hit_at_rest")
"""Keys of the collisions with movers, by who drove into whom; rows of rooms and off-road."""

_SHARE = ("%", ".1f", 100.0)
_STEPS = ("", ".0f")

COLUMNS: Mapping[str, Column] = {
    "controller": Column("controller"),
    "world": Column("world"),
    "world_seed": Column("seed of the world"),
    "goal": Column("goal"),
    "goals": Column("goals"),
    "trial": Column("trial"),
    "trials": Column("drives"),
    "runs": Column("drives"),
    "worlds": Column("worlds"),
    "successes": Column("reached"),
    "successes_against": Column("reached by the other"),
    "collisions": Column("collisions"),
    "hit_mover": Column("drove into a mover"),
    "hit_by_mover": Column("hit by a mover while driving"),
    "hit_at_rest": Column("hit by a mover while standing"),
    "tipovers": Column("tipped over"),
    "timeouts": Column("out of time"),
    "stuck": Column("stuck"),
    "false_arrivals": Column("false arrivals"),
    "left_world": Column("left the world"),
    "strict_successes": Column("strictly reached"),
    "strict": Column("strict success"),
    "strict_failure": Column("strict failure"),
    "outline_forbidden_s": Column("outline on forbidden ground", "s", ".1f"),
    "solid_distance_m": Column("least distance to solids", "m"),
    "arrival_error_m": Column("true distance at arrival", "m"),
    "position_error_m": Column("error of the estimate", "m"),
    "fault": Column("fault"),
    "faulty": Column("drives beyond the onset"),
    "flagged": Column("flagged"),
    "flagged_within_2_s": Column("flagged within 2 s"),
    "flagged_after_s": Column("flagged after", "s", ".1f"),
    "contacts": Column("contacts"),
    "contacts_after_flag": Column("contacts after the flag"),
    "bad_commands": Column("commands out of range"),
    "never_left": Column("never left the start"),
    "success_rate": Column("success"),
    "success_rate_against": Column("success of the other"),
    "wilson_low": Column("success, lower bound"),
    "wilson_high": Column("success, upper bound"),
    "success_low": Column("success, lower bound"),
    "success_high": Column("success, upper bound"),
    "spl": Column("SPL"),
    "trespass_m": Column("on forbidden ground", "m", ".1f"),
    "trespass_share": Column("way on forbidden ground", *_SHARE),
    "overridden_share": Column("decisions overridden", *_SHARE),
    "distance_m": Column("driven", "m", ".1f"),
    "shortest_m": Column("shortest safe way", "m", ".1f"),
    "steering_variation": Column("restlessness of steering", "rad²/s"),
    "restlessness": Column("restlessness of steering", "rad²/s"),
    "energy_j": Column("energy of the motors", "kJ", ".1f", 0.001),
    "min_clearance_m": Column("least clearance", "m"),
    "mean_time_s": Column("mean time", "s", ".1f"),
    "time_s": Column("time", "s", ".1f"),
    "left_m": Column("left to the goal", "m", ".1f"),
    "speed_m_s": Column("speed at the end", "m/s"),
    "outcome": Column("end"),
    "failure": Column("end"),
    "cause": Column("cause"),
    "contact": Column("contact"),
    "count": Column("times"),
    "difficulty": Column("difficulty"),
    "score": Column("score", form=".3f"),
    "ot_over_t": Column("optimal time / time", form=".3f"),
    "success": Column("success", form=".3f"),
    "against": Column("against"),
    "difference": Column("difference in success", "points", "+.1f", 100.0),
    "mcnemar_gained": Column("won alone"),
    "mcnemar_lost": Column("lost alone"),
    "mcnemar_p": Column("p (McNemar)", form=".2g"),
    "spl_difference": Column("difference in SPL", form="+.3f"),
    "both": Column("finished by both"),
    "time_difference_s": Column("difference in time", "s", "+.1f"),
    "policy": Column("policy"),
    "lidar": Column("laser"),
    "room": Column("room"),
    "memory": Column("heads for"),
    "movers": Column("movers"),
    "tasks": Column("tasks"),
    "steps_to_oracle": Column("steps / oracle's"),
    "mean_steps": Column("mean steps", *_STEPS),
    "change": Column("change"),
    "value": Column("value", form="g"),
    "text": Column("laser"),
    "run": Column("run"),
    "stage": Column("stage"),
    "test": Column("drive"),
    "episodes": Column("episodes"),
    "most_circling": Column("most circling", *_SHARE),
    "validation": Column("validation"),
    "actor": Column("actor"),
    "seeds": Column("seeds"),
    "seed": Column("seed"),
    "best_score_hardest_room": Column("best score, hardest room", form=".3f"),
    "paper_score_env3": Column("paper, Env3", form=".3f"),
    "best_score": Column("best score", form=".3f"),
    "paper_score_env0_3": Column("paper, Env0 to Env3", form=".3f"),
    "seeds_with_all_tasks": Column("seeds that reached all goals"),
    "last_reached": Column("goals of the last tests", form=".1f"),
    "best_steps_to_oracle": Column("best steps / oracle's"),
    "tests": Column("tests"),
    "first_steps_with_all_tasks": Column("steps to all goals"),
    "best_reached": Column("goals of the best test"),
    "chosen_reached": Column("goals of the chosen policy"),
    "chosen_score": Column("score of the chosen policy", form=".3f"),
    "chosen_steps_to_oracle": Column("chosen steps / oracle's"),
    "plan": Column("plan"),
    "steps": Column("steps"),
    "lowest_success": Column("lowest seed", form=".3f"),
    "first_good_episodes": Column("episodes to 85 %", *_STEPS),
    "share_of_baseline": Column("share of the baseline's steps"),
    "collision_weight": Column("weight of a collision", form="g"),
    "split": Column("split"),
    "clouds": Column("clouds"),
    "ours": Column("ours", form=".3f"),
    "the paper's": Column("the paper's", form=".3f"),
    "points": Column("points a cloud", *_STEPS),
    "free": Column("free cells"),
    "blocked": Column("blocked cells"),
    "empty": Column("empty cells"),
    "rule_f1": Column("F1 of a height rule", form=".3f"),
    "accuracy": Column("accuracy", form=".3f"),
    "precision": Column("precision", form=".3f"),
    "recall": Column("recall", form=".3f"),
    "specificity": Column("specificity", form=".3f"),
    "balanced_accuracy": Column("balanced accuracy", form=".3f"),
    "f1_red": Column("F1 of blocked cells", form=".3f"),
    "iou_red": Column("IoU of blocked cells", form=".3f"),
    "cells": Column("cells"),
    "folder": Column("folder"),
    "commit": Column("commit"),
    "version": Column("andabata"),
    "setting": Column("setting"),
    "config_sha256": Column("settings"),
    "verb": Column("command"),
    "package": Column("package"),
    "version_of": Column("version"),
}
"""Columns by raw key."""

_BOUNDS: Mapping[str, tuple[tuple[str, str], ...]] = {
    "success_rate": (("wilson_low", "wilson_high"), ("success_low", "success_high")),
}
"""Keys of an interval's ends that are not named after their figure, by the figure's key."""

_UNITS = {"m_s": "m/s", "rad_s": "rad/s", "deg": "°", "s": "s", "m": "m", "j": "J", "hz": "Hz"}
"""Units by the end of a raw key that has no words of its own."""

_WORDS = {
    "goal": "reached",
    "collision": "collision",
    "tipover": "tipped over",
    "timeout": "out of time",
    "stuck": "stuck",
    "false arrival": "false arrival",
    "left world": "left the world",
    "never_left": "never left the start",
    "map": "sub-goal of a map",
    "reactive": "the goal",
    "hit_by_mover": "hit by a mover",
    "hit_at_rest": "hit while standing",
}
"""Words of values that are names."""

_NAMED = ("outcome", "failure", "contact", "memory")
"""Keys whose values are such names."""


def column(key: str) -> Column:
    """Return a column by its raw key; a key without words of its own is spelled out."""
    found = COLUMNS.get(key)
    if found is not None:
        return found
    for end, unit in _UNITS.items():
        if key.endswith(f"_{end}"):
            return Column(key.removesuffix(f"_{end}").replace("_", " "), unit)
    return Column(key.replace("_", " "), form=".3g")


def heading(key: str) -> str:
    """Return the heading of a raw key: words with the unit in brackets."""
    return column(key).heading


def cell(key: str, value: object) -> str:
    """Return the text of a value in the column of a raw key."""
    if value is None or value == "":
        return NONE
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {cell(key, item)}" for name, item in value.items()) or NONE
    if isinstance(value, list | tuple):
        return ", ".join(cell(key, item) for item in value) or NONE
    definition = column(key)
    if isinstance(value, float) or (isinstance(value, int) and definition.scale != 1.0):
        return NONE if value != value else f"{value * definition.scale:{definition.form}}"
    return word(str(value)) if key in _NAMED else str(value)


def word(value: str) -> str:
    """Return the words of a value that is a name, such as the end of a drive."""
    return _WORDS.get(value, value.replace("_", " "))


def bounds(row: Row, key: str) -> tuple[str, str] | None:
    """Return the keys of the interval's ends of a figure, None if the row has no interval."""
    for low, high in (*_BOUNDS.get(key, ()), (f"{key}_low", f"{key}_high")):
        if low in row and high in row:
            return low, high
    return None


def interval(row: Row, key: str) -> str:
    """Return a figure with its interval in one cell, such as ``0.83 [0.70, 0.92]``."""
    text, ends = cell(key, row.get(key)), bounds(row, key)
    if ends is None or any(row[end] is None for end in ends) or row.get(key) is None:
        return text
    definition = column(key)
    low, high = (f"{row[end] * definition.scale:{definition.form}}" for end in ends)
    return f"{text} [{low}, {high}]"


def shown_keys(row: Row) -> list[str]:
    """Return the keys of a row but for the ends of intervals, which stand with their figure."""
    inside = {end for key in row for end in bounds(row, key) or ()}
    return [key for key in row if key not in inside]


def spoken(row: Row, keys: Iterable[str] | None = None) -> dict[str, str]:
    """Return a row in words: headings with units, intervals in the cell of their figure.

    Args:
        row: Row with raw keys.
        keys: Keys of the columns in order, those that the row lacks left out; None for all.
    """
    chosen = shown_keys(row) if keys is None else [key for key in keys if key in row]
    return {heading(key): interval(row, key) for key in chosen}


def counted(row: Row, part: str = "successes", whole: str = "trials") -> str:
    """Return a count of a row as ``12 of 24``."""
    return f"{row[part]} of {row[whole]}"


def with_reached(rows: Iterable[Row], whole: str = "trials") -> list[dict[str, Any]]:
    """Return rows with the count of the drives that reached their goal, of ``whole``, in words."""
    return [{**row, "reached": counted(row, whole=whole)} for row in rows]


def several(count: int, what: str) -> str:
    """Return a count in words."""
    words = ("No", "One", "Two", "Three", "Four", "Five", "Six", "Seven", "Eight", "Nine")
    return f"{words[count] if count < len(words) else count} {what}{'s' if count != 1 else ''}"
