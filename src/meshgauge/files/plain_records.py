"""Records as plain data for JSON and back, checked against the annotations of their fields.

What comes from a stranger is numbers and texts of the kinds that are expected, or an error; nothing of it is run.
"""

from __future__ import annotations

import base64
import binascii
import types
from collections import Counter
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

T = TypeVar("T")


class NotPlain(ValueError):
    """Data that are not a record of the kind that is expected; the message says where."""


def plain(value: Any, kind: Any = None) -> Any:
    """A value of an annotated kind as dicts, lists, texts and numbers; None: a record, by its own class.

    An array is the text of its bytes in base64. A field annotated `Any` is left out.
    """
    kind = type(value) if kind is None else kind
    origin, arguments = get_origin(kind), get_args(kind)
    if value is None:
        return None
    if kind in (bool, str, int, float):
        return kind(value)
    if origin in (Union, types.UnionType):
        return plain(value, _not_none(arguments))
    if isinstance(kind, type) and is_dataclass(kind):
        return {name: plain(getattr(value, name), hint) for name, hint in _hints(kind).items()}
    if origin is tuple:
        return [plain(one, hint) for one, hint in zip(value, _each(arguments, len(value)), strict=True)]
    if origin is Counter:
        return [[plain(one, arguments[0]), int(n)] for one, n in value.items()]
    if origin is Mapping:
        return [[plain(key, arguments[0]), plain(one, arguments[1])] for key, one in value.items()]
    if origin is np.ndarray:
        return base64.b64encode(np.ascontiguousarray(value, _dtype(kind)).tobytes()).decode("ascii")
    if origin is Literal:
        return value
    raise TypeError(f"a {kind} is not written")  # a field of a kind that is new


def record(data: Any, kind: type[T]) -> T:
    """The record that `plain` made the data of. Raises `NotPlain` if they are of another kind."""
    made: T = _value(data, kind, kind.__name__)
    return made


def _value(data: Any, kind: Any, at: str) -> Any:
    origin, arguments = get_origin(kind), get_args(kind)
    if kind is float and type(data) in (int, float):
        try:
            return float(data)
        except OverflowError as error:  # an integer of more than 308 digits
            raise NotPlain(f"{at} is not of the kind expected") from error
    if kind in (bool, str, int):
        return _checked(data, type(data) is kind, at)
    if origin in (Union, types.UnionType):
        return None if data is None else _value(data, _not_none(arguments), at)
    if isinstance(kind, type) and is_dataclass(kind):
        hints = _hints(kind)
        _checked(data, isinstance(data, dict) and set(data) == set(hints), at)
        return kind(**{name: _value(data[name], hint, f"{at}.{name}") for name, hint in hints.items()})
    if origin is tuple:
        _checked(data, isinstance(data, list) and (arguments[-1] is ... or len(data) == len(arguments)), at)
        return tuple(_value(one, hint, at) for one, hint in zip(data, _each(arguments, len(data)), strict=True))
    if origin is Counter:
        return Counter(_pairs(data, arguments[0], int, at))
    if origin is Mapping:
        return _pairs(data, arguments[0], arguments[1], at)
    if origin is np.ndarray:
        return _array(_checked(data, isinstance(data, str), at), _dtype(kind), at)
    if origin is Literal:
        return _checked(data, data in arguments, at)
    raise NotPlain(f"{at} is not of the kind expected")


def _pairs(data: Any, key: Any, value: Any, at: str) -> dict[Any, Any]:
    _checked(data, isinstance(data, list) and all(isinstance(one, list) and len(one) == 2 for one in data), at)
    return {_value(name, key, at): _value(one, value, f"{at}[{name!r}]") for name, one in data}


def _array(data: str, dtype: np.dtype[Any], at: str) -> Any:
    try:
        values = np.frombuffer(base64.b64decode(data, validate=True), dtype)
    except (binascii.Error, ValueError) as error:
        raise NotPlain(f"{at} is no array") from error
    return values.astype(dtype.newbyteorder("="))


def _checked(data: Any, is_right: bool, at: str) -> Any:
    if not is_right:
        raise NotPlain(f"{at} is not of the kind expected")
    return data


def _not_none(arguments: tuple[Any, ...]) -> Any:
    (kind,) = (one for one in arguments if one is not type(None))
    return kind


def _each(arguments: tuple[Any, ...], n: int) -> tuple[Any, ...]:
    return (arguments[0],) * n if arguments[-1] is ... else arguments


def _dtype(kind: Any) -> np.dtype[Any]:
    (one,) = get_args(get_args(kind)[1])
    dtype: np.dtype[Any] = np.dtype(one).newbyteorder("<")
    return dtype


@cache
def _hints(kind: Any) -> dict[str, Any]:
    """The annotations of the fields of a record that are written."""
    hints = get_type_hints(kind)
    return {field.name: hints[field.name] for field in fields(kind) if hints[field.name] is not Any}
