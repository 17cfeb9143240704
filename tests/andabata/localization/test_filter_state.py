"""State of the filter: slices and indices name the numbers of the table."""

from andabata.localization import filter_state as state


def test_named_states_are_the_table_of_the_module():
    """Slices and single indices cover the state in the order of the module's table."""
    covered = [
        *range(state.STATES)[state.ATTITUDE],
        *range(state.STATES)[state.GYRO_BIAS],
        *range(state.STATES)[state.POSITION],
        state.SPEED,
        state.LATERAL_SPEED,
        *range(state.STATES)[state.HARD_IRON],
        state.COMPASS_ERROR,
        *range(state.STATES)[state.GNSS_ERROR],
        *range(state.STATES)[state.ACCEL_BIAS],
        state.WHEEL_SCALE,
        state.SLOPE_SLIP,
    ]
    assert covered == list(range(state.STATES))
    assert state.ANGULAR.tolist() == [True] * 3 + [False] * 17
