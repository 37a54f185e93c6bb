"""What the reader of a file doubted or guessed: in a row of the table, and at the end of a scan."""

import json
import os
import re
from typing import Dict, Iterable, Iterator, List, Optional, Sequence, Set, Tuple

from .printable import printable, shortened
from .work import Item

_MOST_NOTES, _MOST_CHARACTERS, _MOST_NAME = 100, 300, 60
# Of the second file of a pair.
_OTHER = "other: "
_NUMBER = re.compile(r"[-+]?[0-9]+([.][0-9]*)?(e[-+]?[0-9]+)?")


def with_names(words: str, item: Item) -> str:
    """Words as one line, in which paths are those of the table."""
    words = printable(words)
    for source in (item.source, item.other):
        if source:
            words = words.replace(printable(source.path), printable(source.name))
            folder = os.path.join(os.path.dirname(source.path), "")
            if folder not in ("", os.sep):  # of files beside it, such as skeletons
                words = words.replace(printable(folder), printable(os.path.join(os.path.dirname(source.name), "")))
    if item.robot and item.robot.srdf:
        words = words.replace(printable(item.robot.srdf), printable(os.path.basename(item.robot.srdf)))
    return words


def notes_text(item: Item, notes: Iterable[str], other: Iterable[str] = ()) -> Optional[str]:
    """The notes of a file, and of the other one of a pair, as a list in JSON; nothing if there are none."""
    texts = [*notes, *(_OTHER + note for note in other)]
    kept = [_shortened(with_names(text, item), _MOST_CHARACTERS) for text in texts[:_MOST_NOTES]]
    if len(texts) > len(kept):
        kept.append(f"and {len(texts) - len(kept)} notes more")
    return json.dumps(kept, ensure_ascii=False) if kept else None


def told_notes(rows: Iterable[Sequence[str]], most: int) -> Iterator[str]:
    """A line for each kind of note, by rows of file, other and notes: the first file that has it, and how many do."""
    kinds: Dict[str, Tuple[str, str]] = {}
    files: Dict[str, Set[str]] = {}
    for file, other, text in rows:
        for note in _listed(text):
            of_other = bool(other) and note.startswith(_OTHER)
            name, words = (other, note[len(_OTHER):]) if of_other else (file, note)
            kind = _kind(words)
            kinds.setdefault(kind, (name, words))
            files.setdefault(kind, set()).add(name)
    told: List[str] = sorted(kinds, key=lambda kind: (not kind.startswith("warning"), -len(files[kind]), kind))
    for kind in told[:most]:
        name, words = kinds[kind]
        count = len(files[kind]) - 1
        more = f" and {count} more file{'' if count == 1 else 's'}" if count else ""
        start = f"{_shortened(printable(name), _MOST_NAME)}{more}: "
        yield start + _shortened(words, _MOST_CHARACTERS - len("cab scan: ") - len(start))
    if len(told) > most:
        yield f"and {len(told) - most} more kinds of notes; the column notes has all"


def _listed(text: str) -> List[str]:
    # A table of others may have anything there.
    try:
        notes = json.loads(text)
    except (ValueError, RecursionError):
        return [text]
    return [str(note) for note in notes] if isinstance(notes, list) else [text]


def _kind(note: str) -> str:
    # Notes differ by numbers and, at their end, by names. Files that need different units are of different kinds.
    if note.startswith("unit guessed: "):
        return note.partition(", ")[0]
    mark = "warning: " if note.startswith("warning: ") else ""
    return mark + _NUMBER.sub("N", re.split("[:;]", note[len(mark):], maxsplit=1)[0])


def _shortened(text: str, most: int) -> str:
    return shortened(text, most, (most - 5) // 3)
