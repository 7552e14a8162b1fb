"""Check what callers hand to public functions and values, by the annotations of their parameters."""

from __future__ import annotations

import collections.abc
import functools
import inspect
import math
import numbers
import os
import sys
import types
import typing
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, TypeVar, Union, get_args, get_origin

import numpy as np

from fesd_robot.errors import OptionError

Checked = TypeVar("Checked", bound=Callable[..., Any])

_WORDS = {
    float: "a number",
    int: "a whole number",
    bool: "True or False",
    str: "a text",
    Path: "a path",
    np.ndarray: "numbers or an array of them",
    type(None): "None",
}


def checked(public: Checked, *, exact: bool = False) -> Checked:
    """Decorate a public function, or a dataclass, so that arguments of other types than its annotations' are refused.

    Arguments are looked at, never converted. Numbers may be those of NumPy, and stand for arrays; NaN is no number.
    Annotations that only type checkers know, and the entries of arrays, are not looked at.

    Args:
        public: what is decorated.
        exact: whether arguments are kept as they are handed. Otherwise numbers may stand for arrays, what is no
            expression of CasADi is left to the function, and so are texts that are none of those allowed.

    Raises:
        OptionError: where the decorated is called so, or with too few arguments, too many, or an unknown name.
    """
    if isinstance(public, type):
        names = sys.modules[public.__module__].__dict__
        initialise = _called_checked(vars(public)["__init__"], public.__name__, names, exact)
        type.__setattr__(public, "__init__", initialise)
        return public
    return typing.cast(Checked, _called_checked(public, public.__name__, inspect.unwrap(public).__globals__, exact))


def _called_checked(function: Callable[..., Any], name: str, names: dict[str, Any], exact: bool) -> Callable[..., Any]:
    signature = inspect.signature(function)

    @functools.lru_cache(maxsize=1)
    def hints() -> dict[str, Any]:
        return {key: _resolved(one.annotation, names) for key, one in signature.parameters.items() if _is_single(one)}

    @functools.wraps(function)
    def call(*arguments: Any, **options: Any) -> Any:
        try:
            given = signature.bind(*arguments, **options).arguments
        except TypeError as error:
            raise OptionError(f"{name}: {error}, expected {', '.join(signature.parameters)}") from None
        for key, hint in hints().items():
            if key not in given or given[key] is signature.parameters[key].default:
                continue
            if not _fits(given[key], hint, exact):
                raise OptionError(f"{name}: {key}: found {_described(given[key])}, expected {_in_words(hint)}")
        return function(*arguments, **options)

    return call


def _is_single(parameter: inspect.Parameter) -> bool:
    """Return whether a parameter has an annotation that is about one argument."""
    several = parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD)
    return not several and parameter.annotation is not parameter.empty


def _resolved(annotation: Any, names: dict[str, Any]) -> Any:
    """Return what an annotation stands for; Any where only type checkers know it."""
    holder = types.SimpleNamespace(__annotations__={"one": annotation})
    try:
        return typing.get_type_hints(holder, globalns=names)["one"]
    except NameError:
        return Any


def _fits(value: Any, hint: Any, exact: bool) -> bool:
    """Return whether a value is one that an annotation allows."""
    kind, parts = get_origin(hint) or hint, get_args(hint)
    if kind in (Union, types.UnionType):
        return any(_fits(value, part, exact) for part in parts)
    if kind is Literal:
        return (isinstance(value, str) and not exact) or (isinstance(value, str | int) and value in parts)
    if kind is collections.abc.Callable:
        return callable(value)
    if kind in _SIMPLE and not (exact and kind is np.ndarray):
        return _SIMPLE[kind](value)
    if not isinstance(kind, type):
        return True
    if getattr(kind, "_is_protocol", False):
        return all(hasattr(value, name) for name in vars(kind) if not name.startswith("_"))
    if issubclass(kind, Mapping):
        pairs = value.items() if isinstance(value, Mapping) else ()
        keys, values = parts or (Any, Any)
        return isinstance(value, Mapping) and all(
            _fits(key, keys, exact) and _fits(one, values, exact) for key, one in pairs
        )
    if issubclass(kind, collections.abc.Iterable) and parts:
        return _are(value, kind, parts, exact)
    return isinstance(value, kind) or (kind.__module__.startswith("casadi") and not exact)


def _are(values: Any, kind: type, parts: tuple[Any, ...], exact: bool) -> bool:
    """Return whether values are a list, each entry one that an annotation allows; an array of numbers is one, too."""
    if isinstance(values, np.ndarray):
        return parts[0] in (float, int) and values.ndim == 1 and all(map(_SIMPLE[parts[0]], values[:1]))
    if isinstance(values, str | bytes) or not isinstance(values, Sequence):
        return False
    if issubclass(kind, tuple) and parts[-1] is not Ellipsis:
        entries = zip(values, parts, strict=False)
        return len(values) == len(parts) and all(_fits(value, part, exact) for value, part in entries)
    return all(_fits(value, parts[0], exact) for value in values)


def _is_number(value: Any) -> bool:
    return isinstance(value, numbers.Real) and not isinstance(value, bool | np.bool_) and not math.isnan(value)


def _is_numeric(value: Any) -> bool:
    """Return whether a value is a number, an array of numbers, or lists of them."""
    try:
        return value is not None and np.asarray(value).dtype.kind in "biuf"
    except Exception:  # NumPy asks the value itself, which may raise anything
        return False


_SIMPLE: Mapping[Any, Callable[[Any], bool]] = {
    Any: lambda value: True,
    type(None): lambda value: value is None,
    float: _is_number,
    int: lambda value: isinstance(value, numbers.Integral) and not isinstance(value, bool),
    bool: lambda value: isinstance(value, bool | np.bool_),
    str: lambda value: isinstance(value, str) and "\0" not in value,
    Path: lambda value: isinstance(value, Path) and "\0" not in os.fspath(value),
    np.ndarray: _is_numeric,
}
"""Annotation -> whether a value is one."""


def _in_words(hint: Any) -> str:
    """Return what an annotation allows."""
    kind, parts = get_origin(hint) or hint, get_args(hint)
    if kind in (Union, types.UnionType):
        if set(parts) >= {str, Path}:
            parts = (Path, *(part for part in parts if part not in (str, Path)))
        return " or ".join(map(_in_words, parts))
    if kind is Literal:
        return " or ".join(map(repr, parts))
    if kind is collections.abc.Callable:
        return "a function"
    if kind in _WORDS:
        return _WORDS[kind]
    if isinstance(kind, type) and issubclass(kind, Mapping):
        return f"a mapping of {_in_words(parts[0])} to {_in_words(parts[1])}" if parts else "a mapping"
    if isinstance(kind, type) and issubclass(kind, collections.abc.Iterable) and parts:
        if issubclass(kind, tuple) and parts[-1] is not Ellipsis:
            return f"({', '.join(map(_in_words, parts))})"
        return f"a list, each entry {_in_words(parts[0])}"
    name = getattr(kind, "__name__", str(kind))
    return f"{'an' if name[0] in 'AEIOU' else 'a'} {name}"


def _described(value: Any) -> str:
    """Return what was found, in a few words."""
    if isinstance(value, str):
        return f"the text {_short(value)}"
    if isinstance(value, np.ndarray):
        return f"an array of {value.dtype} of shape {value.shape}"
    if value is None or isinstance(value, numbers.Number | list | tuple | dict):
        return _short(value)
    return f"a value of type {type(value).__name__}" if not isinstance(value, type) else f"the class {value.__name__}"


def _short(value: Any) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else f"{text[:57]}..."
