"""The command line."""

import argparse
import re
from typing import List, Optional, Sequence, Tuple

from .corpus import READERS, with_options
from .policies import choose_policies
from .work import FileOptions, TestOptions

_DESCRIPTION = """Scans a corpus: which links touch, in which file, when and how deep. The result is one SQLite table.
Work that is in the table is not done again; docs/scale.md says what the columns mean."""


# Of a robot's states. All of them are listed before the first one is tested: 0.6 kB each.
_MOST_CHUNKS = 1 << 20


class _Count:
    """Reads a whole number within limits, such as 5000, 1e6 or 2.5e3."""

    def __init__(self, least: int, most: int) -> None:
        self._least, self._most = least, most

    def __call__(self, text: str) -> int:
        try:
            if re.fullmatch("[0-9]+", text):
                number = int(text)
            elif re.fullmatch(r"[0-9]+(\.[0-9]+)?e[0-9]+", text) and float(text).is_integer():  # infinity is none
                number = int(float(text))
            else:
                number = self._least - 1
        except ValueError:
            number = self._least - 1
        if not self._least <= number <= self._most:
            raise argparse.ArgumentTypeError(f"{text!r}: a whole number from {self._least} to {self._most} is wanted")
        return number


def _length(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r}: a length of 0 or more metres is wanted")
    return value


def _shard(text: str) -> Tuple[int, int]:
    match = re.fullmatch("([0-9]{1,18})/([0-9]{1,18})", text)
    if not match or not 1 <= int(match[1]) <= int(match[2]):
        raise argparse.ArgumentTypeError(f"{text!r}: I/N with I from 1 to N is wanted, such as 1/4")
    return int(match[1]), int(match[2])


def _memory(text: str) -> str:
    if not re.fullmatch(r"[0-9]+(\.[0-9]+)?\s*([kMG]i?B?)", text):
        raise argparse.ArgumentTypeError(f"{text!r}: a size with its unit is wanted, for example 2GB or 800MB")
    if not re.search("[1-9]", text):
        raise argparse.ArgumentTypeError(f"{text!r}: a process needs memory")
    return text if text.endswith("B") else text + "B"


def _package(text: str) -> Tuple[str, str]:
    name, sign, folder = text.partition("=")
    if not sign or not name or not folder:
        raise argparse.ArgumentTypeError(f"{text!r}: NAME=DIR is wanted")
    return name, folder


class _FileValue:
    """Checks the text of an option of files, which is read together with those of lists."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __call__(self, text: str) -> str:
        try:
            READERS[self._name](text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error)) from error
        return text


def _add_table(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("the table")
    group.add_argument("--table", metavar="FILE", default="scan.sqlite", help="the table (default scan.sqlite)")
    group.add_argument("--csv", metavar="FILE", help="also write the rows as CSV, and contacts and pairs beside them")


def _add_work(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("what is done")
    group.add_argument("--again", action="store_true", help="do all anew, also what is in the table")
    group.add_argument("--root", metavar="DIR", default="", help="names of files in the table start at this folder")
    group.add_argument(
        "--shard", metavar="I/N", type=_shard,
        help="only each Nth file or pair, from the Ith on; `cab scan merge` makes one table of all shards",
    )
    group = parser.add_argument_group("workers")
    where = group.add_mutually_exclusive_group()
    where.add_argument(
        "--workers", metavar="N", type=_Count(1, 1024), default=2, help="processes of this machine (default 2)"
    )
    where.add_argument("--scheduler", metavar="ADDRESS", help="a Dask scheduler that is there, as tcp://host:8786")
    group.add_argument(
        "--memory", metavar="SIZE", type=_memory, default="2GB",
        help="that a process of this machine may map for its data (default 2GB); one that takes more is replaced",
    )
    group.add_argument(
        "--most-seconds", metavar="N", type=_Count(1, 1 << 24), default=3600,
        help="for a file, or a chunk of states, on this machine (default %(default)s); a process that takes longer is "
        "replaced",
    )


def _add_files(parser: argparse.ArgumentParser, kind: str) -> None:
    parser.add_argument("paths", metavar="PATH", nargs="*", help=f"{kind}: files, folders with all below them, globs")
    parser.add_argument(
        "--list", metavar="FILE", action="append", default=[], dest="lists",
        help="a path per line; or CSV whose first line has path and perhaps units and other options, part, other",
    )


def _add_policies(parser: argparse.ArgumentParser, several: bool) -> None:
    words = "a preset, or FIELD=VALUE, separated by commas, such as tight,exact=none (default balanced,exact=convex)"
    parser.add_argument(
        "--policies", metavar="WORDS", action="append" if several else "store", default=[] if several else None,
        help=words + ("; give it again for each column of the sweep" if several else ""),
    )


def _add_clips(parser: argparse.ArgumentParser) -> None:
    _add_files(parser, "motion")
    group = parser.add_argument_group("how files are read")
    for name, metavar, meaning in (
        ("units", "METRES", "length unit of the files, or auto (default as a file says, or 1)"),
        ("motion", "FILE", "another file that has the motion"),
        ("motion_units", "METRES", "its length unit"),
        ("animation", "NAME", "the animation, by name or number (default the first)"),
        ("fps", "N", "frames per second of files that do not say it (default 120)"),
        ("body", "KIND", "skeleton (default); skin: hulls about meshes; surface: their triangles, by exact=surface"),
        ("stature", "METRES", "the person's height (default by the bones)"),
        ("thickness", "FACTOR", "factor of all thicknesses (default 1)"),
    ):
        group.add_argument(
            "--" + name.replace("_", "-"), metavar=metavar, type=_FileValue(name), help=meaning
        )
    group.add_argument(
        "--loader", metavar="MODULE:FUNCTION", default="",
        help="a function that takes a cab_scan.Request and yields cab_scan.Sequence, in the place of cab.load_motion",
    )
    group = parser.add_argument_group("what counts")
    group.add_argument("--min-depth", metavar="METRES", type=_length, default=0.0, help="only what is so deep")
    group.add_argument(
        "--gap", metavar="N", type=_Count(0, 1 << 30), default=0,
        help="runs with at most N frames between them are one (default 0)",
    )
    group.add_argument("--no-contacts", action="store_true", help="leave out the table of contacts, which may be large")


def _add_robot(parser: argparse.ArgumentParser) -> None:
    _add_files(parser, "URDF or MJCF files")
    parser.add_argument(
        "--states", metavar="N", type=_Count(0, 1 << 40), default=1000000, help="random states to test (default 1e6)"
    )
    parser.add_argument(
        "--samples", metavar="N", type=_Count(0, 1 << 40), default=10000,
        help="random states that decide which pairs touch always or never (default 10000)",
    )
    parser.add_argument("--seed", metavar="N", type=_Count(0, (1 << 32) - 1), default=1, help="seed (default 1)")
    parser.add_argument(
        "--chunk", metavar="N", type=_Count(1, 1 << 24), default=1 << 16, help="states of a row (default 65536)"
    )
    parser.add_argument(
        "--package", metavar="NAME=DIR", type=_package, action="append", default=[], dest="packages",
        help="folder of package://NAME paths",
    )
    parser.add_argument("--srdf", metavar="FILE", default="", help="the masked pairs; none are derived")
    parser.add_argument("--leave-out-missing", action="store_true", help="take no shape for meshes that are not there")


def _parser(version: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("cab scan", description=_DESCRIPTION)
    parser.add_argument("--version", action="version", version=f"cab {version}")
    commands = parser.add_subparsers(dest="what", metavar="WHAT", required=True)
    command = commands.add_parser("self", help="where characters go through themselves")
    _add_clips(command)
    _add_policies(command, False)
    command = commands.add_parser("pairs", help="where two people touch who were recorded together")
    _add_clips(command)
    command.add_argument(
        "--pattern", metavar="REGEX",
        help="files whose names differ by the one group alone are recorded together, as in '(60|61)_'; "
        "or lists have the column other",
    )
    _add_policies(command, False)
    command = commands.add_parser("policies", help="what policies cost over a corpus: times, tests, false positives")
    _add_clips(command)
    _add_policies(command, True)
    command = commands.add_parser("recordings", help="recordings (.cab): replayed bit by bit, and their contacts")
    _add_files(command, "recordings")
    command.add_argument("--no-contacts", action="store_true", help="leave out the table of contacts")
    command = commands.add_parser("robot", help="random states of robots, and their allowed-collision matrix")
    _add_robot(command)
    _add_policies(command, False)
    for name, sub in commands.choices.items():
        if name in ("self", "policies"):
            sub.add_argument(
                "--hops", metavar="N", type=_Count(0, 1024), default=TestOptions.hops,
                help="links at most N joints apart are not tested (default %(default)s); 0: those that share a joint",
            )
        _add_table(sub)
        _add_work(sub)
    command = commands.add_parser("merge", help="one table of several, such as those of shards")
    command.add_argument("paths", metavar="TABLE", nargs="+", help="tables whose rows are taken, the last ones last")
    _add_table(command)
    return parser


def parse(words: Optional[Sequence[str]], version: str) -> argparse.Namespace:
    """The options; ends the process with code 2 for wrong use."""
    parser = _parser(version)
    options = parser.parse_args(words)
    if options.what != "merge" and not options.paths and not options.lists:
        parser.error(f"{options.what}: give a PATH or a --list")
    try:
        _check_together(options)
    except ValueError as error:
        parser.error(f"{options.what}: {error}")
    return options


def _check_together(options: argparse.Namespace) -> None:
    """Raises ValueError for options that no file could be tested with."""
    given = {name: getattr(options, name, None) or "" for name in READERS}
    has_surface = with_options(FileOptions(), given, "").body == "surface"
    check_tests(options, has_surface)
    for name in ("states", "samples"):
        is_used = options.what == "robot" and not (name == "samples" and options.srdf)
        if is_used and getattr(options, name) > options.chunk * _MOST_CHUNKS:
            raise ValueError(f"--{name} has more than {_MOST_CHUNKS} chunks of {options.chunk}: raise --chunk")


def check_tests(options: argparse.Namespace, has_surface: bool) -> None:
    """Raises ValueError for policies and depths that files with surfaces, or others, could not be tested with."""
    for words in policy_words(options):
        try:
            exact = choose_policies(words, "surface" if has_surface else "convex").exact
        except ValueError as error:
            raise ValueError(f"--policies: {error}") from error
        if has_surface and exact not in ("surface", "none"):
            raise ValueError(f"a surface is tested with exact=surface or none, not exact={exact}")
        if getattr(options, "min_depth", 0) and exact in ("surface", "none"):
            raise ValueError(f"--min-depth wants depths, and exact={exact} has none")


def policy_words(options: argparse.Namespace) -> List[Optional[str]]:
    """The words of each --policies."""
    words = getattr(options, "policies", None)
    return (words or [None]) if isinstance(words, list) else [words]
