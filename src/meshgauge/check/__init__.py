"""The gate: rules that a mesh must keep, and what breaks them."""

from .baseline import Baseline
from .grammar import rule
from .judge import LISTED, check, default_rules, metrics_of
from .outcome import Change, Check, FailingCell, Outcome, State
from .rules import Level, Nothing, NoWorse, Rule, Threshold

__all__ = [
    "LISTED",
    "Baseline",
    "Change",
    "Check",
    "FailingCell",
    "Level",
    "NoWorse",
    "Nothing",
    "Outcome",
    "Rule",
    "State",
    "Threshold",
    "check",
    "default_rules",
    "metrics_of",
    "rule",
]
