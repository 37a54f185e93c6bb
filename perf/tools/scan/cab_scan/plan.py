"""From files and options to items: what is to be done, and what is done already."""

import dataclasses
import json
import os
from typing import Dict, List, Sequence

import cab

from .corpus import Entry
from .table import Table
from .work import FileOptions, Item, Source, TestOptions


# A task reads at most so many bytes and items, or an eighth of a worker's share, so that the last ones end together.
_TASK_BYTES, _TASK_ITEMS = 8 << 20, 64


def make_items(
    entries: Sequence[Entry], what: str, policies: Sequence[Sequence[str]], test: TestOptions, table: Table, again: bool
) -> List[Item]:
    """An item per entry, with its policies. Each knows the content hash of finished work; with `again` of none."""
    items = []
    for entry, chosen in zip(entries, policies):
        item = Item(
            what, entry.source, tuple(chosen), _options_text(entry, test), test, (None,) * len(chosen), entry.other,
            entry.part,
        )
        if not again:
            known = tuple(table.known(item.key(text), cab.__version__) for text in chosen)
            item = dataclasses.replace(item, known=known)
        items.append(item)
    return items


def _options_text(entry: Entry, test: TestOptions) -> str:
    """All options that change a row, as JSON: those that are not the default."""
    values = _file_options(entry.source)
    if entry.other and entry.other.options != entry.source.options:
        values["other"] = _file_options(entry.other)
    values.update(
        (field.name, getattr(test, field.name))
        for field in dataclasses.fields(test)
        if field.name != "command" and getattr(test, field.name) != field.default
    )
    return json.dumps(values, sort_keys=True)


def _file_options(source: Source) -> Dict[str, object]:
    values = source.options.changed()
    if source.options.motion:  # from the file on, so that a corpus may be moved
        values["motion"] = os.path.relpath(source.options.motion, os.path.dirname(source.path))
    return values


def robot_options(samples: int, seed: int, chunk: int, srdf: str, leave_out_missing: bool) -> str:
    """The options of a robot's rows."""
    values: Dict[str, object] = {"samples": samples, "seed": seed, "chunk": chunk}
    if srdf:
        values["srdf"] = os.path.basename(srdf)
    if leave_out_missing:
        values["leave_out_missing"] = True
    return json.dumps(values, sort_keys=True)


def make_tasks(items: Sequence[Item], workers: int) -> List[List[Item]]:
    """Items in tasks of similar size, in their order."""
    share = sum(item.size for item in items) // max(8 * workers, 1)
    most = max(min(_TASK_BYTES, share), 1)
    tasks: List[List[Item]] = []
    size = most
    for item in items:
        if size + item.size > most or len(tasks[-1]) == _TASK_ITEMS:
            tasks.append([])
            size = 0
        tasks[-1].append(item)
        size += item.size
    return tasks


DEFAULT_FILE_OPTIONS = FileOptions()
