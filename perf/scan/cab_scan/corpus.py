"""Which files a scan is about, and how each is read: folders, globs, lists, and options in folders."""

import csv
import dataclasses
import fnmatch
import functools
import glob
import itertools
import os
import re
from typing import Callable, Dict, Iterable, Iterator, List, NamedTuple, Optional, Sequence, Tuple, Union

from .work import FileOptions, Source

# What is taken from a folder. A file that is named itself is always taken.
MOTION_SUFFIXES = frozenset(
    ".bvh .amc .gltf .glb .fbx .dae .x .b3d .ms3d .md5anim .md5mesh .smd .ogex .blend .3ds .ase .mdl .lws .irr".split()
)
RECORDING_SUFFIXES = frozenset([".cab"])
FOLDER_FILE = "cab-scan.csv"


class CorpusError(ValueError):
    """A list, a pattern or a path that is wrong; the message names the file and the line."""


class Entry(NamedTuple):
    """A file as it was found. `other` is the second of a pair, `part` what the loader is asked for."""

    source: Source
    other: Optional[Source]
    part: str


class Found(NamedTuple):
    """The files, in order and each once, and what was not found."""

    entries: List[Entry]
    problems: List[str]


def find(
    paths: Sequence[str], lists: Sequence[str], root: str, options: FileOptions, suffixes: Iterable[str]
) -> Found:
    """All files of folders (and those below), globs, names and list files. Names in the table are relative to a root.

    A file of a folder has the options of the files cab-scan.csv above it; a list has those of its columns.
    """
    entries: List[Entry] = []
    problems: List[str] = []
    for path in paths:
        files = list(_files_of(path, frozenset(suffixes)))
        if not files:
            problems.append(f"{path}: {_why_nothing(path)}")
        entries.extend(Entry(_source(file, root, _folder_options(file, options)), None, "") for file in files)
    for name in lists:
        entries.extend(_read_list(name, root, options))
    unique: Dict[Tuple[str, str, str], Entry] = {}
    for entry in entries:
        unique.setdefault((entry.source.name, entry.other.name if entry.other else "", entry.part), entry)
    return Found([unique[key] for key in sorted(unique)], problems)


def _why_nothing(path: str) -> str:
    if os.path.isdir(path):
        return "the folder has no file to scan in it"
    return "nothing is there" if not glob.has_magic(path) else "no file has such a name"


def _files_of(path: str, suffixes: "frozenset[str]") -> Iterator[str]:
    if os.path.isdir(path):
        yield from _files_below(path, suffixes)
    elif os.path.exists(path):
        yield path
    elif glob.has_magic(path):
        for match in sorted(glob.glob(path, recursive=True)):
            if os.path.isdir(match):
                yield from _files_below(match, suffixes)
            else:
                yield match


def _files_below(folder: str, suffixes: "frozenset[str]") -> Iterator[str]:
    for place, folders, names in os.walk(folder, onerror=_raise):
        folders.sort()
        for name in sorted(names):
            if os.path.splitext(name)[1].lower() in suffixes:
                yield os.path.join(place, name)


def _raise(error: OSError) -> None:
    raise CorpusError(f"{error.filename}: {error.strerror}")


def _source(path: str, root: str, options: FileOptions) -> Source:
    full = os.path.abspath(path)
    name = os.path.relpath(full, root) if root else os.path.normpath(path)
    try:
        size = os.stat(full).st_size
    except OSError:
        size = 0  # the worker says what is wrong
    if options.motion:
        options = dataclasses.replace(options, motion=os.path.abspath(options.motion))
    return Source(os.fsencode(name).decode("utf-8", "backslashreplace"), full, options, size)


# ---------------------------------------------------------------------------------------------------- options of files


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < float("inf"):
        raise ValueError(f"a number above 0 is wanted, and {text!r} is given")
    return value


def _unit(text: str) -> Union[float, str]:
    return text if text == "auto" else _number(text)


def _yes(text: str) -> bool:
    if text.lower() not in ("1", "0", "yes", "no"):
        raise ValueError(f"yes or no is wanted, and {text!r} is given")
    return text.lower() in ("1", "yes")


READERS: Dict[str, Callable[[str], object]] = {
    "units": _unit, "motion": str, "motion_units": _number, "animation": str, "fps": _number, "skin": _yes,
    "stature": _number, "thickness": _number,
}


def with_options(options: FileOptions, values: Dict[str, str], folder: str) -> FileOptions:
    """Options changed by texts. Empty ones change nothing. A path in `motion` starts at the folder."""
    read = {name: READERS[name](text) for name, text in values.items() if name in READERS and text}
    if "motion" in read:
        read["motion"] = os.path.join(folder, str(read["motion"]))
    return dataclasses.replace(options, **read)


class _Line(NamedTuple):
    number: int
    values: Dict[str, str]


def _read_csv(path: str, more: Iterable[str]) -> List[_Line]:
    # The lines of a CSV file whose first line names columns, among them `path`.
    allowed = {"path", *READERS, *more}
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file, strict=True)
            columns = [column.strip() for column in reader.fieldnames or []]
            if "path" not in columns:
                raise CorpusError(f"{path}: line 1: the column path is missing")
            for column in columns:
                if column not in allowed:
                    raise CorpusError(f"{path}: line 1: {column!r} is none of the columns {', '.join(sorted(allowed))}")
            reader.fieldnames = columns
            lines = []
            for line in reader:
                if None in line or None in line.values() or not line["path"].strip():
                    raise CorpusError(f"{path}: line {reader.line_num}: {len(columns)} fields with a path are wanted")
                lines.append(_Line(reader.line_num, {name: text.strip() for name, text in line.items()}))
            return lines
    except OSError as error:
        raise CorpusError(f"{path}: {error.strerror}") from error
    except (csv.Error, UnicodeDecodeError) as error:
        raise CorpusError(f"{path}: {error}") from error


def _read_list(path: str, root: str, options: FileOptions) -> Iterator[Entry]:
    # Either a path per line, or CSV. Paths start at the folder of the list.
    folder = os.path.dirname(path)
    for line in _lines_of_list(path):
        try:
            read = with_options(options, line.values, folder)
            other = line.values.get("other", "")
            other_units = line.values.get("other_units", "")
            other_options = dataclasses.replace(read, units=_unit(other_units)) if other_units else read
        except ValueError as error:
            raise CorpusError(f"{path}: line {line.number}: {error}") from error
        yield Entry(
            _source(os.path.join(folder, line.values["path"]), root, read),
            _source(os.path.join(folder, other), root, other_options) if other else None,
            line.values.get("part", ""),
        )


def _lines_of_list(path: str) -> List[_Line]:
    try:
        with open(path, encoding="utf-8-sig") as file:
            head = [name.strip() for name in file.readline().rstrip("\n").split(",")]
            if "path" in head:
                return _read_csv(path, ("other", "other_units", "part"))
            file.seek(0)
            lines = enumerate((line.strip() for line in file), 1)
            return [_Line(number, {"path": text}) for number, text in lines if text and not text.startswith("#")]
    except OSError as error:
        raise CorpusError(f"{path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise CorpusError(f"{path}: {error}") from error


def _folder_options(path: str, options: FileOptions) -> FileOptions:
    # Of the files cab-scan.csv above a file the nearest has the last word, and in each the last line that matches.
    folder, _ = os.path.split(os.path.abspath(path))
    above = [folder]
    while os.path.dirname(above[-1]) != above[-1]:
        above.append(os.path.dirname(above[-1]))
    for place in reversed(above):
        for line in _folder_file(place):
            if fnmatch.fnmatchcase(os.path.relpath(os.path.abspath(path), place), line.values["path"]):
                try:
                    options = with_options(options, line.values, place)
                except ValueError as error:
                    where = os.path.join(place, FOLDER_FILE)
                    raise CorpusError(f"{where}: line {line.number}: {error}") from error
    return options


@functools.lru_cache(maxsize=None)
def _folder_file(folder: str) -> Tuple[_Line, ...]:
    path = os.path.join(folder, FOLDER_FILE)
    return tuple(_read_csv(path, ())) if os.path.isfile(path) else ()


# --------------------------------------------------------------------------------------------------------------- pairs


def pair_up(entries: Sequence[Entry], pattern: str) -> List[Entry]:
    """Every two files whose names are equal but for what the group of a regular expression matches."""
    try:
        expression = re.compile(pattern)
    except re.error as error:
        raise CorpusError(f"--pattern {pattern}: {error}") from error
    if expression.groups != 1:
        raise CorpusError(f"--pattern {pattern}: one group is wanted, which tells people apart, as in '(60|61)_'")
    scenes: Dict[Tuple[str, str], List[Entry]] = {}
    for entry in entries:
        match = expression.search(entry.source.name)
        if match and match.group(1) is not None:
            begin, end = match.span(1)
            scenes.setdefault((entry.source.name[:begin], entry.source.name[end:]), []).append(entry)
    pairs = [
        Entry(one.source, two.source, one.part)
        for scene in scenes.values()
        for one, two in itertools.combinations(scene, 2)
    ]
    return sorted(pairs, key=lambda entry: (entry.source.name, entry.other.name if entry.other else ""))
