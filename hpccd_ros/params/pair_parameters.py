# SPDX-License-Identifier: Apache-2.0
"""What the parameters say of pairs of meshes: as lists of NAME:NAME:VALUE, and as pairs.NAME.*, side by side."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from hpccd_core.options import ACCURACIES, FEATURES
from hpccd_ros.base.quoting import listed, quoted
from hpccd_ros.detect.separation import Separation
from hpccd_ros.params.table import FARTHEST, PAIRS
from hpccd_ros.params.values import ParameterError


@dataclass(frozen=True)
class _Said:
    """``value``: of the two meshes ``names``, said by ``parameter`` in this ``text``."""

    parameter: str
    text: str
    names: tuple[str, str]
    value: Any


def check(settings: dict[str, Any]) -> None:
    """Raises ParameterError: an unknown mesh, tier, kind or distance, or two that contradict each other."""
    ignored_pairs(settings)
    pair_accuracies(settings)
    pair_features(settings)
    separation(settings)


def ignored_pairs(settings: dict[str, Any]) -> tuple[tuple[str, str], ...]:
    """Parameters ``ignored_pairs`` and ``pairs.NAME.ignored`` as pairs of mesh names. Raises ParameterError."""
    said = []
    for text in settings["ignored_pairs"]:
        pair = tuple(text.split(":"))
        if len(pair) != 2 or not set(pair) <= set(settings["meshes"]) or pair[0] == pair[1]:
            raise ParameterError(
                f"ignored_pairs: {quoted(text)} must be NAME:NAME with two different meshes out of {_names(settings)}"
            )
        said.append(_Said("ignored_pairs", text, pair, True))
    for one in _structured(settings, "ignored"):
        if one.names[0] == one.names[1]:
            raise ParameterError(
                f"{one.parameter}: both meshes of the pair are {one.names[0]}; whether a mesh is tested against "
                f"itself is said by mesh.{one.names[0]}.self_collision"
            )
        said.append(one)
    return tuple(one.names for one in _agreed(said) if one.value)


def pair_accuracies(settings: dict[str, Any]) -> tuple[tuple[str, str, str], ...]:
    """Parameters ``pair_accuracy`` and ``pairs.NAME.accuracy`` as (mesh name, mesh name, tier). Raises
    ParameterError."""
    said = []
    for text in settings["pair_accuracy"]:
        *names, tier = text.split(":")
        if len(names) != 2 or not set(names) <= set(settings["meshes"]) or tier not in ACCURACIES:
            raise ParameterError(
                f"pair_accuracy: {quoted(text)} must be NAME:NAME:TIER with meshes out of {_names(settings)} "
                f"and a tier out of {', '.join(ACCURACIES)}"
            )
        said.append(_Said("pair_accuracy", text, tuple(names), tier))
    return tuple((*one.names, one.value) for one in _agreed([*said, *_structured(settings, "accuracy")]))


def pair_features(settings: dict[str, Any]) -> tuple[tuple[str, str, tuple[str, ...]], ...]:
    """Parameters ``pair_features`` and ``pairs.NAME.features`` as (mesh name, mesh name, features); entries of the
    first about one pair add up. Raises ParameterError."""
    listed_kinds: dict[frozenset[str], tuple[list[str], tuple[str, str], set[str]]] = {}
    for text in settings["pair_features"]:
        *names, kind = text.split(":")
        if len(names) != 2 or not set(names) <= set(settings["meshes"]) or kind not in FEATURES:
            raise ParameterError(
                f"pair_features: {quoted(text)} must be NAME:NAME:KIND with meshes out of {_names(settings)} "
                f"and a kind out of {', '.join(FEATURES)}"
            )
        texts, _, kinds = listed_kinds.setdefault(frozenset(names), ([], tuple(names), set()))
        texts.append(text)
        kinds.add(kind)
    said = [_Said("pair_features", ", ".join(texts), *rest) for texts, *rest in listed_kinds.values()]
    said += [_Said(o.parameter, o.text, o.names, set(o.value)) for o in _structured(settings, "features")]
    return tuple((*one.names, tuple(name for name in FEATURES if name in one.value)) for one in _agreed(said))


def separation(settings: dict[str, Any]) -> Separation:
    """Parameters ``minimum_separation``, ``pair_separation`` and ``pairs.NAME.separation``. Raises ParameterError."""
    said = []
    for text in settings["pair_separation"]:
        *names, number = text.split(":")
        distance = _distance(number)
        if len(names) != 2 or not set(names) <= set(settings["meshes"]) or distance is None:
            raise ParameterError(
                f"pair_separation: {quoted(text)} must be NAME:NAME:DISTANCE with meshes out of {_names(settings)} "
                f"and a distance from 0 to {FARTHEST:g}"
            )
        said.append(_Said("pair_separation", text, tuple(names), distance))
    agreed = _agreed([*said, *_structured(settings, "separation")])
    return Separation(settings["minimum_separation"], tuple((*one.names, one.value) for one in agreed))


def _distance(text: str) -> float | None:
    try:
        number = float(text)
    except ValueError:
        return None
    return number if 0 <= number <= FARTHEST else None


def _structured(settings: dict[str, Any], key: str) -> Iterator[_Said]:
    """Of the parameters pairs.NAME.key those that say something."""
    for pair, of in settings[PAIRS].items():
        names = of["meshes"]
        if len(names) != 2 or not set(names) <= set(settings["meshes"]):
            raise ParameterError(
                f"{PAIRS}.{pair}.meshes: {quoted(names)} must be two names out of {_names(settings)}; the same name "
                "twice means within this mesh"
            )
        value = of[key]
        if value is not None and value not in ("", []):
            yield _Said(f"{PAIRS}.{pair}.{key}", str(value), tuple(names), value)


def _agreed(said: Iterable[_Said]) -> list[_Said]:
    """One for each pair of meshes. Raises ParameterError where two differ."""
    found: dict[frozenset[str], _Said] = {}
    for one in said:
        first = found.setdefault(frozenset(one.names), one)
        if first.value != one.value:
            place = "" if first.parameter == one.parameter else f"{first.parameter}: "
            raise ParameterError(
                f"{one.parameter}: {quoted(one.text)} contradicts {place}{quoted(first.text)}; leave one out"
            )
    return list(found.values())


def _names(settings: dict[str, Any]) -> str:
    return listed(settings["meshes"]) or "(none)"
