"""Study of a laser: changes, pairs, and advice that the intervals carry."""

import numpy as np
import pytest

from andabata.evaluation.lidar_study import LidarStudyConfig, mounting_advice
from andabata.machine.planar.lidar import PLANAR_LIDARS
from andabata.tasks.rooms.spn_config import SpnConfig
from rl.goal_laws import ProportionalPolicy
from tests.support.room_tables import evaluated_rooms, studied_lidar

TASK = SpnConfig()
POLICIES = {"p": ProportionalPolicy({}, TASK.observations, TASK.actions)}
POSES = {change.text: change for change in LidarStudyConfig().changes}


def small(**changes):
    settings = {
        **{"forward": (0.05,), "left": (), "turned": (), "fov_deg": (90.0,)},
        **{"resolution_deg": (), "max_range": (), "rooms": ("spn-env0", "spn-env1"), "pairs": 4},
    }
    return LidarStudyConfig(**settings | changes)


def test_changes_are_those_of_one_thing():
    """The laser as it is comes first; poses are moved from it, kinds replace its value."""
    config = small(lidar="ten-beams-forward", left=(-0.1,), turned=(5.0,))
    base, *changes = config.changes
    assert base.lidar == PLANAR_LIDARS["ten-beams-forward"]
    assert [(change.text, change.lidar.label) for change in changes] == [
        ("0.05 m forward", "180|20|10|0.1"),
        ("0.1 m right", "180|20|10|0.05|-0.1"),
        ("turned +5 deg", "180|20|10|0.05|0|5"),
        ("field of view 90 deg", "90|20|10|0.05"),
    ]


def test_changes_that_change_nothing_are_left_out():
    """A value that the laser has already is no change, and none is driven twice."""
    config = small(forward=(0.0, 0.05, 0.05), fov_deg=(180.0,))
    assert [change.text for change in config.changes] == ["as it is", "0.05 m forward"]
    assert config.cells.lidars == ("180|20|10|0", "180|20|10|0.05")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"lidar": "radar"}, "expected FOV"),
        ({"forward": (3.0,)}, r"laser 180\|20\|10\|0 with x 3: Input should be less than"),
        ({"fov_deg": (400.0,)}, "with fov_deg 400: Input should be less than or equal to 360"),
        ({"rooms": ()}, "at least 1 item"),
    ],
)
def test_lasers_that_cannot_be_are_refused(change, message):
    """The error names the laser and the value, before anything is driven."""
    with pytest.raises(ValueError, match=message):
        small(**change)


def test_rows_are_those_of_the_same_tasks():
    """Counts are those of an evaluation of the same cells; a policy that sees nothing is the same
    with any laser, so that every difference is 0 with an interval around it.
    """
    config = small()
    study = studied_lidar(config, POLICIES)
    counted = evaluated_rooms(config.cells, POLICIES).rows
    for row in study.rows:
        mine = [one for one in counted if one["lidar"] == row["lidar"]]
        for name in ("trials", "successes", "collisions", "timeouts"):
            assert row[name] == sum(one[name] for one in mine)
    base, *changes = study.rows
    assert (base["text"], base["difference"], base["trials"]) == ("as it is", None, 8)
    for row in changes:
        assert row["difference"] == 0
        assert row["difference_low"] < 0 < row["difference_high"]
        assert row["by_room"] == {"spn-env0": 0, "spn-env1": 0}
    assert study.advice.startswith("No pose is shown to be better than the laser as it is")


def successes(rate, count=400):
    """Return successes of the first tasks, shape (1, count)."""
    return (np.arange(count) < rate * count)[None]


def test_advice_names_the_pose_that_the_interval_shows_to_be_better():
    """Eight points of 400 tasks without a loss are shown; what is worse is named too."""
    poses = [
        (POSES["0.05 m forward"], successes(0.88)),
        (POSES["0.1 m back"], successes(0.5)),
        (POSES["0.05 m left"], successes(0.81)),
    ]
    advice = mounting_advice(successes(0.8), poses)
    assert advice.startswith("Mount it 0.05 m forward: success changes by +8.0 points (+4.")
    assert "in all 3 poses at once" in advice
    assert "Worse: 0.1 m back -30.0 points (" in advice


def test_advice_needs_more_where_more_poses_were_tried():
    """What one pose shows, the best of nine does not: one of them gains by chance."""
    base, first = successes(0.8, 200), (POSES["0.05 m forward"], successes(0.825, 200))
    assert mounting_advice(base, [first]).startswith("Mount it 0.05 m forward")
    others = [(POSES["0.05 m left"], successes(0.8, 200))] * 8
    advice = mounting_advice(base, [first, *others])
    assert advice.startswith(
        "No pose is shown to be better than the laser as it is: 0.05 m forward"
    )


def test_advice_without_poses():
    """A study of other lasers alone gives no advice on where to mount it."""
    assert mounting_advice(successes(0.8), []) == "No other pose was tried."
