"""Options that name models: classifiers and policies."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from andabata.models import Models
    from rl.policy import Policy as PolicyModel
    from traversability.forest import Forest

_MODELS = "Models"
"""Panel of the help."""

ForestFile = Annotated[
    Path | None,
    typer.Option(
        "--forest",
        metavar="FILE",
        help="Cell classifier instead of the shipped one.",
        rich_help_panel=_MODELS,
    ),
]
GroundClassifierFile = Annotated[
    Path | None,
    typer.Option(
        "--ground-classifier",
        metavar="FILE",
        help="Ground classifier of the local map instead of the shipped one.",
        rich_help_panel=_MODELS,
    ),
]
PolicyFile = Annotated[
    Path | None,
    typer.Option(
        "--policy",
        metavar="FILE",
        help="Policy instead of the shipped one.",
        rich_help_panel=_MODELS,
    ),
]


@dataclass(frozen=True)
class ForestOptions:
    """Cell classifier: ``--forest``."""

    forest: ForestFile = None

    def load(self) -> "Forest":
        """Return the classifier, the shipped one by default."""
        from andabata.models import shipped_forest
        from traversability.forest import Forest

        return Forest.load(self.forest) if self.forest else shipped_forest()


@dataclass(frozen=True)
class PolicyOptions:
    """Policy: ``--policy``."""

    policy: PolicyFile = None

    def load(self) -> "PolicyModel":
        """Return the policy, the shipped one by default."""
        from andabata.models import shipped_policy
        from rl.policy import load_policy

        return load_policy(self.policy) if self.policy else shipped_policy()


@dataclass(frozen=True)
class ClassifierOptions:
    """Classifiers: ``--forest``, ``--ground-classifier``."""

    forest: ForestFile = None
    ground_classifier: GroundClassifierFile = None

    def load(self) -> "Models":
        """Return the classifiers beside the shipped policy; the shipped ones by default."""
        from andabata.models import Models

        return Models.load(self.forest, self.ground_classifier)


@dataclass(frozen=True)
class ModelOptions:
    """All models: ``--forest``, ``--ground-classifier``, ``--policy``."""

    forest: ForestFile = None
    ground_classifier: GroundClassifierFile = None
    policy: PolicyFile = None

    def load(self) -> "Models":
        """Return the models, the shipped ones by default."""
        from andabata.models import Models

        return Models.load(self.forest, self.ground_classifier, self.policy)
