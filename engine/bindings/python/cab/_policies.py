"""Policies: every choice between speed and accuracy, by names."""

from __future__ import annotations

import dataclasses
from typing import Any, Dict, List, NamedTuple, Optional, Tuple, Union

from . import _cab
from ._options import Exact, Extents, Preset, Refit, Sat, Strategy


class PolicyField(NamedTuple):
    """A field of `Policies`: its name, what it decides, and its values with their meanings."""

    name: str
    meaning: str
    values: Dict[str, str]


def policy_table() -> List[PolicyField]:
    """All fields of `Policies`, each with its values, as the library has them."""
    return [PolicyField(name, meaning, dict(values)) for name, meaning, values in _cab.policy_table()]


def presets() -> Dict[str, str]:
    """The names of the presets, with their meanings."""
    return {name: meaning for name, meaning, _ in _cab.preset_table()}


@dataclasses.dataclass(frozen=True)
class Policies:
    """How boxes are made and tested, and what confirms a hit. The defaults are the preset "balanced".

    `policy_table()` lists the values of each field with their meanings. No policy loses a pair that touches. A value
    that a field lacks is a ValueError.
    """

    refit: Refit = "cab"
    strategy: Strategy = "auto"
    exact: Exact = "none"
    extents: Extents = "children"
    sat: Sat = "all_15"

    def __post_init__(self) -> None:
        for field in policy_table():
            value = getattr(self, field.name)
            if value not in field.values:
                raise ValueError(f"{field.name}: {value!r} is none of {', '.join(field.values)}")

    @classmethod
    def preset(cls, name: str) -> Policies:
        """The values of a preset, such as "paper" or "tight". An unknown name is a ValueError."""
        fields = [field.name for field in policy_table()]
        for preset, _, values in _cab.preset_table():
            if preset == name:
                chosen: Dict[str, Any] = dict(zip(fields, values))
                return cls(**chosen)
        raise ValueError(f"preset: {name!r} is none of {', '.join(presets())}")

    def _names(self) -> List[str]:
        return [getattr(self, name) for name in _FIELD_NAMES]


_FIELD_NAMES: Tuple[str, ...] = tuple(name for name, _, _ in _cab.policy_table())
_BALANCED = Policies()

PoliciesLike = Union[Policies, Preset, None]


def policies_of(policies: PoliciesLike, exact: Optional[Exact]) -> Policies:
    """Policies from what calls take: a preset's name, policies, or None; `exact` overrules."""
    if policies is None:
        made = _BALANCED
    elif isinstance(policies, str):
        made = Policies.preset(policies)
    elif isinstance(policies, Policies):
        made = policies
    else:
        given = type(policies).__name__
        raise TypeError(f"policies: cab.Policies or the name of a preset is wanted, and {given} is given")
    return made if exact is None or exact == made.exact else dataclasses.replace(made, exact=exact)
