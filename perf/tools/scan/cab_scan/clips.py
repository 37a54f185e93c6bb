"""Rows of clips, on a worker: self-penetration, pairs of people, several policies at a time."""

from typing import Iterator, List, NamedTuple, Tuple

import cab
import numpy as np

from .clock import core_seconds
from .contacts import Summary, chunk_frames
from .notes import notes_text
from .policies import policies_of
from .printable import table_text
from .sequences import Sequence, load
from .work import PAIRS, Item, Row


class _Chunks(NamedTuple):
    """Characters of one clip, of which some frames are tested at a time."""

    characters: List[Sequence]
    frames: int
    fps: float

    def run(self, summary: Summary, item: Item, policies: str) -> None:
        chosen = policies_of(policies)
        pairs = item.what == PAIRS
        step = chunk_frames(sum(one.body.link_count for one in self.characters))
        for first in range(0, self.frames, step):
            last = min(first + step, self.frames)
            with cab.Clip(fps=self.fps) as clip:
                for one in self.characters:
                    fixed = len(one.poses) == 1  # it is there in every frame
                    part = slice(0, 1) if fixed else slice(first, last)
                    origins = None if one.origins is None else one.origins[part]
                    clip.add(one.body, one.poses[part], origins=origins, order=one.order)
                hits = clip.hits(
                    within=not pairs, between=pairs, policies=chosen, exact=chosen.exact, min_depth=item.test.min_depth
                )
                hits["frame"] += np.uint32(first)
                summary.add(hits, clip.stats)


def clip_rows(item: Item, policies: Tuple[str, ...]) -> Iterator[Row]:
    """The rows of an item, by policies: of every sequence of its file, or of the first of both files of a pair."""
    start = core_seconds()
    for characters in _scenes(item):
        load_seconds = core_seconds() - start
        # Who has one frame stands still in all frames of the other, and has no clock.
        moving = [one for one in characters if len(one.poses) > 1] or characters
        # What two people do beyond the end of the shorter clip nobody knows.
        frames = min(len(one.poses) for one in moving)
        for chosen in policies:
            yield _row(item, chosen, _Chunks(characters, frames, moving[0].fps), load_seconds)
        start = core_seconds()


def _scenes(item: Item) -> Iterator[List[Sequence]]:
    first = load(item.source.path, item.source.options, item.test.loader, item.part)
    if item.other is None:
        for sequence in first:
            yield [_ignoring(sequence, item.test.hops)]
        return
    second = load(item.other.path, item.other.options, item.test.loader, item.part)
    for one, two in zip(first, second):
        if abs(one.fps - two.fps) > 1e-3 * one.fps and len(one.poses) > 1 and len(two.poses) > 1:
            raise ValueError(
                f"{item.source.path} has {one.fps:g} frames per second and {item.other.path} {two.fps:g}: a pair has "
                "one clock"
            )
        yield [one, two]


def _ignoring(sequence: Sequence, hops: int) -> Sequence:
    return sequence._replace(body=sequence.body.ignoring(hops=hops)) if hops else sequence


def _cut(sequence: Sequence, frames: int, other: str) -> Tuple[str, ...]:
    """Says how many frames of a sequence come after the end of the other file of its pair."""
    count = len(sequence.poses)
    if count <= max(frames, 1):
        return ()
    verb = "is" if count - frames == 1 else "are"
    return (f"{count - frames} of {count} frames {verb} not tested: {other} ends first",)


def _row(item: Item, policies: str, chunks: _Chunks, load_seconds: float) -> Row:
    start = core_seconds()
    characters = chunks.characters
    row = Row(item.key(policies), sequence=table_text(characters[0].name))
    summary = Summary(chunks.fps, item.test.gap, item.test.intervals)
    chunks.run(summary, item, policies)
    files = [item.source.name, item.other_name] if item.other else [""]
    row.notes = notes_text(
        item, *(one.notes + _cut(one, chunks.frames, other) for one, other in zip(characters, reversed(files)))
    )
    row.frames = chunks.frames
    row.links = sum(one.body.link_count for one in characters)
    summary.fill(row, lambda character, link: (files[character], characters[character].body.names[link]))
    row.load_seconds = load_seconds
    row.seconds = core_seconds() - start
    return row
