"""Which files a scan is about, and how each is read: folders, globs, lists, and options in folders."""

import csv
import dataclasses
import fnmatch
import glob
import io
import itertools
import os
import re
from typing import Callable, Dict, Iterable, Iterator, List, NamedTuple, Optional, Sequence, Set, Tuple, Union

from .printable import shortened, table_text
from .reading import RefusedError, bytes_of
from .work import FileOptions, Source

# What is taken from a folder. A file that is named itself is always taken.
MOTION_SUFFIXES = frozenset(
    ".bvh .amc .gltf .glb .vrm .fbx .dae .x .b3d .ms3d .md5anim .md5mesh .smd .ogex .blend .3ds .ase .mdl .lws "
    ".irr".split()
)
RECORDING_SUFFIXES = frozenset([".cab"])
FOLDER_FILE = "cab-scan.csv"
_MOST_LIST_BYTES = 1 << 28
# A file cab-scan.csv may be a stranger's, and all its lines are kept. Those with wildcards are tried on each file below
# it, and to compile a pattern takes up to 25 us for each of its characters.
_MOST_FOLDER_FILE_BYTES = 1 << 20
_MOST_FIELD_CHARACTERS = 1024
_MOST_WILDCARD_LINES, _MOST_WILDCARD_CHARACTERS = 1000, 1 << 16


class CorpusError(ValueError):
    """A list, a pattern or a path that is wrong; the message names the file and the line."""


class Entry(NamedTuple):
    """A file as it was found. `other` is the second of a pair, `part` what the loader is asked for."""

    source: Source
    other: Optional[Source]
    part: str

    @property
    def has_surface(self) -> bool:
        """Whether one of its characters is the triangles of meshes."""
        return any(source.options.body == "surface" for source in (self.source, self.other) if source)


class Found(NamedTuple):
    """The files, in order, each once by its options; what was not found; what is said of options and of lines that
    repeat others; and all that is read.
    """

    entries: List[Entry]
    problems: List[str]
    notes: List[str]
    read: List[str]


def find(
    paths: Sequence[str], lists: Sequence[str], root: str, options: FileOptions, suffixes: Iterable[str]
) -> Found:
    """All files of folders (and those below), globs, names and list files. Names in the table are relative to a root.

    A file has the options of the files cab-scan.csv above it, up to PATH, the list's folder or the root; those of the
    columns of a list win. A file that a list names is read as its lines say alone, even if paths have it too.
    """
    entries: List[Entry] = []
    problems: List[str] = []
    notes: List[str] = []
    folders = _FolderFiles()
    suffixes = frozenset(suffixes)
    files: List[List[Tuple[str, str]]] = [[] for _ in paths]
    for number, file, top in _files_of(paths, suffixes, problems):
        files[number].append((file, top))
    for path, its in zip(paths, files):
        if not its and not any(_files_of([path], suffixes, [])):  # not even what other paths have too
            problems.append(f"{path}: {_why_nothing(path)}")
        for file, top in its:
            read = folders.options_of(file, top, root, options)
            entries.append(Entry(_source(file, root, read), None, ""))
    unique = {_names(entry): entry for entry in reversed(entries)}  # a file of several paths is read as by the first
    known = {_key(entry) for entry in unique.values()}
    listed: Dict[Tuple[object, ...], Entry] = {}
    for name in lists:
        repeated = []
        for entry in _read_list(name, root, options, folders):
            if _key(entry) in known:
                repeated.append(entry.source.name)
            known.add(_key(entry))
            listed.setdefault(_key(entry), entry)
        if repeated:
            lines = "1 line repeats" if len(repeated) == 1 else f"{len(repeated)} lines repeat"
            notes.append(f"{name}: {lines} what is named before; the first is of {repeated[0]}")
    for entry in listed.values():  # a list says how a file is read, not the path that it is below
        unique.pop(_names(entry), None)
    sources = [source for entry in (*entries, *listed.values()) for source in (entry.source, entry.other) if source]
    read_files = [path for source in sources for path in (source.path, source.options.motion) if path]
    return Found(
        sorted([*unique.values(), *listed.values()], key=_names), problems, [*folders.notes(), *notes],
        [*read_files, *folders.files()],
    )


def _names(entry: Entry) -> Tuple[str, str, str]:
    return entry.source.name, entry.other.name if entry.other else "", entry.part


def _key(entry: Entry) -> Tuple[object, ...]:
    # What the table tells apart: lines of one file may have other options.
    return (*_names(entry), entry.source.options, entry.other.options if entry.other else None)


def _is_below(folder: str, file: str) -> bool:
    place = os.path.abspath(folder)
    return os.path.commonpath([place, os.path.abspath(file)]) == place


def _why_nothing(path: str) -> str:
    if os.path.isdir(path):
        return "the folder has no file to scan in it"
    return "nothing is there" if not glob.has_magic(path) else "no file has such a name"


def _files_of(
    paths: Sequence[str], suffixes: "frozenset[str]", problems: List[str]
) -> Iterator[Tuple[int, str, str]]:
    # Each with the number of its path, and the highest folder that this names. Links are followed last, so that a
    # folder that has a name without them keeps it. Each is scanned once, whichever paths lead to it. What cannot be
    # read through a link is a problem, and no reason to scan nothing.
    tops: List[Tuple[int, str, str]] = []
    for number, path in enumerate(paths):
        for match, top in _matches_of(path):
            if os.path.isdir(match):
                tops.append((number, match, top))
            else:
                yield number, match, top
    tops.sort(key=lambda named: os.path.islink(os.path.abspath(named[1])))
    named = len(tops)
    seen: Set[Tuple[int, int]] = set()
    for index, (number, start, top) in enumerate(tops):
        refuse = _raise if index < named else lambda error: problems.append(_words_of(error))
        for place, folders, names in os.walk(start, onerror=refuse):
            try:
                state = os.stat(place)
            except OSError as error:
                refuse(error)
                folders.clear()
                continue
            if (state.st_dev, state.st_ino) in seen:
                folders.clear()
                continue
            seen.add((state.st_dev, state.st_ino))
            folders.sort()
            inner = [os.path.join(place, name) for name in folders]
            tops += [(number, path, top) for path in inner if os.path.islink(path)]
            for name in sorted(names):
                if os.path.splitext(name)[1].lower() in suffixes:
                    yield number, os.path.join(place, name), top


def _matches_of(path: str) -> Iterator[Tuple[str, str]]:
    # Files and folders, each with the highest folder that the path names.
    if os.path.isdir(path):
        yield path, path
    elif os.path.exists(path):
        yield path, os.path.dirname(path)
    elif glob.has_magic(path):
        top = os.path.dirname(path)
        while glob.has_magic(top):
            top = os.path.dirname(top)
        yield from ((match, top) for match in sorted(glob.glob(path, recursive=True)))


def _raise(error: OSError) -> None:
    raise CorpusError(_words_of(error))


def _words_of(error: OSError) -> str:
    return f"{error.filename}: {error.strerror}"


def _source(path: str, root: str, options: FileOptions) -> Source:
    full = os.path.abspath(path)
    name = os.path.relpath(full, root) if root else os.path.normpath(path)
    try:
        size = os.stat(full).st_size
    except (OSError, ValueError):
        size = 0  # the worker says what is wrong
    if options.motion:
        options = dataclasses.replace(options, motion=os.path.abspath(options.motion))
    return Source(table_text(name), full, options, size)


# ---------------------------------------------------------------------------------------------------- options of files


def _quoted(text: str) -> str:
    # For a message of one line.
    return shortened(repr(text), 60, 15)


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < float("inf"):
        raise ValueError(f"a number above 0 is wanted, and {_quoted(text)} is given")
    return value


def _unit(text: str) -> Union[float, str]:
    return text if text == "auto" else _number(text)


def _body(text: str) -> str:
    if text not in ("skeleton", "skin", "surface"):
        raise ValueError(f"skeleton, skin or surface is wanted, and {_quoted(text)} is given")
    return text


READERS: Dict[str, Callable[[str], object]] = {
    "units": _unit, "motion": str, "motion_units": _number, "animation": str, "fps": _number, "body": _body,
    "stature": _number, "thickness": _number,
}


def with_options(options: FileOptions, values: Dict[str, str], folder: str) -> FileOptions:
    """Options changed by texts. Empty ones change nothing. A path in `motion` starts at the folder.

    ValueError for a text that is wrong.
    """
    read = {name: READERS[name](text) for name, text in values.items() if name in READERS and text}
    if "motion" in read:
        read["motion"] = os.path.join(folder, str(read["motion"]))
    return dataclasses.replace(options, **read)


class _Line(NamedTuple):
    number: int
    values: Dict[str, str]


def _read_csv(path: str, text: str, more: Iterable[str]) -> List[_Line]:
    # The lines of a CSV text whose first line names columns, among them `path`.
    allowed = {"path", *READERS, *more}
    reader = csv.DictReader(io.StringIO(text, newline=""), strict=True)
    try:
        columns = [column.strip() for column in reader.fieldnames or []]
        if "path" not in columns:
            raise CorpusError(f"{path}: line 1: the column path is missing")
        for column in columns:
            if column not in allowed:
                known = ", ".join(sorted(allowed))
                raise CorpusError(f"{path}: line 1: {_quoted(column)} is none of the columns {known}")
            if columns.count(column) > 1:
                raise CorpusError(f"{path}: line 1: the column {column} is there twice")
        reader.fieldnames = columns
        lines = []
        for line in reader:
            if None in line or None in line.values() or not line["path"].strip():
                raise CorpusError(f"{path}: line {reader.line_num}: {len(columns)} fields with a path are wanted")
            lines.append(_Line(reader.line_num, {name: value.strip() for name, value in line.items()}))
        return lines
    except csv.Error as error:
        raise CorpusError(f"{path}: line {reader.reader.line_num}: {error}") from error


def _text_of(path: str, most: int) -> str:
    # Paths may have any bytes.
    try:
        return bytes_of(path, most).decode("utf-8-sig", "surrogateescape")
    except RefusedError as error:
        raise CorpusError(str(error)) from error
    except OSError as error:
        raise CorpusError(f"{path}: {error.strerror}") from error


def _read_list(path: str, root: str, options: FileOptions, folders: "_FolderFiles") -> Iterator[Entry]:
    # Either a path per line, or CSV. Paths start at the folder of the list.
    folder = os.path.dirname(path)

    def source(name: str, values: Dict[str, str]) -> Source:
        file = os.path.join(folder, name)
        top = folder if _is_below(folder, file) else os.path.dirname(file)
        return _source(file, root, with_options(folders.options_of(file, top, root, options), values, folder))

    for line in _lines_of_list(path):
        values = line.values
        other, other_units = values.get("other", ""), values.get("other_units", "")
        try:
            yield Entry(
                source(values["path"], values),
                source(other, {**values, "units": other_units or values.get("units", "")}) if other else None,
                values.get("part", ""),
            )
        except CorpusError:
            raise
        except ValueError as error:
            raise CorpusError(f"{path}: line {line.number}: {error}") from error


def _lines_of_list(path: str) -> List[_Line]:
    text = _text_of(path, _MOST_LIST_BYTES)
    lines = io.StringIO(text, newline=None).readlines()
    if lines and "path" in [name.strip() for name in lines[0].split(",")]:
        return _read_csv(path, text, ("other", "other_units", "part"))
    numbered = enumerate((line.strip() for line in lines), 1)
    return [_Line(number, {"path": line}) for number, line in numbered if line and not line.startswith("#")]


class _FolderFile:
    """The lines of a file cab-scan.csv, by the files that they are about."""

    def __init__(self, path: str) -> None:
        self._lines = _read_csv(path, _text_of(path, _MOST_FOLDER_FILE_BYTES), ())
        self._names: Dict[str, List[int]] = {}
        self._patterns: List[Tuple["re.Pattern[str]", int]] = []
        characters = 0
        for index, line in enumerate(self._lines):
            if max(map(len, line.values.values())) > _MOST_FIELD_CHARACTERS:
                raise CorpusError(
                    f"{path}: line {line.number}: a field has more than {_MOST_FIELD_CHARACTERS} characters"
                )
            pattern = line.values["path"]
            if not glob.has_magic(pattern):
                self._names.setdefault(pattern, []).append(index)
                continue
            characters += len(pattern)
            if len(self._patterns) == _MOST_WILDCARD_LINES or characters > _MOST_WILDCARD_CHARACTERS:
                raise CorpusError(
                    f"{path}: line {line.number}: there are more than {_MOST_WILDCARD_LINES} patterns with wildcards "
                    f"(* ? [), or they have more than {_MOST_WILDCARD_CHARACTERS} characters; names without are free"
                )
            self._patterns.append((re.compile(fnmatch.translate(pattern)), index))

    def lines_of(self, name: str) -> List[_Line]:
        """Those that match the name of a file, from the folder on, in their order."""
        found = [index for pattern, index in self._patterns if pattern.match(name)]
        return [self._lines[index] for index in sorted([*found, *self._names.get(name, [])])]


class _FolderFiles:
    """The files cab-scan.csv above the files of a scan: what they set, and why some do not count.

    They change what a scan finds. So those alone count that are of this user, of the owner of the file that they are
    about, or of root, and none above what the command line names: in a folder for all, anybody may leave one.
    """

    def __init__(self) -> None:
        self._owners: Dict[str, Set[int]] = {}  # by their names; none of a file that is not there
        self._read: Dict[str, _FolderFile] = {}
        self._left: Dict[str, str] = {}  # by their names, why they do not count
        self._used: Dict[Tuple[str, int, str], int] = {}  # by name, line and what it sets: for how many files
        self._counted: Dict[str, int] = {}  # by files, the length of the highest folder whose lines count them

    def options_of(self, file: str, top: str, root: str, options: FileOptions) -> FileOptions:
        """Of a file below a folder `top`. The nearest folder has the last word, in each the last line that matches."""
        path, top = os.path.abspath(file), os.path.abspath(top)
        if root and len(root) < len(top) and _is_below(root, path):
            top = root
        counted = self._counted.get(path, len(path))
        self._counted[path] = min(counted, len(top))
        for place in reversed(_folders_above(path)):
            where = os.path.join(place, FOLDER_FILE)
            if not self._counts(where, len(place) < len(top), path):
                continue
            if where not in self._read:
                self._read[where] = _FolderFile(where)
            for line in self._read[where].lines_of(os.path.relpath(path, place)):
                options = self._changed(where, line, len(place) < counted, options)
        return options

    def _counts(self, where: str, is_above: bool, path: str) -> bool:
        if where not in self._owners:
            try:
                self._owners[where] = {os.lstat(where).st_uid, os.stat(where).st_uid}
            except (OSError, ValueError):
                self._owners[where] = set()
        owners = self._owners[where]
        if is_above and owners:
            self._left[where] = "it is above what is scanned; with --root at its folder it counts"
        elif not owners <= {os.geteuid(), 0, _owner_of(path)}:
            self._left[where] = "it is of another user"
        else:
            return bool(owners)
        return False

    def _changed(self, where: str, line: _Line, is_new: bool, options: FileOptions) -> FileOptions:
        values = {name: text for name, text in line.values.items() if text and name != "path"}
        try:
            motion = os.path.normpath(values.get("motion", ""))
            if os.path.isabs(motion) or motion.split(os.sep)[0] == os.pardir:
                raise ValueError("motion must be below the folder of this file; a --list may name any")
            options = with_options(options, values, os.path.dirname(where))
        except ValueError as error:
            raise CorpusError(f"{where}: line {line.number}: {error}") from error
        if values:
            key = (where, line.number, ", ".join(f"{name}={text}" for name, text in values.items()))
            self._used[key] = self._used.get(key, 0) + is_new
        return options

    def notes(self) -> List[str]:
        """A line for each line that set something, and for each file that does not count."""
        used = [
            f"{where}: line {line} sets {what} for {files} file{'' if files == 1 else 's'}"
            for (where, line, what), files in sorted(self._used.items())
        ]
        return used + [f"{where} is not read: {why}" for where, why in sorted(self._left.items())]

    def files(self) -> List[str]:
        """Those that were read."""
        return list(self._read)


def _folders_above(path: str) -> List[str]:
    above = [os.path.dirname(path)]
    while os.path.dirname(above[-1]) != above[-1]:
        above.append(os.path.dirname(above[-1]))
    return above


def _owner_of(path: str) -> int:
    try:
        return os.stat(path).st_uid
    except (OSError, ValueError):
        return os.geteuid()


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
        if one.source.name != two.source.name  # a list may have a file with several options
    ]
    return sorted(pairs, key=lambda entry: (entry.source.name, entry.other.name if entry.other else ""))
