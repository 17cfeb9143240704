"""Results of commands as tables and texts for people, from the data that ``--json`` prints."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rich.console import Group

from andabata.app.console import table_of
from andabata.app.fault_tables import fault_text
from andabata.evaluation.offroad_table import success_text
from andabata.report.columns import HITS, heading

if TYPE_CHECKING:
    from rich.table import Table

    from andabata.records.bags import LeftOut
    from andabata.records.summary import BagSummary

Data = Mapping[str, Any]


def policy_text(data: Data) -> str:
    """Return a policy's input, output and training as text."""
    info, actions = data["info"], data["actions"]
    inputs = ", ".join(
        f"{term['name']} {tuple(term['shape'])} [{term['low']:.3g}, {term['high']:.3g}] "
        f"{term['unit']}"
        for term in data["observations"]
    )
    bounds = zip(actions["names"], actions["low"], actions["high"], actions["units"], strict=True)
    outputs = ", ".join(f"{name} [{low:g}, {high:g}] {unit}" for name, low, high, unit in bounds)
    # A policy that was imitated or distilled has no stages.
    stage = f" to stage {info['stage']}" if "stage" in info else ""
    return (
        f"{data['architecture']} with {data['parameters']} parameters\n"
        f"observations: {inputs}\nactions: {outputs}\n"
        f"trained{stage} with seed {info.get('seed')} at commit "
        f"{info.get('commit')}; --json has every setting"
    )


def drive_text(title: str, data: Data) -> str:
    """Return a drive as text, a line for each attempted goal."""
    lines = [title]
    lines += [
        f"goal {attempt['goal']}: {_ending(attempt)} after {attempt['time_s']:.1f} s and "
        f"{attempt['distance_m']:.1f} m, {attempt['trespass_m']:.1f} m on forbidden ground"
        f"{_word(attempt)}"
        for attempt in data["attempts"]
    ]
    lines += _estimate_lines(data.get("estimate"))
    lines += [fault_text(data["faults"])] if data.get("faults") else []
    lines += [f"{name}: {data[name]}" for name in ("picture", "record", "clip") if name in data]
    return "\n".join(lines)


def _word(attempt: Data) -> str:
    """Return how far from the goal the robot was when it declared it reached, if it did."""
    error = attempt.get("arrival_error_m")
    return "" if error is None else f"; declared reached {error:.2f} m from it"


def _estimate_lines(estimate: Data | None) -> list[str]:
    """Return how far a robot's own estimate was off, and why it was not ok."""
    if estimate is None:
        return []
    degrees = [math.degrees(estimate[f"heading_{name}_rad"]) for name in ("error", "rms")]
    lines = [
        f"own estimate: {estimate['position_error_m']:.2f} m off at the end (rms "
        f"{estimate['position_rms_m']:.2f} m, at most {estimate['position_max_m']:.2f} m), heading "
        f"{degrees[0]:.1f} degrees (rms {degrees[1]:.1f}); inside its own 2-sigma ellipse "
        f"{100 * estimate['inside_2_sigma']:.0f} % of the time (86 % expected)"
    ]
    health, causes = estimate["health_s"], estimate["causes_s"]
    if set(health) != {"ok"}:
        shares = ", ".join(f"{name} {seconds:.1f} s" for name, seconds in health.items())
        reasons = ", ".join(f"{name} ({seconds:.1f} s)" for name, seconds in causes.items())
        lines.append(f"health: {shares}" + (f"; {reasons}" if reasons else ""))
    for sensor, unused in estimate["unused"].items():
        words = ", ".join(f"{number} {reason}" for reason, number in unused.items())
        lines.append(f"not used: {sensor}: {words}")
    return lines


def _ending(attempt: Data) -> str:
    """Return how an attempt ended; of a collision also what was hit, and who drove into whom."""
    contact = attempt.get("contact", "").replace("_", " ")
    contact = ", ".join(filter(None, (contact, attempt.get("walker"))))
    outcome = str(attempt["outcome"])
    return f"{outcome} ({contact})" if contact and outcome == "collision" else outcome


def evaluation_tables(data: Data) -> Group:
    """Return two tables for each world of an evaluation off-road, and what counts as success.

    Earlier versions, in which the true pose ended a drive, have the first alone.
    """
    rows, within = data["rows"], data.get("success_within")
    worlds = dict.fromkeys(_worlds(rows))
    if within is None:
        return Group(*(_evaluation_table(rows, name) for name in worlds))
    tables = ((_evaluation_table(rows, name), _verdict_table(rows, name)) for name in worlds)
    return Group(*(table for both in tables for table in both), success_text(within))


def _worlds(rows: Sequence[Data]) -> Iterable[str]:
    """Return the world of each row."""
    return (row["world"] for row in rows)


def _evaluation_table(rows: Sequence[Data], world: str) -> "Table":
    """Return the table of one world, narrow enough for a terminal of 80 columns.

    Where there were collisions with walkers, ``hit`` are those with what stands, and ``walker``
    those that the robot drove into + that drove into it while it drove + while it stood.
    """
    there = [row for row in rows if row["world"] == world]
    # Rows of earlier versions do not tell who hit whom.
    walkers = any(row.get(key, 0) for row in there for key in HITS)
    shown = [
        {
            "controller": row["controller"],
            "goal": str(row["goal"]),
            "reached": f"{row['successes']}/{row['trials']}",
            "95 %": f"{row['wilson_low']:.2f}-{row['wilson_high']:.2f}",
            **(_by_whom(row) if walkers else {"hit": row["collisions"]}),
            "tip": row["tipovers"],
            "late": row["timeouts"],
            "stuck": row["stuck"],
            "spl": f"{row['spl']:.2f}",
            "no-go": None
            if row["trespass_share"] is None
            else f"{100 * row['trespass_share']:.1f} %",
        }
        for row in there
    ]
    title = f"{world}. walker: driven into + hit by, driving + standing" if walkers else world
    return table_of(shown, title)


def _verdict_table(rows: Sequence[Data], world: str) -> "Table":
    """Return strict successes, words of arrival and errors of one world.

    ``strict`` are trials with a clean outline up to the goal, ``false`` arrivals declared too far
    from it, ``out`` robots that left the world. The true distance to the goal at the word and the
    error of the estimate at the end are means.
    """
    shown = [
        {
            "controller": row["controller"],
            "goal": str(row["goal"]),
            "strict": f"{_count(row['strict_successes'])}/{row['trials']}",
            "false": row["false_arrivals"],
            "out": row["left_world"],
            "true distance": _metres(row["arrival_error_m"]),
            "estimate off": _metres(row["position_error_m"]),
        }
        for row in rows
        if row["world"] == world
    ]
    return table_of(shown, f"{world}. strict verdict, and the robot's own word")


def _count(count: int | None) -> str:
    """Return a count; a dash for one that is not known."""
    return "-" if count is None else str(count)


def _metres(length: float | None) -> str | None:
    """Return a length with its unit."""
    return None if length is None else f"{length:.2f} m"


def _by_whom(row: Data) -> dict[str, Any]:
    """Return the collisions with what stands, and those with walkers by who drove into whom.

    Rows of earlier versions count walkers that the robot drove into to what stands.
    """
    known = [row.get(key) for key in HITS]
    hit = row["collisions"] - sum(count or 0 for count in known)
    return {"hit": hit, "walker": "+".join("-" if each is None else str(each) for each in known)}


def room_tables(data: Data) -> Group:
    """Return a table for each room and policy of an evaluation, several seeds together first.

    A last one has the differences in success, if there are several policies.

    Args:
        data: Rows of the cells, of several seeds together and of differences; see ``RoomTable``.
    """
    rows, every = data["rows"], [*data["pooled"], *data["rows"]]
    names = [row["policy"] for row in every]
    several = len(set(names)) > 1
    return Group(
        *(
            _room_table(
                [row for row in every if (row["room"], row["policy"]) == (room, policy)],
                f"{room}: {policy}" if several else room,
            )
            for room in dict.fromkeys(row["room"] for row in rows)
            for policy in dict.fromkeys(names)
        ),
        *([_difference_table(data["differences"])] if data["differences"] else []),
    )


def _room_table(rows: Sequence[Data], title: str) -> "Table":
    """Return the table of one room and policy, narrow enough for a terminal of 80 columns.

    Where there are movers, ``hit`` are the collisions that the robot caused, and ``mover`` those
    that a mover caused while the robot drove + while it stood. Rows of earlier versions say nothing
    about movers.
    """
    movers = rows[0].get("movers", 0) if rows else 0
    if movers:
        title = (
            f"{title}. mover: hit by one while driving + while standing; "
            f"T/oracle leaves out the {movers} movers"
        )
    shown = [
        {
            "lidar": row["lidar"],
            "memory": row["memory"],
            "reached": f"{row['successes']}/{row['trials']}",
            "95 %": f"{row['wilson_low']:.2f}-{row['wilson_high']:.2f}",
            **(_hits(row) if movers else {"hit": row["collisions"]}),
            "late": row["timeouts"],
            "T/oracle": row["steps_to_oracle"],
            "SPL": row["spl"],
        }
        for row in rows
    ]
    return table_of(shown, title)


def _hits(row: Data) -> dict[str, Any]:
    """Return the collisions that the robot caused, and those that movers caused."""
    driving, standing = row["hit_by_mover"], row["hit_at_rest"]
    return {"hit": row["collisions"] - driving - standing, "mover": f"{driving}+{standing}"}


def _difference_table(rows: Sequence[Data]) -> "Table":
    """Return the table of differences in success between policies, in points."""
    shown = [
        {
            "policy": row["policy"],
            "lidar": row["lidar"],
            "memory": row["memory"],
            "success": f"{row['success_rate']:.3f}",
            "difference": _points(row),
        }
        for row in rows
    ]
    return table_of(shown, f"Success in points against {rows[0]['against']}")


def _points(row: Data) -> str:
    """Return a difference of rates with its interval, in points."""
    mean, low, high = (100 * row[f"difference{end}"] for end in ("", "_low", "_high"))
    return f"{mean:+.1f} ({low:+.1f} to {high:+.1f})"


def study_table(data: Data) -> "Table":
    """Return the table of a study of a laser; differences are in points of success."""
    rows = data["rows"]
    shown = [
        {
            "laser": row["text"],
            "reached": f"{row['successes']}/{row['trials']}",
            "95 %": f"{row['success_low']:.2f}-{row['success_high']:.2f}",
            "hit": row["collisions"],
            "late": row["timeouts"],
            "difference": None if row["difference"] is None else _points(row),
        }
        for row in rows
    ]
    return table_of(shown, f"laser {rows[0]['lidar']}: differences in points of success")


def recording_table(found: "BagSummary", title: str) -> "Table":
    """Return the topics of a recording, with the columns that differ between topics."""
    shown = ["topic", "type", "messages", "rate_hz"]
    # A column that says the same of every topic is left out.
    shown += ["connections"] if any(topic.connections > 1 for topic in found.topics) else []
    shown += ["readable"] if not all(topic.readable for topic in found.topics) else []
    rows = [topic.to_json() for topic in found.topics]
    return table_of([{heading(key): _yes_no(row[key]) for key in shown} for row in rows], title)


def recording_notes(found: "BagSummary") -> list[str]:
    """Return in words what a recording has that cannot be read, and its notes."""
    reasons = {topic.topic: topic.reason for topic in found.topics if not topic.readable}
    lines = [f"{topic} can't be read: {reason}" for topic, reason in reasons.items()]
    others = [each for each in found.left_out if each.topic not in reasons]
    return lines + left_out_notes(others, found.notes)


def left_out_notes(left_out: "Sequence[LeftOut]", notes: Sequence[str]) -> list[str]:
    """Return in words what was left out, and the notes."""
    return [str(each) for each in left_out] + [f"note: {note}" for note in notes]


def salvage_text(data: Data) -> str:
    """Return what was kept of a recording and what was lost, as text."""
    lost = "nothing was lost"
    if data["lost"]:
        number = data["lost_messages"]
        count = "an unknown number of" if number is None else number
        lost = f"{count} messages lost: {data['reason']}"
    elif data["reason"]:
        lost = f"{lost} of what is there; {data['reason']}"
    lines = [f"{data['file']}: {data['messages']} messages; {lost}"]
    return "\n".join([*lines, *left_out_notes((), data["notes"])])


def scan_lines(found: Sequence[Data]) -> list[str]:
    """Return the scans of clouds as text, and the cloud files that were not read."""
    from traversability.two_truths import truth_lines  # Compiles: only scans need it.

    return [
        f"{data['file']}: not read"
        if "error" in data
        else "\n".join(
            [
                f"{data['file']}: {scan_text(data)}",
                *(truth_lines(data["truths"]) if "truths" in data else []),
                f"picture: {data['picture']}",
            ]
        )
        for data in found
    ]


def scan_text(data: Data) -> str:
    """Return the figures of a scan as a sentence."""
    cells, nearest = data["cells"], data["nearest_obstacle_m"]
    result = "no obstacle seen" if nearest is None else f"nearest obstacle {nearest:.2f} m"
    # Without a cell nothing was looked at: that is not free ground.
    if not cells["green"] + cells["red"]:
        result = "no cell could be classified"
    lost = f" ({data['no_returns']} no-returns left out)" if data["no_returns"] else ""
    return (
        f"{data['points']} points{lost}: {cells['green']} free, {cells['red']} blocked, "
        f"{cells['white']} unknown cells; {result}; {100 * data['unknown_share']:.0f} % of the "
        "ranges unknown."
    )


def training_text(result: Data) -> str:
    """Return the result of a training run as text."""
    validation = result["validation"].get(result["stage"], {})
    validated = ", ".join(f"{name} {rate:.0%}" for name, rate in validation.items())
    return (
        f"{result['stage']}: {result['success_rate']:.0%} of the last goals reached while "
        f"exploring{f'; validation: {validated}' if validated else ''}; {result['steps']} steps "
        f"in {result['wall_s']:.0f} s"
    )


def _yes_no(value: object) -> object:
    """Return a truth value as a word."""
    return ("no", "yes")[value] if isinstance(value, bool) else value
