"""Clips: recorded motion of one or several characters, frame by frame on one clock."""

from __future__ import annotations

from typing import Any, List, NamedTuple, Optional, Tuple

import numpy as np

from . import _cab
from ._arrays import ArrayLike, Float32Array, StructuredArray, borrowed
from ._body import Body, is_column
from ._errors import BusyError
from ._options import Exact, Isa, Order
from ._policies import Policies, PoliciesLike, policies_of
from ._table import LinkNames, Table, table_of
from ._world import warn_flagged

_BETWEEN, _WITHIN = 0, 1
_HITS, _, _DISTANCES = range(3)

CLIP_HIT = np.dtype(
    [("frame", "u4"), ("a", "u4"), ("link_a", "u2"), ("b", "u4"), ("link_b", "u2"), ("depth", "f4")]
)
INTERVAL = np.dtype(
    [
        ("a", "u4"),
        ("link_a", "u2"),
        ("b", "u4"),
        ("link_b", "u2"),
        ("first", "u4"),
        ("last", "u4"),
        ("seconds", "f8"),
        ("depth", "f4"),
        ("deepest", "u4"),
    ]
)
DISTANCE = np.dtype(
    [("frame", "u4"), ("a", "u4"), ("link_a", "u2"), ("b", "u4"), ("link_b", "u2"), ("distance", "f4")]
)


class _Character(NamedTuple):
    name: str
    body: Body
    batch: int
    frame_input: _cab.FrameInput


def _exact_policies(policies: PoliciesLike, exact: Optional[Exact], default: Exact) -> Policies:
    # An exact test of the caller's policies stands, unless `exact` overrules it.
    chosen = policies_of(policies, exact)
    return policies_of(chosen, default) if exact is None and chosen.exact == "none" else chosen


def intervals_of(hits: StructuredArray, fps: float, gap: int = 0) -> StructuredArray:
    """Runs of frames in which two links touch, of hits (`cab.CLIP_HIT`) in any order: `cab.INTERVAL`.

    It is what `Clip.intervals` makes of `Clip.hits`, for hits that come from several calls.
    """
    order = np.lexsort((hits["frame"], hits["link_b"], hits["link_a"], hits["b"], hits["a"]))
    hits = hits[order]
    if len(hits) == 0:
        return np.empty(0, dtype=INTERVAL)
    same = np.ones(len(hits) - 1, dtype=bool)
    for key in ("a", "b", "link_a", "link_b"):
        same &= hits[key][1:] == hits[key][:-1]
    frames = hits["frame"].astype(np.int64)
    starts = np.append(0, np.flatnonzero(~(same & (np.diff(frames) <= gap + 1))) + 1)
    ends = np.append(starts[1:], len(hits))
    rows = np.empty(len(starts), dtype=INTERVAL)
    for key in ("a", "b", "link_a", "link_b"):
        rows[key] = hits[key][starts]
    rows["first"] = frames[starts]
    rows["last"] = frames[ends - 1]
    rows["seconds"] = (frames[ends - 1] - frames[starts] + 1) / fps
    rows["depth"] = np.maximum.reduceat(hits["depth"], starts)
    run = np.repeat(np.arange(len(starts)), ends - starts)
    first_deepest = np.lexsort((frames, -hits["depth"], run))[starts]
    rows["deepest"] = frames[first_deepest]
    return rows


class Clip:
    """Recorded motion of characters, to find where it touches what it should not. Frames are tested sixteen at a time.

    fps      frames per second, for durations.
    threads  how many threads calls run on; 0: all cores.
    isa      the instruction set, one of `cab.isas()`, or "auto".

    With `body` and `poses` the clip has its first character at once; `add` adds more.
    """

    def __init__(
        self,
        body: Optional[Body] = None,
        poses: Optional[Float32Array] = None,
        *,
        fps: float = 30.0,
        threads: int = 1,
        isa: Isa = "auto",
        **arguments: Any,
    ) -> None:
        if not fps > 0:
            raise ValueError(f"fps: a number above 0 is wanted, and {fps!r} is given")
        self._engine = _cab.Engine(isa, threads)
        self._fps = float(fps)
        self._frames = 1
        self._characters: List[_Character] = []
        self._stats: Optional[_cab.FrameStats] = None
        if body is not None and poses is not None:
            self.add(body, poses, **arguments)
        elif body is not None or poses is not None or arguments:
            raise TypeError("give both body and poses, or neither")

    def __repr__(self) -> str:
        return f"cab.Clip({self._frames} frames at {self._fps:g} per second: {', '.join(self.names) or 'nobody'})"

    def __enter__(self) -> Clip:
        return self

    def __exit__(self, *unused: object) -> None:
        self.close()

    def close(self) -> None:
        """Gives all memory back. Further calls are a ValueError."""
        self._characters.clear()
        self._engine.close()

    def add(
        self,
        body: Body,
        poses: Float32Array,
        *,
        origins: Optional[ArrayLike] = None,
        orientations: Optional[ArrayLike] = None,
        scales: Optional[ArrayLike] = None,
        name: Optional[str] = None,
        order: Order = "row",
        has_scale: bool = False,
    ) -> int:
        """Adds a character, and returns its number, from 0 on.

        poses  float32 (frames, links, 7), (frames, links, 3, 4) or (frames, links, 4, 4), from link to character, as in
               `Batch.posed`. One frame: a fixed object, such as a table, that is there in every frame.
        origins, orientations, scales, order, has_scale  as in `Batch.posed`, one entry per frame.
        name   for messages. Default: "character 0", and so on.

        Arrays are borrowed: write into them, and the next call sees it. Lists are copied. All characters that move
        have equally many frames, else it is a ValueError.
        """
        shape: Tuple[int, ...] = getattr(poses, "shape", ())
        frames = shape[0] if shape else 0
        if frames > 1 and self._frames > 1 and frames != self._frames:
            raise ValueError(f"poses: the clip has {self._frames} frames, and {frames} are given")
        articulation = self._engine.add_articulation(body._data)
        batch = 0
        try:
            batch = self._engine.add_batch(articulation, max(frames, 1), True)
            frame_input = self._engine.make_input(
                batch, poses, is_column(order), has_scale,
                origins=borrowed(origins, "f8", "origins", (None, 3), "(frames, 3)"),
                orientations=borrowed(orientations, "f4", "orientations", (None, 4), "(frames, 4)"),
                scales=borrowed(scales, "f4", "scales", (None,), "(frames,)"),
            )
        except Exception:
            try:
                if batch:
                    self._engine.remove_batch(batch)
                self._engine.remove_articulation(articulation)
            except BusyError:  # another thread is in a call: the engine keeps what no call names until `close`
                pass
            raise
        number = len(self._characters)
        self._frames = max(self._frames, frames)
        self._characters.append(_Character(name or f"character {number}", body, batch, frame_input))
        return number

    @property
    def frames(self) -> int:
        """How many frames there are."""
        return self._frames

    @property
    def fps(self) -> float:
        """Frames per second."""
        return self._fps

    @property
    def names(self) -> Tuple[str, ...]:
        """The names of the characters."""
        return tuple(character.name for character in self._characters)

    @property
    def stats(self) -> Optional[_cab.FrameStats]:
        """What the last call tested, as `Frame.stats`. None before there was one."""
        return self._stats

    def link_name(self, character: int, link: int) -> str:
        """The name of a link."""
        return self._characters[int(character)].body.names[int(link)]

    def table(self, rows: StructuredArray) -> Table:
        """Rows of `hits`, `intervals` or `distances` with the names of characters and links, as people read them.

        Returns a `Table` of the same columns; `print` shows it. Names are those of the clip as it is now.
        """
        links = LinkNames([character.body.names for character in self._characters])
        names = np.array(self.names, dtype=np.str_)
        return table_of(
            rows,
            {
                "a": lambda: names[rows["a"]],
                "link_a": lambda: links(rows["a"], rows["link_a"]),
                "b": lambda: names[rows["b"]],
                "link_b": lambda: links(rows["b"], rows["link_b"]),
            },
        )

    def _run(
        self, dtype: np.dtype[np.void], within: bool, between: bool, chosen: Policies, margin: float,
        min_depth: float, report: int, with_depths: bool = True, containment: bool = True,
    ) -> Tuple[StructuredArray, Float32Array]:
        rules: List[Tuple[int, int, int, int]] = []
        for k, one in enumerate(self._characters):
            if within:
                rules.append((one.batch, one.batch, _WITHIN, 0))
            if between:
                rules.extend((one.batch, other.batch, _BETWEEN, 0) for other in self._characters[k + 1 :])
        hits, contacts, stats = self._engine.run_frame(
            [one.frame_input for one in self._characters], rules, chosen._names(), margin, min_depth, report,
            with_depths and (chosen.exact in ("convex", "fcl") or report == _DISTANCES), containment,
        )
        self._stats = stats
        if stats.instances_masked:
            warn_flagged(
                self._engine,
                [(one.frame_input, f"{one.name}, frame", one.body.names) for one in self._characters],
                3,
            )
        depths = np.full(len(hits), np.nan, dtype=np.float32) if contacts is None else contacts["depth"]
        return self._rows(dtype, hits, depths)

    def _rows(
        self, dtype: np.dtype[np.void], hits: StructuredArray, depths: Float32Array
    ) -> Tuple[StructuredArray, Float32Array]:
        # Rows by frames, and their depths.
        slots = [one.batch & 0xFFFFFFFF for one in self._characters]
        number = np.zeros(max(slots, default=0) + 1, dtype=np.uint32)
        number[slots] = np.arange(len(slots), dtype=np.uint32)
        a, b = number[hits["batch_a"]], number[hits["batch_b"]]
        # A fixed object has the instance 0 in every frame. What touches among fixed objects touches in every frame, and
        # the engine has tested it once.
        frames = np.maximum(hits["instance_a"], hits["instance_b"])
        fixed = np.array([one.frame_input.count == 1 for one in self._characters], dtype=bool)
        once = np.flatnonzero(fixed[a] & fixed[b])
        index = np.concatenate([np.arange(len(hits)), np.tile(once, self._frames - 1)])
        frames = np.concatenate([frames, np.repeat(np.arange(1, self._frames, dtype=np.uint32), len(once))])
        order = np.lexsort((index, frames))
        index = index[order]
        rows = np.empty(len(index), dtype=dtype)
        rows["frame"] = frames[order]
        rows["a"] = a[index]
        rows["b"] = b[index]
        rows["link_a"] = hits["link_a"][index]
        rows["link_b"] = hits["link_b"][index]
        return rows, depths[index]

    def _default_exact(self) -> Exact:
        return "surface" if any(one.body.is_surface for one in self._characters) else "convex"

    def hits(
        self,
        *,
        within: bool = True,
        between: bool = True,
        exact: Optional[Exact] = None,
        min_depth: float = 0,
        margin: float = 0,
        policies: PoliciesLike = None,
        depths: bool = True,
        containment: bool = True,
    ) -> StructuredArray:
        """Every two links that touch, in every frame: `cab.CLIP_HIT`.

        within     whether links of one character are tested with each other, but for its body's ignored pairs.
        between    whether different characters are.
        exact      "convex": exact shapes, with depths. "none": boxes alone, and depth is NaN. "surface": triangles of
                   surfaces (`Body.from_surface`), and depth is NaN. Default: the exact test of `policies`, or if they
                   have none "surface" where a body is one, else "convex".
        min_depth  a length: what is less deep does not count.
        margin     a length: links that are at most this far apart count too, with a depth below 0.
        depths     whether depths are wanted, which take most of the time. Without them depth is NaN.
        containment  with "surface": whether what is wholly inside a closed part of a surface touches it.

        Returns a structured array: frame, a, link_a, b, link_b (a and b are numbers of characters, equal within one),
        depth: how far b must move to be free, by the shortest way found.
        """
        chosen = _exact_policies(policies, exact, self._default_exact())
        rows, found = self._run(CLIP_HIT, within, between, chosen, margin, min_depth, _HITS, depths, containment)
        rows["depth"] = found
        return rows

    def intervals(
        self,
        *,
        within: bool = True,
        between: bool = True,
        exact: Optional[Exact] = None,
        min_depth: float = 0,
        margin: float = 0,
        gap: int = 0,
        policies: PoliciesLike = None,
        containment: bool = True,
    ) -> StructuredArray:
        """Runs of frames in which two links touch: `cab.INTERVAL`. Arguments are those of `hits`.

        gap  runs of the same two links with at most so many frames between them are one.

        Returns a structured array, one entry per run, by links, then time: a, link_a, b, link_b, first and last frame,
        seconds, depth (the largest in the run) and deepest (the frame that has it, the first of several).
        """
        hits = self.hits(
            within=within, between=between, exact=exact, min_depth=min_depth, margin=margin, policies=policies,
            containment=containment,
        )
        return intervals_of(hits, self._fps, gap)

    def distances(
        self,
        most: float,
        *,
        within: bool = False,
        between: bool = True,
        exact: Optional[Exact] = None,
        policies: PoliciesLike = None,
    ) -> StructuredArray:
        """In every frame the two links of two characters that are nearest: `cab.DISTANCE`.

        most    a length: characters that are farther apart are left out.
        within  whether the two nearest links of one character are reported too, without its body's ignored pairs.

        Returns a structured array: frame, a, link_a, b, link_b, distance; below 0: minus the depth.
        """
        chosen = _exact_policies(policies, exact, "convex")
        if chosen.exact == "none":
            raise ValueError("exact: distances are those of exact shapes; 'convex' has them")
        rows, depths = self._run(DISTANCE, within, between, chosen, most, 0, _DISTANCES)
        rows["distance"] = -depths
        return rows
