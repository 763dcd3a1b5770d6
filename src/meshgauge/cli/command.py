"""A function as a subcommand: with its text, and with its groups of options as options."""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Callable
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from importlib import import_module
from types import ModuleType
from typing import Any, get_type_hints

import typer
from typer.core import TyperCommand, TyperGroup

from ..look.names import meant_or_known
from .texts import TEXTS


class _Command(TyperCommand):
    """A subcommand, the help of which says nothing of types where there is nothing to say."""

    def get_params(self, ctx: Any) -> list[Any]:
        return [_taken_as_given(_without_type(one)) for one in super().get_params(ctx)]

    def format_help(self, ctx: Any, formatter: Any) -> None:
        _load_help()
        super().format_help(ctx, formatter)


class Commands(TyperGroup):
    """All of them, likewise."""

    def get_params(self, ctx: Any) -> list[Any]:
        return [_taken_as_given(_without_type(one)) for one in super().get_params(ctx)]

    def format_help(self, ctx: Any, formatter: Any) -> None:
        _load_help()
        super().format_help(ctx, formatter)


_UNUSED = (("rich.markdown", "Markdown"), ("rich.traceback", "Traceback"))
"""What Typer's help loads and ours has no use for: a quarter of the time of a help."""


def _load_help() -> None:
    """Load Typer's help with stand-ins for what is unused."""
    if "typer.rich_utils" in sys.modules:
        return
    stand_ins = {}
    for module, name in _UNUSED:
        if module not in sys.modules:
            stand_ins[module] = ModuleType(module)
            setattr(stand_ins[module], name, type(name, (), {}))
    sys.modules.update(stand_ins)
    try:
        import_module("typer.rich_utils")
    except ImportError:  # another version needs more of them; Typer loads it again as a whole
        sys.modules.pop("typer.rich_utils", None)
    finally:
        for module in stand_ins:
            sys.modules.pop(module, None)


def _without_type(parameter: Any) -> Any:
    """A flag, or an argument, whose name says what it is: Typer would print ``<bool>`` and ``<list[str]>``."""
    if getattr(parameter, "is_flag", False) or parameter.param_type_name == "argument":
        parameter.display_type_rich = _nothing
    return parameter


def _taken_as_given(parameter: Any) -> Any:
    """An option that is not given, a default and text are what they are: Typer would load Pydantic to find that out.

    Which takes longer than to read and to measure a small mesh. Older versions do without Pydantic; they have no such
    descriptor of a type.
    """
    annotation = getattr(getattr(parameter, "type_descriptor", None), "annotation", None)
    if annotation is None or "process_value" in vars(parameter):
        return parameter
    convert, is_list = parameter.process_value, parameter.multiple or parameter.nargs == -1

    def process_value(ctx: Any, value: Any) -> Any:
        if value is None and not parameter.required:
            value = () if is_list else None
        elif annotation == list[str] and value and all(type(one) is str for one in value):
            value = list(value)
        elif type(value) is not annotation:
            return convert(ctx, value)
        return value if parameter.callback is None else parameter.callback(ctx, parameter, value)

    parameter.process_value = process_value
    return parameter


_CHOICES = re.compile(r"(?:Value error, )?'([^']*)' is not one of ('[^']*'(?:, '[^']*')*)\.?")
_WORDS = (
    (r"Value error, ", ""),
    (r"Input should be a valid integer(?:, .*?)?(?=$|\.? \()", "expected a whole number"),
    (r"Input should be a valid number(?:, .*?)?(?=$|\.? \()", "expected a number"),
    (r"Input should be greater than or equal to (\S+)", r"expected \1 or more"),
    (r"Input should be less than or equal to (\S+)", r"expected \1 at most"),
)
"""What a library says of a wrong value, and what we do."""


def in_plain_words(text: str) -> str:
    """A usage error in the words of all other errors; of a choice that there is not, what may be meant."""

    def choice(match: re.Match[str]) -> str:
        known = re.findall("'([^']*)'", match[2])
        return f"there is no {match[1]!r}{meant_or_known(match[1], known)}"

    text = _CHOICES.sub(choice, text)
    for theirs, ours in _WORDS:
        text = re.sub(theirs, ours, text)
    return text


def _nothing(ctx: Any) -> None:
    """No type."""


def add(app: typer.Typer, function: Callable[..., int | None]) -> None:
    """Add a subcommand of the name of the function. What its help says is the row of that name in `TEXTS`."""
    name = function.__name__.replace("_", "-")
    text = TEXTS[name]
    call = unfold(function)
    examples = ["[bold]Examples[/bold]", *(f"  {line}" for line in text.examples)] if text.examples else []
    app.command(
        name=name,
        cls=_Command,
        help=text.full,
        short_help=text.short,
        epilog="\n\n".join(examples),
        no_args_is_help=any(p.default is p.empty for p in inspect.signature(call).parameters.values()),
    )(call)


def unfold(function: Callable[..., int | None]) -> Callable[..., int | None]:
    """The function with the fields of each group (a dataclass of options) as parameters in the place of the group."""
    hints = get_type_hints(function, include_extras=True)
    groups = {name: kind for name, kind in hints.items() if is_dataclass(kind) and isinstance(kind, type)}
    parameters: list[inspect.Parameter] = []
    for name, parameter in inspect.signature(function).parameters.items():
        if name in groups:
            parameters += _parameters(groups[name])
        else:
            parameters.append(parameter.replace(kind=parameter.KEYWORD_ONLY, annotation=hints[name]))

    def call(**values: Any) -> int | None:
        for name, kind in groups.items():
            values[name] = kind(**{field.name: values.pop(field.name) for field in fields(kind)})
        return function(**values)

    call.__name__, call.__doc__ = function.__name__, function.__doc__
    vars(call)["__signature__"] = inspect.Signature(parameters)  # what inspect looks at first
    call.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return call


@cache
def _parameters(kind: type[Any]) -> tuple[inspect.Parameter, ...]:
    """A parameter for each field of a group."""
    hints = get_type_hints(kind, include_extras=True)
    return tuple(
        inspect.Parameter(
            field.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if field.default is MISSING else field.default,
            annotation=hints[field.name],
        )
        for field in fields(kind)
    )
