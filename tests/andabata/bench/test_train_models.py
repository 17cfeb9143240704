"""Commands of the shipped classifiers."""

from pathlib import Path

from andabata.bench import train_models
from andabata.bench.train_models import LASERS, commands, data_sets


def test_every_laser_has_its_data_sets_and_no_seed_is_used_twice():
    """World seeds follow from seeds, so that no two data sets share worlds."""
    sets = data_sets()
    assert {f"{kind}-{laser}" for kind in "de" for laser in LASERS} <= set(sets)
    seeds = [words[words.index("--seed") + 1] for words in sets.values()]
    assert len(set(seeds)) == len(seeds)


def test_both_classifiers_are_trained_on_the_data_sets_that_were_generated():
    """The forest takes all but those of rough ground, the ground classifier all but c2."""
    *generated, forest, ground = commands(Path("f"))
    folders = [words[words.index("--out") + 1] for words in generated]
    used = [words[k + 1] for words in [forest] for k, w in enumerate(words) if w in TAKES]
    assert used == [folder for folder in folders if folder[:4] not in ("f/r-", "f/s-")]
    used = [words[k + 1] for words in [ground] for k, w in enumerate(words) if w in TAKES]
    assert used == [folder for folder in folders if not folder.endswith("c2")]


TAKES = ("--clouds", "--and")


def test_commands_run_in_their_order(monkeypatch, capsys):
    """What they print is passed on."""
    monkeypatch.setattr(train_models, "run_command", lambda *words: " ".join(words[:2]) + "\n")
    train_models.main(["f"])
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == len(commands(Path("f")))
    assert lines[-2:] == ["classifier train", "classifier ground"]
