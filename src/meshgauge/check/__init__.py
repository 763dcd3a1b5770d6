"""The gate: rules that a mesh must keep, and what breaks them.

Names are loaded on use: every command reads the settings, few judge.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from .._lazy import door

if TYPE_CHECKING:
    from .baseline import Baseline as Baseline
    from .grammar import rule as rule
    from .judge import LISTED as LISTED
    from .judge import check as check
    from .judge import default_rules as default_rules
    from .judge import metrics_of as metrics_of
    from .outcome import Change as Change
    from .outcome import Check as Check
    from .outcome import FailingCell as FailingCell
    from .outcome import Outcome as Outcome
    from .outcome import State as State
    from .partials import check_partials as check_partials
    from .partials import counting as counting
    from .rules import Level as Level
    from .rules import Nothing as Nothing
    from .rules import NoWorse as NoWorse
    from .rules import Rule as Rule
    from .rules import Threshold as Threshold

_HOME = {
    "Baseline": "baseline",
    "rule": "grammar",
    "LISTED": "judge",
    "check": "judge",
    "default_rules": "judge",
    "metrics_of": "judge",
    "Change": "outcome",
    "Check": "outcome",
    "FailingCell": "outcome",
    "Outcome": "outcome",
    "State": "outcome",
    "check_partials": "partials",
    "counting": "partials",
    "Level": "rules",
    "Nothing": "rules",
    "NoWorse": "rules",
    "Rule": "rules",
    "Threshold": "rules",
}
"""The module of each public name."""

__all__ = sorted(_HOME)

if not TYPE_CHECKING:  # to type checkers a name that is not imported above is an error
    __getattr__, __dir__ = door(__name__, _HOME)
