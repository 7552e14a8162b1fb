"""Values that are kept for when they are needed again."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from functools import wraps
from typing import Concatenate, Generic, ParamSpec, TypeVar
from weakref import WeakKeyDictionary

Value = TypeVar("Value")
Owner = TypeVar("Owner")
Others = ParamSpec("Others")


class Kept(Generic[Value]):
    """The values of the keys that were asked for last.

    Args:
        most: how many there may be.
        outdated: whether a value that is kept has to be made again.
    """

    def __init__(self, most: int, outdated: Callable[[Value], bool] = lambda _: False) -> None:
        self._most, self._outdated = most, outdated
        self._values: OrderedDict[Hashable, Value] = OrderedDict()

    def of(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """Return the value of a key, made if it is not kept."""
        if key not in self._values or self._outdated(self._values[key]):
            self._values[key] = make()
        self._values.move_to_end(key)
        if len(self._values) > self._most:
            self._values.popitem(last=False)
        return self._values[key]


class Identity:
    """A key that equals another one where all their parts are the same objects.

    Args:
        parts: of the key; they live as long as it does.
    """

    def __init__(self, *parts: object) -> None:
        self.parts = parts

    def __hash__(self) -> int:
        return hash(tuple(map(id, self.parts)))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Identity) or len(self.parts) != len(other.parts):
            return False
        return all(one is another for one, another in zip(self.parts, other.parts, strict=True))


def kept_with_first(
    function: Callable[Concatenate[Owner, Others], Value],
) -> Callable[Concatenate[Owner, Others], Value]:
    """Keep the values of a function as long as its first argument lives.

    Args:
        function: of an object that is equal to itself alone, and of further hashable arguments; its values do not refer
            to that object.
    """
    kept: WeakKeyDictionary[Owner, dict[Hashable, Value]] = WeakKeyDictionary()

    @wraps(function)
    def value(owner: Owner, *others: Others.args, **named: Others.kwargs) -> Value:
        own, key = kept.setdefault(owner, {}), (others, tuple(sorted(named.items())))
        if key not in own:
            own[key] = function(owner, *others, **named)
        return own[key]

    return value
