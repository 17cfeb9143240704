"""Training plans as data: what is learnt in which order, on which worlds, by which body."""

import pytest

from andabata.app.cli import main
from andabata.machine.planar.lidar import TRAINING_LIDAR
from andabata.tasks.offroad import stage_config
from andabata.tasks.rewards import (
    GdaeRewardConfig,
    ImprovedRewardConfig,
    RewardConfig,
    RoomRewardConfig,
)
from andabata.tasks.rooms.catalogue import JUDGES_BY_TASK
from andabata.tasks.rooms.td3_config import GDAE_RADIUS, Td3TaskConfig, td3_config
from andabata.training.plans import TASKS, algorithms, load_plan
from rl.environment import world_of_level
from worlds.catalogue import make_world
from worlds.rooms.catalogue import make_room
from worlds.splits import EVALUATION_START, TRAINING_SEEDS, VALIDATION_SEEDS


def test_the_papers_scheme_is_the_papers():
    """Three stages of 200 episodes, the printed critic, the reward without penalties."""
    plan = load_plan("actor-critic")
    assert plan.learner.algorithm == "actor-critic"
    assert [stage.episodes for stage in plan.stages.values()] == [200, 200, 200]
    assert list(plan.stages) == ["Maze2D", "Maze3D", "Natural"]
    assert plan.learner.hidden == (200, 200)
    assert plan.learner.critic == "reward-input"
    for stage in plan.stages.values():
        environment = stage.environment
        assert environment.heading == "goal"
        assert environment.reward.collision == environment.reward.tipover == 0.0
        assert environment.reward.attraction == 200.0
        assert stage.promote_at is None
        assert stage.difficulty is None
    limits = [stage.environment.terminations.time_limit for stage in plan.stages.values()]
    assert limits == [180.0, 180.0, 300.0]
    scanners = [stage.environment.simulated_robot.sensing.scanner for stage in plan.stages.values()]
    assert scanners == ["horizontal", "rotating", "rotating"]


def test_the_papers_plan_is_one_maze_and_one_natural_world_by_its_own_rule():
    """Else its stages are those of `actor-critic`, which has many worlds and ends by contact."""
    plan, many = load_plan("paper"), load_plan("actor-critic")
    learner = plan.learner
    assert (learner.critic, learner.hidden) == ("reward-input", (200, 200))
    assert learner.action_repeat == learner.driving_repeat  # Held alike, learning and driving.
    assert plan.validate_every == 0  # The last actor of a stage, not the best of several.
    limits = []
    for name, stage in plan.stages.items():
        environment, other = stage.environment, many.stages[name].environment
        rules = environment.terminations
        assert rules.collision_range == 0.72
        assert (len(environment.seeds), environment.unseen.terminations) == (1, rules)
        assert environment.start_jitter == environment.heading_jitter == 0.0
        kept = ("seeds", "start_jitter", "heading_jitter", "perception_decimation", "terminations")
        changes = {key: getattr(other, key) for key in kept}
        assert environment.model_copy(update=changes) == other
        assert rules == other.terminations.model_copy(update={"collision_range": 0.72})
        assert stage.model_copy(update={"environment": other}) == many.stages[name]
        limits.append(rules.time_limit)
    assert limits == [180.0, 180.0, 300.0]
    first, second, third = (stage.environment for stage in plan.stages.values())
    assert first.seeds == second.seeds  # Stages 1 and 2 are driven in the same maze.
    tasks = make_world("maze", first.seeds[0]).tasks
    assert {task.start.yaw for task in tasks} == {0.0}
    assert len(make_world("natural", third.seeds[0]).tasks) == 4


def test_no_other_plan_ends_episodes_by_a_near_range():
    """The rule is the paper's alone."""
    for task in TASKS:
        for name in algorithms(task):
            for stage in load_plan(name, task=task).stages.values():
                has_rule = stage.environment.terminations.collision_range is not None
                assert has_rule == ((task, name) == ("offroad", "paper"))


def test_held_actions_are_refused_in_rooms(capsys):
    """Their robots decide in every step, also those of a policy that says otherwise."""
    words = ["train", "--task", "spn", "--set", "learner.driving_repeat=3", "--quiet"]
    assert main(words) != 0
    assert "learner.driving_repeat: expected 1 for the task spn" in capsys.readouterr().err


@pytest.mark.parametrize("algorithm", algorithms())
def test_nothing_is_validated_where_it_was_learnt(algorithm):
    """Training, validation and evaluation have worlds of their own, else the same settings."""
    for stage in load_plan(algorithm).stages.values():
        assert set(stage.environment.seeds) <= set(TRAINING_SEEDS)
        assert set(stage.environment.unseen.seeds) == set(VALIDATION_SEEDS)
        elsewhere = stage.environment.model_copy(update={"seeds": VALIDATION_SEEDS})
        assert stage.environment.unseen == elsewhere  # Driven and evaluated as while it learns.
    assert not set(TRAINING_SEEDS) & set(VALIDATION_SEEDS)
    assert max(VALIDATION_SEEDS) < EVALUATION_START


def test_the_body_and_the_laser_are_chosen():
    """The body is that of all stages, the laser that of the stages that see clouds."""
    plan = load_plan("sac", "os1-64", "jackal")
    robots = [stage.environment.simulated_robot for stage in plan.stages.values()]
    assert {simulated_robot.robot.name for simulated_robot in robots} == {"jackal"}
    assert robots[0].sensing.scanner == "horizontal"
    assert robots[1].sensing.lidar == robots[2].sensing.lidar != robots[0].sensing.lidar


def test_an_unknown_algorithm_is_named(capsys):
    """The error lists the algorithms."""
    assert main(["train", "--algorithm", "magic", "--quiet"]) != 0
    assert (
        "--algorithm: expected sac, actor-critic, paper, sac-points, got 'magic'"
        in capsys.readouterr().err
    )


def test_no_decision_is_made_on_an_older_scan(capsys):
    """A perception decimation that does not divide the action repeat is refused."""
    wanted = ["--set", "stages.Natural.environment.perception_decimation=3", "--quiet"]
    assert main(["train", *wanted]) != 0
    assert (
        "Natural.environment.perception_decimation: expected a divisor" in capsys.readouterr().err
    )


def test_the_curriculum_of_a_plan_is_that_of_its_stages():
    """Chosen stages come in their order, with the plan's learner and the robot's spaces."""
    plan = load_plan("sac")
    config = plan.curriculum(range(1, 3), 7)
    assert [stage.name for stage in config.stages] == ["Maze3D", "Natural"]
    assert [stage.episodes for stage in config.stages] == [24, 72]
    assert [stage.rehearsal for stage in config.stages] == [0.25, 0.125]
    assert config.stages[1].difficulty.start == 0.4
    assert (config.learner, config.seed) == (plan.learner, 7)
    assert (config.final_lr_scale, config.validation, config.validate_every) == (0.2, 8, 0)
    assert config.observations.size == 35
    assert config.observations.term("ranges").high == 10.0
    assert (config.actions.names, config.actions.high) == (("angular",), (0.5,))


def test_a_plan_changes_its_environments_only_where_it_says():
    """The default plan has a fifth of the paper's repulsion and its own decimation, no more."""
    for name, stage in load_plan("sac").stages.items():
        environment = stage.environment
        reward = environment.reward
        assert (reward.front, reward.side, reward.rear) == (0.02, 0.006, 0.0018)
        assert environment.perception_decimation == (1 if name == "Maze2D" else 5)
        assert environment.heading == "subgoal"
        changes = {"reward": RewardConfig(), "perception_decimation": 1}
        assert environment.model_copy(update=changes) == stage_config(name)


def test_td3_drives_in_rooms_beside_the_conventional_input():
    """The plans of TD3 and of SAC on 36 ranges differ in the learner and the progress alone."""
    td3, sac = load_plan("td3", task="spn"), load_plan("sac-1d", task="spn")
    assert "td3" in algorithms("spn")
    assert (td3.learner.algorithm, td3.learner.hidden) == ("td3", sac.learner.hidden)
    assert td3.learner.actor_terms == td3.learner.critic_terms == sac.learner.actor_terms
    rooms = td3.stages["Rooms"]
    environment = rooms.environment.model_copy(update={"reward": RoomRewardConfig()})
    assert rooms.environment.reward == RoomRewardConfig(progress=2.0)
    assert rooms.model_copy(update={"environment": environment}) == sac.stages["Rooms"]


def test_sac_paper_is_the_papers():
    """Its curriculum, critics, losses, updates, points and policy are those of SPN as printed."""
    plan = load_plan("sac-paper", task="spn")
    learner, stage = plan.learner, plan.stages["Rooms"]
    # Actor on all 1080 points with 20 features, plain dense critics of 36 windows.
    assert (learner.actor.kind, learner.actor.features) == ("points", 20)
    assert learner.critic_terms == ("windows", "goal", "velocity")
    assert (learner.normalised, learner.loss, learner.state_value) == (False, "squared", True)
    environment = stage.environment
    assert (environment.points, environment.windows) == (1080, 36)
    assert (environment.lidar, environment.goal_encoding) == (TRAINING_LIDAR, "polar")
    # 500,000 steps, an update each, 100 episodes of the proportional controller, the same rate.
    assert (stage.steps, learner.updates_per_step, learner.warmup_episodes) == (500_000, 1.0, 100)
    assert (learner.episodes_per_iteration, learner.action_repeat) == (1, 1)
    assert (learner.learn_temperature, plan.final_lr_scale) == (False, 1.0)
    # Four rooms, 0.7 for the level's own; it moves on at 0.9 of its latest 50 episodes.
    rule = stage.difficulty
    assert environment.rooms == ("spn-env0", "spn-env1", "spn-env2", "spn-env3")
    assert (environment.main_room_share, environment.random_rooms) == (0.7, 0)
    assert (rule.worlds, rule.window, rule.raise_at, rule.lower_at) == (4, 50, 0.9, 0.0)
    levels = [0.0]
    while levels[-1] < rule.max_level:
        levels.append(rule.after(levels[-1], [True] * 50))
    assert [world_of_level(level, 4) for level in levels] == [0, 1, 2, 3]
    # The last actor: nothing is averaged, and no validation chooses.
    assert (learner.ema_rate, learner.driving_noise, plan.validate_every) == (1.0, 0.0, 0)
    assert plan.test_every == 5000


@pytest.mark.parametrize(
    ("task", "name"), [(task, name) for task in ("spn", "td3") for name in JUDGES_BY_TASK[task]]
)
def test_rooms_that_judge_are_refused_by_name(task, name, capsys, tmp_path):
    """No training begins in one, whatever rooms stand beside it."""
    rooms = f'stages.Rooms.environment.rooms=["gdae","{name}"]'
    words = ["train", "--task", task, "--set", rooms, "--quiet", "--out", str(tmp_path / "run")]
    assert main(words) != 0
    error = capsys.readouterr().err
    assert "stages.Rooms.environment.rooms: expected rooms to train and to validate in" in error
    assert f"got {name}, for judging alone; name others, such as random-0" in error
    assert not (tmp_path / "run").exists()


def variant(name):
    """Return the learner and the environment of a variant of TD3."""
    plan = load_plan(name, task="td3")
    return plan.learner, plan.stages["Rooms"].environment


def test_td3_comes_first_of_five_variants():
    """The task's default is `td3`; the option's error names all five."""
    names = ("td3", "gdae", "gdae-trainable", "td3-improved", "td3-improved-scaled")
    assert algorithms("td3") == names
    assert load_plan(task="td3") == load_plan("td3", task="td3")
    with pytest.raises(ValueError, match=r"--algorithm: expected td3, gdae, .* got 'sac'"):
        load_plan("sac", task="td3")


@pytest.mark.parametrize(
    ("name", "values", "radius"),
    [
        ("td3", 45, 0.2),
        ("td3-improved", 44, 0.2),
        ("td3-improved-scaled", 44, 0.2),
        ("gdae", 24, GDAE_RADIUS),
        ("gdae-trainable", 24, GDAE_RADIUS),
    ],
)
def test_variants_have_the_states_and_budgets_of_the_papers(name, values, radius):
    """24 values of GDAE and 44 of the improved TD3, 500 steps; one room of a pool an episode."""
    (stage,) = load_plan(name, task="td3").stages.values()
    environment = stage.environment
    assert environment.observations.size == values
    robot = environment.robot
    assert (robot.radius, robot.max_speed, robot.max_yaw_rate) == (radius, 1.0, 1.0)
    assert environment.terminations.time_limit / robot.period == pytest.approx(500)
    assert not any(make_room(room).judges for room in environment.unseen.rooms)
    assert environment.rooms == ()
    assert (stage.episodes, stage.steps) == ((10_000, None) if values < 45 else (100_000, 600_000))
    form = {24: "gdae", 44: "printed", 45: "scaled"}[values]
    expected = td3_config(state=form)
    assert (environment.terms, environment.lidar) == (expected.terms, expected.lidar)


def test_gdae_is_as_shipped():
    """Widths, batch, rates, discount, noise, delay, turns and the frozen fusion are GDAE's."""
    learner, environment = variant("gdae")
    assert (learner.hidden, learner.critic_hidden, learner.normalised) == ((800, 600), None, False)
    assert learner.fusion.model_dump() == {"kind": "sum", "layer": 1, "frozen": True}
    assert (learner.gamma, learner.tau, learner.learning_rate) == (0.99999, 0.005, 1e-3)
    assert (learner.batch_size, learner.updates_per_step, learner.policy_delay) == (40, 1.0, 2)
    assert (learner.target_noise, learner.target_noise_clip) == (0.2, 0.5)
    assert (learner.action_repeat, learner.episodes_per_iteration) == (1, 1)
    assert (learner.buffer_size, learner.reward_scale, learner.loss) == (10**6, 1.0, "squared")
    assert [learner.noise.sigma(n) for n in (0, 500_000)] == pytest.approx([1.0, 0.1])
    assert learner.noise.sigma(250_000) == pytest.approx(0.55)
    turns = learner.random_turns
    assert (turns.near_range, turns.probability, turns.steps) == (0.6, 0.15, (8, 14))
    assert environment.reward == GdaeRewardConfig()


def test_variants_differ_from_gdae_where_they_say():
    """The trainable one in its fusion; the improved one in all that its file says."""
    (gdae, at_gdae), (trainable, at_trainable) = variant("gdae"), variant("gdae-trainable")
    changed = gdae.fusion.model_copy(update={"frozen": False})
    assert trainable == gdae.model_copy(update={"fusion": changed})
    assert at_trainable == at_gdae
    improved, environment = variant("td3-improved")
    assert improved.fusion.model_dump() == {"kind": "sum", "layer": 0, "frozen": False}
    others = {name: getattr(improved, name) for name in ("fusion", "noise", "random_turns")}
    assert improved == gdae.model_copy(update=others | {"learning_rate": 1e-4})
    assert improved.noise.sigma(100_000) == pytest.approx(0.1)
    assert environment.reward == ImprovedRewardConfig()
    # A time-out is one of the three ends of Eq. 5; everywhere else it cuts an episode short.
    assert environment.terminations.timeout_terminates
    rules = environment.terminations.model_copy(update={"timeout_terminates": False})
    assert rules == Td3TaskConfig().terminations
    assert not any(
        variant(other)[1].terminations.timeout_terminates
        for other in algorithms("td3")
        if other != "td3-improved"
    )
    environment = environment.model_copy(update={"terminations": rules})
    scaled, at_scaled = variant("td3-improved-scaled")
    assert scaled == improved.model_copy(update={"reward_scale": 0.05, "gamma": 0.99})
    reward = ImprovedRewardConfig(proportional=True)
    assert at_scaled == environment.model_copy(update={"reward": reward})


def test_td3_is_paid_for_progress():
    """Ours pays 2 (d - d') - 0.05, 5 at the end, -5 for standing still; it drives with noise."""
    learner, environment = variant("td3")
    expected = RoomRewardConfig(goal=5.0, collision=-5.0, progress=2.0, step=-0.05)
    assert environment.reward == expected
    assert environment.terminations.stuck_time == 5.0
    assert (learner.updates_per_step, learner.noise.steps, learner.gamma) == (1 / 8, 60_000, 0.99)
    assert (learner.policy_network, learner.driving_noise) == ("target", 0.3)
