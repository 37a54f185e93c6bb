"""Policies as a text, which a row has and which names finished work."""

import functools
from typing import Any, Dict, List, Optional

import cab


def policies_text(policies: cab.Policies) -> str:
    """All fields with their values: `refit=cab strategy=auto exact=convex ...`."""
    return " ".join(f"{field.name}={getattr(policies, field.name)}" for field in cab.policy_table())


@functools.lru_cache(maxsize=None)
def policies_of(text: str) -> cab.Policies:
    """The policies that `policies_text` wrote."""
    values: Dict[str, Any] = dict(word.split("=", 1) for word in text.split())
    return cab.Policies(**values)


def choose_policies(words: Optional[str], exact: str) -> cab.Policies:
    """Policies by words that commas separate: the name of a preset, and FIELD=VALUE. Else `exact` is as given."""
    values: Dict[str, Any] = {}
    made = cab.Policies()
    for word in (words or "").split(","):
        name, has_value, value = word.strip().partition("=")
        if not name:
            continue
        if not has_value:
            made = cab.Policies.preset(name)
        elif name not in {field.name for field in cab.policy_table()}:
            raise ValueError(f"there is no policy {name!r}; the policies are {', '.join(_field_names())}")
        else:
            values[name] = value
    values.setdefault("exact", exact)
    chosen = {name: values.get(name, getattr(made, name)) for name in _field_names()}
    return cab.Policies(**chosen)


def _field_names() -> List[str]:
    return [field.name for field in cab.policy_table()]
