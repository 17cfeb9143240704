"""Tasks in rooms by name: settings and judges."""

import pytest

from andabata.tasks.rooms.catalogue import JUDGES_BY_TASK, ROOM_TASKS
from worlds.rooms.catalogue import make_room, room_names


@pytest.mark.parametrize("name", ROOM_TASKS)
def test_a_task_has_settings_of_its_name_and_judges_that_it_does_not_train_in(name):
    """All rooms of the family that judge are the comparison's; the pool holds none of them."""
    config = ROOM_TASKS[name]()
    assert config.task == name
    judges = {room for room in room_names() if room.startswith(name) and make_room(room).judges}
    assert set(JUDGES_BY_TASK[name]) <= judges
    assert not judges & {*config.all_rooms, *config.unseen.rooms}
