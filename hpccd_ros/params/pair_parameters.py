# SPDX-License-Identifier: Apache-2.0
"""Parameters of pairs of meshes: lists of NAME:NAME:VALUE, and pairs.NAME.*, which may be mixed.

The name of a robot means all of its links, and twice the same robot any two of them; a setting of a link has priority
over that of its robot. The links of a robot are known once its description has arrived: ``links`` (robot -> meshes of
its links) has known robots, and settings of others have no effect yet.
"""

import importlib.util
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

from hpccd_core.options import ACCURACIES, FEATURES
from hpccd_ros.base.quoting import listed, quoted, shortened, suggestion
from hpccd_ros.detect.separation import Separation
from hpccd_ros.params.table import FARTHEST, PAIRS
from hpccd_ros.params.values import ParameterError

_NO_COLONS = re.compile(r"\s*[,;\s]\s*")


@dataclass(frozen=True)
class _PairSetting:
    """``value``: for the two meshes or robots ``names``, from ``parameter`` with this ``text``."""

    parameter: str
    text: str
    names: tuple[str, str]
    value: Any


Links = Mapping[str, Sequence[str]]
NO_LINKS: Links = {}


def check(settings: dict[str, Any], links: Links = NO_LINKS) -> None:
    """Raises ParameterError: an unknown mesh, link, tier, kind or distance, or two that contradict each other."""
    ignored_pairs(settings, links)
    pair_accuracies(settings, links)
    pair_features(settings, links)
    separation(settings, links)
    thickness(settings, links)
    stop_detail(settings, links)


def ignored_pairs(
    settings: dict[str, Any], links: Links = NO_LINKS, by_default: Iterable[tuple[str, str]] = ()
) -> tuple[tuple[str, str], ...]:
    """Parameters ``ignored_pairs`` and ``pairs.NAME.ignored`` as pairs of mesh names. Pairs in ``by_default`` (names in
    sorted order) are ignored too, unless the parameters say otherwise. Raises ParameterError."""
    given = []
    for text in settings["ignored_pairs"]:
        pair = tuple(text.split(":"))
        if not _are_names(settings, pair) or (pair[0] == pair[1] and pair[0] not in settings["robots"]):
            raise ParameterError(
                f"ignored_pairs: {quoted(text)} must be NAME:NAME with two different meshes out of {_names(settings)}"
                f"{_meant(settings, pair, text)}"
            )
        given.append(_PairSetting("ignored_pairs", text, pair, True))
    for one in _structured(settings, "ignored"):
        if one.names[0] == one.names[1] and one.names[0] not in settings["robots"]:
            raise ParameterError(
                f"{one.parameter}: both meshes of the pair are {one.names[0]}; to switch off tests within a mesh set "
                f"mesh.{one.names[0]}.self_collision: false"
            )
        given.append(one)
    ignored = {pair: pair for pair in by_default}
    for one in _spread(_agreed(given), settings, links):
        pair = min(one.names), max(one.names)
        if one.value:
            ignored.setdefault(pair, one.names)
        else:
            ignored.pop(pair, None)
    return tuple(ignored.values())


def pair_accuracies(settings: dict[str, Any], links: Links = NO_LINKS) -> tuple[tuple[str, str, str], ...]:
    """Parameters ``pair_accuracy`` and ``pairs.NAME.accuracy`` as (mesh name, mesh name, tier). Raises
    ParameterError."""
    given = []
    for text in settings["pair_accuracy"]:
        *names, tier = text.split(":")
        if not _are_names(settings, names) or tier not in ACCURACIES:
            raise ParameterError(
                f"pair_accuracy: {quoted(text)} must be NAME:NAME:TIER with meshes out of {_names(settings)} "
                f"and a tier out of {', '.join(ACCURACIES)}{_meant(settings, names, text)}"
            )
        given.append(_PairSetting("pair_accuracy", text, tuple(names), tier))
    agreed = _agreed([*given, *_structured(settings, "accuracy")])
    _reject_planes(agreed, settings, "the tier: planes are always exact")
    return tuple((*one.names, one.value) for one in _spread(agreed, settings, links))


def pair_features(settings: dict[str, Any], links: Links = NO_LINKS) -> tuple[tuple[str, str, tuple[str, ...]], ...]:
    """Parameters ``pair_features`` and ``pairs.NAME.features`` as (mesh name, mesh name, features); entries of the
    first about one pair add up. Raises ParameterError."""
    listed_kinds: dict[frozenset[str], tuple[list[str], tuple[str, str], set[str]]] = {}
    for text in settings["pair_features"]:
        *names, kind = text.split(":")
        if not _are_names(settings, names) or kind not in FEATURES:
            raise ParameterError(
                f"pair_features: {quoted(text)} must be NAME:NAME:KIND with meshes out of {_names(settings)} "
                f"and a kind out of {', '.join(FEATURES)}{_meant(settings, names, text)}"
            )
        texts, _, kinds = listed_kinds.setdefault(frozenset(names), ([], tuple(names), set()))
        texts.append(text)
        kinds.add(kind)
    given = [_PairSetting("pair_features", ", ".join(texts), *rest) for texts, *rest in listed_kinds.values()]
    given += [_PairSetting(o.parameter, o.text, o.names, set(o.value)) for o in _structured(settings, "features")]
    agreed = _agreed(given)
    _reject_planes(agreed, settings, "the features: vertices are tested against planes whatever the features are")
    return tuple(
        (*one.names, tuple(name for name in FEATURES if name in one.value)) for one in _spread(agreed, settings, links)
    )


def separation(settings: dict[str, Any], links: Links = NO_LINKS) -> Separation:
    """Parameters ``minimum_separation``, ``pair_separation`` and ``pairs.NAME.separation``. Raises ParameterError."""
    given = []
    for text in settings["pair_separation"]:
        *names, number = text.split(":")
        distance = _distance(number)
        if not _are_names(settings, names) or distance is None:
            raise ParameterError(
                f"pair_separation: {quoted(text)} must be NAME:NAME:DISTANCE with meshes out of {_names(settings)} "
                f"and a distance from 0 to {FARTHEST:g} in the unit of the vertices{_meant(settings, names, text)}"
            )
        given.append(_PairSetting("pair_separation", text, tuple(names), distance))
    agreed = _agreed([*given, *_structured(settings, "separation")])
    spread = _spread(agreed, settings, links)
    return Separation(settings["minimum_separation"], tuple((*one.names, one.value) for one in spread))


def stop_detail(settings: dict[str, Any], links: Links = NO_LINKS) -> tuple[tuple[str, float], ...]:
    """Parameter ``stop_detail`` as (mesh name, ratio). Raises ParameterError."""
    if settings["stop_detail"] and importlib.util.find_spec("fast_simplification") is None:
        raise ParameterError("stop_detail: needs the package fast-simplification; run pip install fast-simplification")
    found = _of_meshes(settings, links, "stop_detail", "RATIO", "a ratio above 0 and below 1", lambda x: 0 < x < 1)
    if of_points := [name for name, _ in found if name in settings["points"]]:
        raise ParameterError(f"stop_detail: {of_points[0]!r} has points and no faces; leave it out")
    return found


def _reject_planes(agreed: Iterable[_PairSetting], settings: dict[str, Any], what: str) -> None:
    for one in agreed:
        if plane := next((name for name in one.names if name in settings["planes"]), None):
            raise ParameterError(f"{one.parameter}: {quoted(one.text)}: {quoted(plane)} is a plane; leave out {what}")


def thickness(settings: dict[str, Any], links: Links = NO_LINKS) -> tuple[tuple[str, float], ...]:
    """Parameter ``thickness`` as (mesh name, thickness). Raises ParameterError."""
    what = f"a number from 0 to {FARTHEST:g} in the unit of the vertices"
    return _of_meshes(settings, links, "thickness", "THICKNESS", what, lambda x: 0 <= x <= FARTHEST)


def _of_meshes(
    settings: dict[str, Any], links: Links, parameter: str, value: str, what: str, usable: Callable[[float], bool]
) -> tuple[tuple[str, float], ...]:
    """A parameter with entries NAME:VALUE as (mesh name, number); a link's own has priority over that of its robot.
    Raises ParameterError."""
    given: dict[str, tuple[str, float]] = {}
    for text in settings[parameter]:
        name, _, word = text.rpartition(":")
        number = _number(word)
        if not _is_name(settings, name) or name in settings["planes"] or number is None or not usable(number):
            meant = _meant(settings, [name], text)
            if name in settings["planes"]:
                meant = f"; {quoted(name)} is a plane, which has none: shift its offset, or use pair_separation"
            raise ParameterError(
                f"{parameter}: {quoted(text)} must be NAME:{value} with a mesh out of "
                f"{_names(settings, of_planes=False)} and "
                f"{what}{meant}"
            )
        first = given.setdefault(name, (text, number))
        if first[1] != number:
            raise ParameterError(f"{parameter}: {quoted(text)} contradicts {quoted(first[0])}; leave one out")
    found: dict[str, float] = {}
    for name in sorted(given, key=lambda name: name not in settings["robots"]):
        text, number = given[name]
        one = _PairSetting(parameter, text, (name, name), number)
        found.update(dict.fromkeys(_meshes(name, one, settings, links), number))
    return tuple(found.items())


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _distance(text: str) -> float | None:
    number = _number(text)
    return number if number is not None and 0 <= number <= FARTHEST else None


def _structured(settings: dict[str, Any], key: str) -> Iterator[_PairSetting]:
    """The parameters pairs.NAME.key that are set."""
    for pair, of in settings[PAIRS].items():
        names = of["meshes"]
        if not _are_names(settings, names):
            raise ParameterError(
                f"{PAIRS}.{pair}.meshes: {quoted(names)} must be two names out of {_names(settings)}; the same name "
                f"twice means within this mesh{_meant(settings, names)}"
            )
        value = of[key]
        if value is not None and value not in ("", []):
            yield _PairSetting(f"{PAIRS}.{pair}.{key}", str(value), tuple(names), value)


def _agreed(given: Iterable[_PairSetting]) -> list[_PairSetting]:
    """One for each pair of meshes. Raises ParameterError if two differ."""
    found: dict[frozenset[str], _PairSetting] = {}
    for one in given:
        first = found.setdefault(frozenset(one.names), one)
        if first.value != one.value:
            place = "" if first.parameter == one.parameter else f"{first.parameter}: "
            raise ParameterError(
                f"{one.parameter}: {quoted(one.text)} contradicts {place}{quoted(first.text)}; leave one out"
            )
    return list(found.values())


def _spread(agreed: Sequence[_PairSetting], settings: dict[str, Any], links: Links) -> list[_PairSetting]:
    """With the links of robots instead of their names. Raises ParameterError: a robot has no such link, or two
    different settings, each of a robot and a link, apply to a pair without a setting of its own."""

    def robots(one: _PairSetting) -> int:
        return sum(name in settings["robots"] for name in one.names)

    found: dict[frozenset[str], _PairSetting] = {}
    given_by: dict[frozenset[str], _PairSetting] = {}
    clashes: dict[frozenset[str], tuple[_PairSetting, _PairSetting]] = {}
    # Settings of robots first: those that name one link or both then replace them.
    for one in sorted(agreed, key=lambda one: -robots(one)):
        within_robot = one.names[0] == one.names[1] and one.names[0] in settings["robots"]
        for a, b in product(*(_meshes(name, one, settings, links) for name in one.names)):
            if within_robot and not a < b:
                continue
            pair = frozenset((a, b))
            before = given_by.get(pair)
            if before is not None and robots(before) == robots(one) and before.value != one.value:
                clashes.setdefault(pair, (before, one))
            elif before is not None and robots(before) > robots(one):
                clashes.pop(pair, None)
            given_by[pair] = one
            found[pair] = replace(one, names=(a, b))
    for pair, (first, one) in clashes.items():
        raise ParameterError(
            f"{one.parameter}: {quoted(one.text)} contradicts {quoted(first.text)} ({first.parameter}) for "
            f"{' and '.join(sorted(pair))}; give these two links a value of their own"
        )
    return list(found.values())


def _meshes(name: str, given: _PairSetting, settings: dict[str, Any], links: Links) -> Sequence[str]:
    if name in settings["meshes"] or name in settings["planes"]:
        return (name,)
    robot = name.partition("/")[0]
    if robot not in links:
        return ()
    if name == robot:
        return links[robot]
    if name not in links[robot]:
        raise ParameterError(
            f"{given.parameter}: {quoted(given.text)}: {quoted(robot)} has no link of this name with geometry; "
            f"there are {listed(links[robot])}"
        )
    return (name,)


def _are_names(settings: dict[str, Any], names: Sequence[str]) -> bool:
    """Whether they are two names of meshes, robots or their links."""
    return len(names) == 2 and all(_is_name(settings, name) for name in names)


def _is_name(settings: dict[str, Any], name: str) -> bool:
    return (
        name in settings["meshes"]
        or name in settings["planes"]
        or (name.partition("/")[0] in settings["robots"] and not name.endswith("/"))
    )


def _meant(settings: dict[str, Any], names: Sequence[str], text: str = "") -> str:
    """The end of a message: ``text`` with colons, or the name that is spelled most like the first unknown one."""
    if ":" not in text and (colons := _NO_COLONS.sub(":", text)) != text:
        return f"; did you mean {shortened(colons)}?"
    unknown = next((name for name in names if not _is_name(settings, name)), None)
    return (
        "" if unknown is None else suggestion(unknown, [*settings["meshes"], *settings["robots"], *settings["planes"]])
    )


def _names(settings: dict[str, Any], of_planes: bool = True) -> str:
    known = [*settings["meshes"], *settings["robots"], *(f"{robot}/LINK" for robot in settings["robots"])]
    known += settings["planes"] if of_planes else []
    return listed(known) or "(none)"
