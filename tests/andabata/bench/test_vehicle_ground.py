"""Drives over natural ground: the plants agree on what is crossed and what stops."""

import pytest

from andabata.bench.vehicle_ground import ground_cases, ground_drives, ground_table
from andabata.machine.plants import available_plants
from andabata.machine.robot import RobotModel

PLANTS = available_plants()
MOTORS = {f"{plant}_J" for plant in PLANTS if plant != "kinematic"}


@pytest.fixture(scope="module")
def rows():
    return ground_drives(RobotModel(), 0)


def test_each_case_has_a_row_with_all_plants(rows):
    """Ends and contacts of all that are installed, the work of those that have motors."""
    cases = list(ground_cases())
    assert [(row["ground"], row["size"]) for row in rows] == [(c.name, c.size) for c in cases]
    keys = {f"{plant}_{what}" for plant in PLANTS for what in ("m", "contact")}
    assert all(set(row) == {"ground", "size"} | MOTORS | keys for row in rows)


def test_the_plants_agree(rows):
    """What one touches all touch; where none touches and none is stopped they end within 0.2 m."""
    for row in rows:
        contacts = {row[f"{plant}_contact"] for plant in PLANTS}
        assert len(contacts) == 1, row
        ends = [row[f"{plant}_m"] for plant in PLANTS]
        if not contacts.pop() and max(ends) > 2.0:
            assert max(ends) - min(ends) < 0.2, row


def test_each_kind_has_cases_of_both_outcomes(rows):
    """Kerbs and roots of up to 5 cm are climbed, stems stop, a bush stops on the steep slope."""
    touched = {(row["ground"], row["size"]): row["wheels_contact"] for row in rows}
    assert [touched["kerb [m]", height] for height in (0.03, 0.06, 0.1)] == [False, True, True]
    assert [touched["root [m]", height] for height in (0.045, 0.065)] == [False, True]
    assert all(touched["stem [m]", thick] for thick in (0.02, 0.06, 0.2))
    ends = {row["size"]: row["wheels_m"] for row in rows if row["ground"] == "bush uphill [deg]"}
    assert ends[28.0] < 1.5 < 2.5 < ends[20.0]
    work = {row["ground"]: row["wheels_J"] for row in rows}
    grass, thicket, bush = (work[f"{k}, height [m]"] for k in ("high grass", "thicket", "bush"))
    assert grass < thicket < bush


def test_a_table_names_the_plants_that_touch():
    """All of them, some, or none; ends and work stay."""
    ends = {f"{plant}_m": 1.0 + k for k, plant in enumerate(PLANTS)}
    given = [
        {"ground": "a", "size": 1.0, **ends, "wheels_J": 5.0}
        | {f"{plant}_contact": plant in touching for plant in PLANTS}
        for touching in (PLANTS, ("wheels",), ())
    ]
    found = ground_table(given)
    assert [row["contact"] for row in found] == ["all", "wheels", "none"]
    assert list(found[0]) == ["ground", "size", *ends, "contact", "wheels_J"]
    assert found[0]["kinematic_m"] == float(len(PLANTS))
