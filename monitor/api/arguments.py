"""Arguments as people in Python give them, made the types that a request asks for.

Texts, paths, numbers of numpy, arrays, columns of pandas and lists are taken where they mean one thing alone; what does
not is refused in a sentence with its name, never in an exception of Python's own.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
import types
import typing
from collections.abc import Callable, Iterable, Mapping
from enum import Enum
from typing import Any, ParamSpec, TypeVar

import numpy as np

from monitor.api.values import EXAMPLES, SCALARS, is_single, refused, shown
from monitor.exceptions import InputError, did_you_mean

Asked = ParamSpec("Asked")
Answered = TypeVar("Answered")


def argument(name: str, value: Any, kind: Any) -> Any:
    """Return the value of an argument as the type ``kind`` of its annotation. Raises InputError where it is none."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, np.generic) and not isinstance(value, np.datetime64):
        value = value.item()
    if kind in SCALARS:
        return SCALARS[kind](name, value)
    if kind == tuple[float, ...]:
        return _floats(name, value)
    if dataclasses.is_dataclass(kind):
        return _record(name, value, kind)
    if isinstance(kind, type) and issubclass(kind, Enum):
        return value if isinstance(value, kind) else _choice(name, value, {str(m.value): m for m in kind})
    return _composed(name, value, typing.get_origin(kind), typing.get_args(kind))


def _composed(name: str, value: Any, origin: Any, members: tuple[Any, ...]) -> Any:
    """Return a value of a type that is made of others."""
    if origin in (typing.Union, types.UnionType):
        return _of_several(name, value, members)
    if origin is typing.Literal:
        return _choice(name, value, {str(member): member for member in members})
    if not members:
        return value
    if origin is Mapping:
        return _mapping(name, value, *members)
    if origin is tuple and members[-1] is not Ellipsis:
        return _fixed(name, value, members)
    # A text is one text, not a list of its letters; of paths and numbers, too, one is a list of one.
    lone = is_single(value) and members[0] in SCALARS
    each = [value] if lone else _elements(name, value, members[0])
    return tuple(
        argument(name if lone else f"{name}[{index}]", element, members[0])
        for index, element in enumerate(each)
    )


def checked(function: Callable[Asked, Answered]) -> Callable[Asked, Answered]:
    """Let a function refuse what Python would refuse as a TypeError: arguments that it does not have, with the nearest
    one that it has, that are lacking or given twice. Options of a ``**options`` are left to the request."""
    signature = inspect.signature(function)
    parameters = [parameter for parameter in signature.parameters.values() if parameter.name != "self"]
    names = [p.name for p in parameters if p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)]
    takes_options = any(parameter.kind is parameter.VAR_KEYWORD for parameter in parameters)

    @functools.wraps(function)
    def asked(*positional: Asked.args, **named: Asked.kwargs) -> Answered:
        unknown = [name for name in named if name not in names]
        if unknown and not takes_options:
            raise InputError(unknown_option(unknown[0], names))
        try:
            signature.bind(*positional, **named)
        except TypeError as error:
            listed = ", ".join(names) or "none"
            raise InputError(f"{function.__name__}: {error}; its arguments are {listed}") from error
        return function(*positional, **named)

    return asked


def unknown_option(name: str, names: Iterable[str]) -> str:
    """Return the message for an option that there is not, with the nearest and with all that there are."""
    listed = ", ".join(names)
    return f"there is no option '{name}'; {did_you_mean(name, names)}there are {listed or 'none'}"


def _of_several(name: str, value: Any, members: tuple[Any, ...]) -> Any:
    """Return None where it may be, else the value as the alternative that it is, or as the first."""
    kinds = [kind for kind in members if kind is not types.NoneType]
    if value is None and len(kinds) < len(members):
        return None
    is_kind = (kind for kind in kinds if isinstance(kind, type) and isinstance(value, kind))
    return argument(name, value, next(is_kind, kinds[0]))


def _choice(name: str, value: Any, choices: Mapping[str, Any]) -> Any:
    if isinstance(value, str) and value in choices:
        return choices[value]
    listed = ", ".join(f"'{choice}'" for choice in choices)
    hint = did_you_mean(value, choices) if isinstance(value, str) else ""
    raise InputError(f"{name} is one of {listed}, not {shown(value)}{'; ' + hint.strip() if hint else ''}")


def _elements(name: str, value: Any, member: Any) -> list[Any]:
    """Return the elements of a list, an array or a column. Raises InputError for a text, a mapping or a table."""
    single = isinstance(value, (Mapping, set, frozenset)) or is_single(value)
    if single or not isinstance(value, Iterable) or getattr(value, "ndim", 1) != 1:
        raise refused(name, value, f"a list, each {_words(member)}")
    return list(value)


def _words(kind: Any) -> str:
    """What to write for a type, in words."""
    if kind in EXAMPLES:
        return EXAMPLES[kind]
    if dataclasses.is_dataclass(kind):
        fields = [
            field.name if _is_needed(field) else f"[{field.name}]" for field in dataclasses.fields(kind)
        ]
        return f"({', '.join(fields)})"
    if typing.get_origin(kind) is tuple and typing.get_args(kind)[-1] is not Ellipsis:
        return f"{len(typing.get_args(kind))} values"
    return "a value"


def _is_needed(field: dataclasses.Field[Any]) -> bool:
    return field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING


def _floats(name: str, value: Any) -> tuple[float, ...]:
    """Return one finite number or several."""
    try:
        if not isinstance(value, (str, bytes, Mapping, set, frozenset, bool)):
            values = np.atleast_1d(np.asarray(value))
            if values.dtype.kind in "iuf" and values.ndim == 1 and np.isfinite(values).all():
                return tuple(values.astype(np.float64).tolist())
    except (TypeError, ValueError):
        pass  # said below, with all else that is no number
    raise refused(name, value, EXAMPLES[tuple[float, ...]])


def _fixed(name: str, value: Any, members: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return as many values as the type has."""
    count = len(members)
    example = f"{count} values, each {_words(members[0])}"
    if is_single(value) or isinstance(value, (Mapping, set, frozenset)) or not isinstance(value, Iterable):
        raise refused(name, value, example)
    elements = list(value)
    if len(elements) != count:
        raise InputError(f"{name} is {example}, not {len(elements)}: {shown(value)}")
    pairs = zip(elements, members, strict=True)
    return tuple(argument(f"{name}[{i}]", element, kind) for i, (element, kind) in enumerate(pairs))


def _mapping(name: str, value: Any, key_kind: Any, kind: Any) -> dict[Any, Any]:
    if not isinstance(value, Mapping):
        raise refused(name, value, f"a dict of names, each with {_words(kind)}")
    return {
        argument(f"the name {shown(key)} in {name}", key, key_kind): argument(
            f"{name}[{key!r}]", element, kind
        )
        for key, element in value.items()
    }


def _record(name: str, value: Any, kind: Any) -> Any:
    """Return a record of a request: itself, its fields in their order, or by name."""
    if isinstance(value, kind):
        return value
    fields = {field.name: field for field in dataclasses.fields(kind) if field.init}
    example = f"{kind.__name__} or {_words(kind)}"
    if isinstance(value, Mapping):
        by_field = {str(key): element for key, element in value.items()}
    elif is_single(value) or isinstance(value, (set, frozenset)) or not isinstance(value, Iterable):
        raise refused(name, value, example)
    else:
        elements = list(value)
        if len(elements) > len(fields):
            raise refused(name, value, example)
        by_field = dict(zip(fields, elements, strict=False))
    for key in by_field:
        if key not in fields:
            raise InputError(f"{name}: {unknown_option(key, fields)}")
    if any(_is_needed(field) and key not in by_field for key, field in fields.items()):
        raise refused(name, value, example)
    hints = typing.get_type_hints(kind)
    return kind(**{key: argument(f"{name}.{key}", element, hints[key]) for key, element in by_field.items()})
