"""Worlds: characters that live at the same time, and which of their links touch."""

from __future__ import annotations

import operator
import threading
import warnings
from typing import Any, Dict, Iterable, List, Literal, NamedTuple, Optional, Sequence, Tuple, Union, get_args

import numpy as np

from . import _cab
from ._arrays import (
    ArrayLike, BoolArray, Float32Array, StructuredArray, UInt8Array, UInt32Array, borrowed, small_array,
)
from ._body import Body, ShapesLike, box_array, is_column, shape_rows
from ._errors import BusyError, Error, InputError, MaskedWarning
from ._options import Exact, Isa, Order, QueryReport, Report, Resting
from ._policies import PoliciesLike, policies_of
from ._queries import Answers, Queries
from ._status import Status
from ._table import LinkNames, Table, table_of

_REPORTS = get_args(Report)
_RESTING = get_args(Resting)
_QUERY_REPORTS = get_args(QueryReport)
_BETWEEN, _WITHIN = 0, 1


class Posed:
    """Characters of one batch with their poses, for one call or several. `Batch.posed` makes it.

    It borrows the arrays, and keeps them alive: write into them and run the next frame. Nothing is copied, but for
    lists, and for `instances` unless they are uint32.
    """

    __slots__ = ("_batch", "_input")

    def __init__(self, batch: Batch, frame_input: _cab.FrameInput) -> None:
        """For `Batch.posed`."""
        self._batch = batch
        self._input = frame_input

    @property
    def batch(self) -> Batch:
        """The batch of the characters."""
        return self._batch

    @property
    def flags(self) -> UInt8Array:
        """(n,) uint8: 0 for characters that the last frame did not mask; 1: a number was not finite; 2: not rigid.

        Queries do not change it.
        """
        flags: Any = self._input.flags
        return flags  # type: ignore[no-any-return]

    @property
    def in_contact(self) -> Optional[BoolArray]:
        """(n,) bool: which characters were in a hit of the last frame; None if it was not asked for."""
        return self._input.in_contact

    @property
    def poses_address(self) -> int:
        """Where the engine reads poses: `poses.ctypes.data` of the array that was given."""
        return self._input.poses_address

    def __repr__(self) -> str:
        return f"cab.Posed({self._input.count} of {self._batch!r})"


class Batch:
    """Characters of one body in a world, or bodies that never move. Hits name it by its `slot`."""

    __slots__ = ("_world", "_body", "_id", "_room", "_is_static")

    def __init__(self, world: World, body: Optional[Body], batch_id: int, room: int) -> None:
        """For `World.add` and `World.add_static`."""
        self._world = world
        self._body = body
        self._id = batch_id
        self._room = room
        self._is_static = body is None

    @property
    def slot(self) -> int:
        """What `batch_a` and `batch_b` of hits say."""
        return self._id & 0xFFFFFFFF

    @property
    def room(self) -> int:
        """How many characters there may be. Poses of fewer are those of the first ones."""
        return self._room

    @property
    def body(self) -> Body:
        """The body of the characters. A static batch has none: ValueError."""
        if self._body is None:
            raise ValueError("a static batch has no body")
        return self._body

    @property
    def is_static(self) -> bool:
        """Whether the batch is of bodies that never move."""
        return self._is_static

    def grow(self, room: int) -> None:
        """Makes room for more characters. The numbers of those that are there stay.

        `slot` changes only if a batch of a lower slot was removed before. What was posed, and histories of the batch,
        are of no use any more. A room that is not larger, or is refused, changes nothing.
        """
        if self._is_static:
            raise ValueError("a static batch cannot grow")
        if room > self._room:
            self._world._grow(self, room)

    def posed(
        self,
        poses: Float32Array,
        *,
        origins: Optional[ArrayLike] = None,
        orientations: Optional[ArrayLike] = None,
        scales: Optional[ArrayLike] = None,
        layers: Optional[ArrayLike] = None,
        layer_masks: Optional[ArrayLike] = None,
        margins: Optional[ArrayLike] = None,
        moved: Optional[ArrayLike] = None,
        bounds: Optional[ArrayLike] = None,
        instances: Optional[ArrayLike] = None,
        in_contact: bool = False,
        order: Order = "row",
        has_scale: bool = False,
    ) -> Posed:
        """Characters with their poses. Arrays are borrowed, never copied or converted; lists are copied.

        poses         float32, from link to character ("model space"):
                      (n, links, 7)     quaternion x y z w, translation x y z
                      (n, links, 3, 4)  matrix by rows, translation in the last column
                      (n, links, 4, 4)  the same with a last row, which must be 0 0 0 1
                      With `order="column"` only (n, links, 4, 4), indexed by column, then row, as in glTF and ozz.
                      Matrices in the other order are a ValueError, if any of them has a translation.
                      n is at most `room`. Axes of characters and links may have any stride that is a positive multiple
                      of 4 bytes; the numbers of one pose lie side by side, by rows or by columns.
        origins       float64 (n, 3): where the characters stand in the world. Default: 0.
        orientations  float32 (n, 4): quaternions x y z w that turn them about their origins.
        scales        float32 (n,): a factor per character about its origin, from 1e-3 to 1e3.
        layers        uint32 (n,): bits of the layers that a character is on. Default: all.
        layer_masks   uint32 (n,): bits of the layers that it is tested against. Default: all.
        margins       float32 (n,): a length, a margin of its own.
        moved         bool (n,): False for characters that rest: all about them is as in the last frame.
        bounds        float32 (n, 2, 3): lower and upper corners that hold their boxes, relative to the origins.
        instances     integers, ascending: the characters that are there in this call. Default: all n. A packed array
                      of uint32 is borrowed; a list and other integers are copied.
        in_contact    whether frames fill `Posed.in_contact`.
        has_scale     whether matrices hold a uniform scale, from 1e-3 to 1e3.

        Raises TypeError for a wrong type or dtype, ValueError for a shape or strides that do not fit.
        """
        listed = None if instances is None else small_array(
            instances, "u4", "instances", (None,), "(k,)", copy=False
        )
        made = self._world._engine.make_input(
            self._id, poses, is_column(order), has_scale,
            origins=borrowed(origins, "f8", "origins", (None, 3), "(n, 3)"),
            orientations=borrowed(orientations, "f4", "orientations", (None, 4), "(n, 4)"),
            scales=borrowed(scales, "f4", "scales", (None,), "(n,)"),
            layers=borrowed(layers, "u4", "layers", (None,), "(n,)"),
            layer_masks=borrowed(layer_masks, "u4", "layer_masks", (None,), "(n,)"),
            margins=borrowed(margins, "f4", "margins", (None,), "(n,)"),
            moved=borrowed(moved, "?", "moved", (None,), "(n,)"),
            bounds=borrowed(bounds, "f4", "bounds", (None, 2, 3), "(n, 2, 3)"),
            instances=listed,
            in_contact=in_contact,
        )
        return Posed(self, made)

    def __repr__(self) -> str:
        what = "static bodies" if self._body is None else f"characters of {self._body.link_count} links"
        return f"cab.Batch(slot {self.slot}, room for {self._room} {what})"


class Frame(NamedTuple):
    """What a frame found.

    hits        structured, sorted: batch_a, instance_a, batch_b, instance_b, link_a, link_b, leaf_a, leaf_b
                (`cab.HIT`). One entry per two links that touch. batch_a is the `slot` of a batch.
    contacts    structured, one per hit, with an exact test: normal (3,) from a to b in the world's axes, depth (below
                0: minus the gap), point_a and point_b (3,) relative to the origin of instance_a, leaf_a, leaf_b
                (`cab.CONTACT`). None without.
    stats       counts and seconds: candidates, box_tests, instances_masked, seconds_total and others.
    posed       what was given, with `flags` and `in_contact` of each.
    """

    hits: StructuredArray
    contacts: Optional[StructuredArray]
    stats: _cab.FrameStats
    posed: Tuple[Posed, ...]


PosesLike = Union[Float32Array, Posed, Sequence[Posed]]

Masked = Tuple[_cab.FrameInput, str, Sequence[str]]  # input, what its instances are called, names of links


def warn_flagged(engine: _cab.Engine, inputs: Iterable[Masked], level: int) -> None:
    """Warns of the instances that a frame has masked: per input of the first one, and how many there are."""
    for frame_input, what, names in inputs:
        if frame_input.flags is None:
            continue
        masked = np.flatnonzero(frame_input.flags)
        if len(masked):
            try:
                _, link, reason = engine.why_masked(frame_input, int(masked[0]))
                words = f": {reason}{_named(link, names)}"
            except (Error, ValueError):  # another thread is in the engine, or has changed it: the frame is worth more
                words = ""
            _warn_of(f"{what} {masked[0]} took no part{words}", len(masked) - 1, level)


def warn_found(engine: _cab.Engine, inputs: Sequence[Masked], count: int, level: int) -> None:
    """Warns of the `count` instances that a call without flags has masked: of the first one, if it is to be found."""
    try:
        found = engine.find_masked([one[0] for one in inputs])
    except (Error, ValueError):  # as above
        found = None
    if found is None:
        warnings.warn(f"{count} characters took no part", MaskedWarning, stacklevel=level + 1)
        return
    at, instance, link, reason = found
    _, what, names = inputs[at]
    _warn_of(f"{what} {instance} took no part: {reason}{_named(link, names)}", count - 1, level)


def _named(link: int, names: Sequence[str]) -> str:
    return f" (link {link} is {names[link]})" if names[link] != f"link {link}" else ""


def _warn_of(words: str, others: int, level: int) -> None:
    more = f"; {others} more took no part" if others > 0 else ""
    warnings.warn(words + more, MaskedWarning, stacklevel=level + 2)


def refuse_arguments(arguments: Dict[str, Any], why: str) -> None:
    """Raises TypeError if there are any: they would have no effect."""
    if arguments:
        raise TypeError(f"{', '.join(arguments)}: {why}")


class History:
    """The poses that a batch had at its last moments, for queries about the past. `World.add_history` makes it."""

    __slots__ = ("_world", "_batch", "_id")

    def __init__(self, world: World, batch: Batch, history_id: int) -> None:
        """For `World.add_history`."""
        self._world = world
        self._batch = batch
        self._id = history_id

    @property
    def batch(self) -> Batch:
        """The batch whose poses are kept."""
        return self._batch

    def record(self, time: float, poses: Union[Posed, Float32Array], **arguments: Any) -> None:
        """Copies the poses of a moment: what `Batch.posed` made, or an array with the arguments of `Batch.posed`.

        time is in seconds, or what the caller counts in, and above that of the last moment. The earliest moment goes
        once there are as many as there is room for. Masked characters are absent.
        """
        if isinstance(poses, Posed):
            refuse_arguments(arguments, "give these to Batch.posed, which made the poses")
        posed = poses if isinstance(poses, Posed) else self._batch.posed(poses, **arguments)
        self._world._engine.record_tick(self._id, posed._input, time)

    @property
    def span(self) -> Tuple[int, float, float]:
        """How many moments there are, and the times of the earliest and the latest. Without one the times are 0."""
        return self._world._engine.history_span(self._id)

    def remove(self) -> None:
        """Gives its memory back."""
        self._world._engine.remove_history(self._id)

    def __repr__(self) -> str:
        return f"cab.History(of {self._batch!r})"


class World:
    """Characters and static bodies that live at the same time.

    threads  how many threads calls run on; 0: all cores. The interpreter's lock is released in calls. Queries, boxes
             and contacts may run in several threads at a time. A frame runs alone: another call gets `BusyError`.
    isa      the instruction set, one of `cab.isas()`, or "auto". All give the same bits.
    """

    def __init__(self, *, threads: int = 1, isa: Isa = "auto") -> None:
        self._engine = _cab.Engine(isa, threads)
        self._batches: Dict[int, Batch] = {}
        self._articulations: Dict[int, Tuple[Body, int]] = {}  # by id(body): the body, its articulation
        self._last: Tuple[Posed, ...] = ()
        self._changes = threading.Lock()  # held by what adds and removes, which are several calls of the engine

    def __repr__(self) -> str:
        rooms = [f"{batch.room} {'static bodies' if batch.is_static else 'characters'}" for batch in self.batches]
        return f"cab.World({', '.join(rooms) or 'empty'})"

    def __enter__(self) -> World:
        return self

    def __exit__(self, *unused: object) -> None:
        self.close()

    def close(self) -> None:
        """Gives all memory back. Further calls are a ValueError."""
        self._batches.clear()
        self._articulations.clear()
        self._last = ()
        self._engine.close()

    # ------------------------------------------------------------------------------------------- what there is

    def add(self, body: Body, count: int = 1) -> Batch:
        """Adds room for `count` characters of a body, at any time. Raises `InputError` for a body that is refused."""
        with self._changes:
            if id(body) not in self._articulations:
                self._articulations[id(body)] = (body, self._engine.add_articulation(body._data))
            try:
                batch_id = self._engine.add_batch(self._articulations[id(body)][1], count, False)
            except Exception:
                self._remove_unused()
                raise
            batch = Batch(self, body, batch_id, operator.index(count))
            self._batches[batch.slot] = batch
        return batch

    def add_static(
        self,
        half: Optional[ArrayLike] = None,
        *,
        center: Optional[ArrayLike] = None,
        axes: Optional[ArrayLike] = None,
        origins: Optional[ArrayLike] = None,
        rotations: Optional[ArrayLike] = None,
        shapes: Optional[Sequence[ShapesLike]] = None,
        vertices: Optional[ArrayLike] = None,
        triangles: Optional[ArrayLike] = None,
        mesh_origin: ArrayLike = (0, 0, 0),
    ) -> Batch:
        """Adds bodies that never move: boxes with shapes, and triangles of a mesh. They take part in every frame.

        half, center, axes, shapes  as in `Body.from_boxes`, one box per body, in the body's frame.
        origins    (bodies, 3): the place of each body's frame in the world. Default: 0.
        rotations  (bodies, 4): quaternions x y z w from its frame to the world. Default: no rotation.
        vertices   (n, 3), relative to `mesh_origin` (3,) in the world; triangles (m, 3), indices of vertices.

        Body i is instance i. Triangle t is instance `bodies + t`. Each has one link, 0.
        """
        boxes = box_array(np.empty((0, 3)) if half is None else half, center, axes)
        n = len(boxes)
        places = np.zeros((n, 3)) if origins is None else origins
        turns = np.tile(np.array([0, 0, 0, 1], "f4"), (n, 1)) if rotations is None else rotations
        triangle_array = small_array(() if triangles is None else triangles, "u4", "triangles", (None, 3), "(m, 3)")
        with self._changes:
            batch_id = self._engine.add_static(
                small_array(places, "f8", "origins", (n, 3), f"({n}, 3)"),
                small_array(turns, "f4", "rotations", (n, 4), f"({n}, 4)"),
                boxes,
                shape_rows(shapes, n),
                small_array(() if vertices is None else vertices, "f4", "vertices", (None, 3), "(n, 3)"),
                triangle_array,
                small_array(mesh_origin, "f8", "mesh_origin", (3,), "(3,)"),
            )
            batch = Batch(self, None, batch_id, n + len(triangle_array))
            self._batches[batch.slot] = batch
        return batch

    def remove(self, batch: Batch) -> None:
        """Removes a batch, and its body once no batch has it. Its slot goes to what is added next."""
        with self._changes:
            self._engine.remove_batch(batch._id)
            self._forget(batch)
            self._remove_unused()

    def _forget(self, batch: Batch) -> None:
        self._batches.pop(batch.slot, None)
        self._last = tuple(posed for posed in self._last if posed._batch is not batch)

    def _remove_unused(self) -> None:
        # A body that another thread's frame keeps from being removed goes with the next batch.
        used = {id(batch._body) for batch in self._batches.values()}
        for key, (_, articulation) in tuple(self._articulations.items()):
            if key not in used:
                try:
                    self._engine.remove_articulation(articulation)
                except BusyError:
                    continue
                del self._articulations[key]

    def _grow(self, batch: Batch, room: int) -> None:
        # Its slot is the lowest free one, unless another of a lower slot has gone.
        with self._changes:
            old = batch._id
            articulation = self._articulations[id(batch.body)][1]
            try:
                grown = self._engine.grow_batch(old, articulation, room)
            except Exception:
                if not self._engine.has_batch(old):  # memory ran out in the middle
                    self._forget(batch)
                    self._remove_unused()
                raise
            self._forget(batch)
            batch._id, batch._room = grown, operator.index(room)
            self._batches[batch.slot] = batch

    @property
    def batches(self) -> Tuple[Batch, ...]:
        """All batches, by slot."""
        return tuple(batch for _, batch in sorted(tuple(self._batches.items())))

    def batch_of(self, slot: int) -> Batch:
        """The batch that hits name by this slot. An unknown one is a KeyError."""
        return self._batches[int(slot)]

    def table(self, found: Union[Frame, Answers, StructuredArray]) -> Table:
        """What a frame or queries found, with the names of links, as people read it.

        found  a `Frame`, `Answers`, or their hits, or some of them, of batches that are still there.

        Returns a `Table`: the columns of `cab.HIT` without leaves, with the depth if the frame has contacts; or those
        of `cab.QUERY_HIT`. Links of static bodies have the name "static".
        """
        rows = found.hits if isinstance(found, (Frame, Answers)) else found
        slots = {slot: at for at, slot in enumerate(sorted(self._batches))}
        links = LinkNames(
            [("static",) if self._batches[slot].is_static else self._batches[slot].body.names for slot in slots]
        )

        def link(batch: str, name: str) -> Any:
            return links(np.array([slots[slot] for slot in rows[batch].tolist()], dtype=np.int64), rows[name])

        made = table_of(
            rows,
            {
                "link_a": lambda: link("batch_a", "link_a"),
                "link_b": lambda: link("batch_b", "link_b"),
                "link": lambda: link("batch", "link"),
            },
            left_out=("leaf_a", "leaf_b", "leaf"),
        )
        if isinstance(found, Frame) and found.contacts is not None:
            made.columns["depth"] = found.contacts["depth"]
        return made

    def ignored_pairs(self, batch: Batch) -> StructuredArray:
        """All pairs of links that are never tested with each other within a character, and why.

        Returns a structured array: a and b, the lower and the higher link, and reasons, a sum of 1: `ignored_pairs` of
        the body names them; 2: they are at most `ignored_hops` joints apart; 4: they touch in the rest pose.
        """
        return self._engine.ignored_pairs(self._articulations[id(batch.body)][1])

    def reserve(self, *, batches: int = 0, characters: int = 0) -> None:
        """Makes room for so many batches and characters in all, so that adding them later is cheap."""
        self._engine.reserve(batches, characters)

    # ------------------------------------------------------------------------------------------------- frames

    def _posed(self, poses: Any, arguments: Dict[str, Any]) -> Tuple[Posed, ...]:
        if poses is None:
            refuse_arguments(arguments, "there is no such argument, or it needs poses")
            return self._last
        if isinstance(poses, Posed):
            poses = (poses,)
        if isinstance(poses, (tuple, list)) and all(isinstance(item, Posed) for item in poses):
            refuse_arguments(arguments, "give these to Batch.posed, which made the poses")
            return tuple(poses)
        moving = [batch for batch in tuple(self._batches.values()) if not batch.is_static]
        if len(moving) != 1:
            raise ValueError(f"poses: the world has {len(moving)} batches; say [batch.posed(poses, ...), ...]")
        return (moving[0].posed(poses, **arguments),)

    def _inputs(self, posed: Sequence[Posed]) -> List[_cab.FrameInput]:
        for one in posed:
            if one._batch._world is not self:
                raise InputError(Status.UNKNOWN_BATCH, "poses: a batch of another world is given")
        static = [batch for batch in tuple(self._batches.values()) if batch.is_static]
        return [one._input for one in posed] + [
            self._engine.make_input(batch._id, None, False, False) for batch in static
        ]

    @staticmethod
    def _masked(posed: Sequence[Posed]) -> List[Masked]:
        return [(one._input, f"batch {one._batch.slot}, character", one._batch.body.names) for one in posed]

    def run(
        self,
        poses: PosesLike,
        *,
        origins: Optional[ArrayLike] = None,
        orientations: Optional[ArrayLike] = None,
        scales: Optional[ArrayLike] = None,
        layers: Optional[ArrayLike] = None,
        layer_masks: Optional[ArrayLike] = None,
        margins: Optional[ArrayLike] = None,
        moved: Optional[ArrayLike] = None,
        instances: Optional[ArrayLike] = None,
        order: Order = "row",
        has_scale: bool = False,
        pairs: Optional[Iterable[Tuple[Batch, Batch]]] = None,
        within: Union[bool, Iterable[Batch]] = False,
        policies: PoliciesLike = None,
        exact: Optional[Exact] = None,
        margin: float = 0,
        min_depth: float = 0,
        report: Report = "hits",
        contacts: Optional[bool] = None,
        resting: Resting = "reported",
        containment: bool = True,
    ) -> Frame:
        """Runs one frame: which links touch.

        poses      the poses of all characters, if the world has one batch: then origins, orientations, scales, layers,
                   layer_masks, margins, moved, instances, order and has_scale are those of `Batch.posed`. Else a list
                   of what `Batch.posed` made.
        pairs      which batches are tested against each other; (a, a) tests the characters of a among themselves.
                   Default: all that are posed, and static bodies.
        within     whether the links of each character are tested with each other: True, or the batches.
        policies   `Policies`, or the name of a preset. Default: "balanced".
        exact      "none" (default): overlapping boxes are hits. "convex": exact shapes decide. "fcl": FCL does.
                   "surface": as "convex", and of surfaces (`Body.from_surface`) their triangles decide.
        margin     a length: links that are at most this far apart are reported too.
        min_depth  a length: with an exact test, hits that are less deep are dropped.
        report     "hits"; "in_contact": only `Posed.in_contact`, faster; "distances": of every two characters at most
                   `margin` apart the two links that are nearest.
        contacts   whether contacts are computed. Default: with "convex" and "fcl". Surfaces have none.
        resting    what is done with hits of two that rest (`moved`): "reported" or "skipped".
        containment  with "surface": whether what is wholly inside a closed part of a surface is a hit.

        Raises `InputError` for what the engine refuses. Masked characters are a `MaskedWarning`.
        """
        if report not in _REPORTS:
            raise ValueError(f"report: {report!r} is none of {', '.join(_REPORTS)}")
        if resting not in _RESTING:
            raise ValueError(f"resting: {resting!r} is none of {', '.join(_RESTING)}")
        given = {
            "origins": origins,
            "orientations": orientations,
            "scales": scales,
            "layers": layers,
            "layer_masks": layer_masks,
            "margins": margins,
            "moved": moved,
            "instances": instances,
        }
        arguments: Dict[str, Any] = {name: value for name, value in given.items() if value is not None}
        if order != "row":
            arguments["order"] = order
        if has_scale:
            arguments["has_scale"] = True
        if report == "in_contact" and not isinstance(poses, (Posed, tuple, list)):
            arguments["in_contact"] = True
        posed = self._posed(poses, arguments)
        if report == "in_contact" and posed and all(one.in_contact is None for one in posed):
            raise ValueError("report: 'in_contact' needs Batch.posed(..., in_contact=True)")
        inputs = self._inputs(posed)
        chosen = policies_of(policies, exact)
        rest = _RESTING.index(resting)
        rules: List[Tuple[int, int, int, int]] = []
        if pairs is None:
            there = [one._batch for one in posed] + [batch for batch in self.batches if batch.is_static]
            for k, a in enumerate(there):
                for b in there[k:]:
                    if not (a.is_static and b.is_static):
                        rules.append((a._id, b._id, _BETWEEN, rest))
        else:
            rules.extend((a._id, b._id, _BETWEEN, rest) for a, b in pairs)
        inside = [one._batch for one in posed] if within is True else [] if within is False else within
        rules.extend((batch._id, batch._id, _WITHIN, rest) for batch in inside)
        default_contacts = (chosen.exact in ("convex", "fcl") and report != "in_contact") or report == "distances"
        with_contacts = default_contacts if contacts is None else contacts
        hits, found, stats = self._engine.run_frame(
            inputs, rules, chosen._names(), margin, min_depth, _REPORTS.index(report), with_contacts, containment
        )
        self._last = posed
        if stats.instances_masked:
            warn_flagged(self._engine, self._masked(posed), 2)
        return Frame(hits, found, stats, posed)

    def contacts(
        self,
        pairs: StructuredArray,
        poses: Optional[PosesLike] = None,
        **arguments: Any,
    ) -> StructuredArray:
        """How deep named links touch, or how far they are apart, at any distance, by exact shapes.

        pairs  `cab.HIT` (n,): of each only batches, instances and links are read.
        poses  as in `run`; None: those of the last frame, as their arrays are now.

        Returns `cab.CONTACT` (n,). A masked link has the depth minus infinity.
        """
        posed = self._posed(poses, arguments)
        return self._engine.compute_contacts(self._inputs(posed), pairs)

    def touching_triangles(
        self,
        pairs: StructuredArray,
        poses: Optional[PosesLike] = None,
        **arguments: Any,
    ) -> StructuredArray:
        """The triangles of surfaces (`Body.from_surface`) that touch, of named links, such as the hits of a frame.

        pairs  `cab.HIT` (n,): of each only batches, instances and links are read.
        poses  as in `run`; None: those of the last frame, as their arrays are now.

        Returns `cab.TOUCHING_TRIANGLES`, sorted: pair (which of `pairs`), leaf_a, leaf_b, triangle_a, triangle_b:
        rows of `Body.triangles[leaf]`. `SkinnedBody.source_triangles[leaf]` says which of the mesh's they are.
        """
        posed = self._posed(poses, arguments)
        return self._engine.find_touching_triangles(self._inputs(posed), pairs)

    def boxes(self, posed: Posed, policies: PoliciesLike = None) -> StructuredArray:
        """All boxes of each character, `center`, `axis` and `half`, relative to its origin along the world's axes.

        Returns a structured array (n, nodes): leaves first, in the order of the body's boxes, the root last.
        """
        return self._engine.compute_boxes(posed._input, policies_of(policies, None)._names())

    def sweep_margins(self, last: Posed, now: Posed) -> Float32Array:
        """Margins (n,) for `Batch.posed`, so that a frame finds all that may have touched since `last`.

        What moves needs an array of its own in each: arrays are borrowed, so keep a copy for `last` before you write
        into one. If poses, origins, orientations and scales of both are the same arrays, it is a ValueError.
        """
        return self._engine.sweep_margins(last._input, now._input)

    def touching_moments(
        self, last: Sequence[Posed], now: Sequence[Posed], pairs: StructuredArray, resolution: float
    ) -> Float32Array:
        """For each pair (`cab.HIT`) the first moment between two frames, 0 to 1, at which its shapes touch; 2: never.

        last, now   of each batch, with arrays of their own for what moves, as in `sweep_margins`; what rests may have
                    the same.
        resolution  a length: shapes that pass each other nearer than this may have a moment too.

        Both are proven, not sampled: before the moment, or never, the shapes are apart. In between, links turn along
        the straight line between two quaternions: 0.9 degrees off an even turn of 90, 8 of 180.
        """
        return self._engine.find_touching_moments(self._inputs(last), self._inputs(now), resolution, pairs)

    def spatial_order(self, batch: Batch) -> UInt32Array:
        """The numbers of a batch's characters so that neighbours in the list are near each other in the world."""
        return self._engine.spatial_order(batch._id)

    # ------------------------------------------------------------------------------------------------ queries

    def query(
        self,
        queries: Queries,
        poses: Optional[PosesLike] = None,
        *,
        exact: Literal["none", "convex", "surface"] = "none",
        histories: Sequence[History] = (),
        reuse_bounds: bool = False,
        report: QueryReport = "hits",
        surface_points: bool = False,
        **arguments: Any,
    ) -> Answers:
        """Answers queries: which links rays meet, shapes overlap, points are near, regions contain.

        queries       what `cab.rays`, `cab.spheres`, `cab.boxes`, `cab.capsules`, `cab.points` or `cab.regions` made,
                      or several added up.
        poses         as in `run`; None: those of the last frame, as their arrays are now.
        exact         "none" (default): boxes are the answer. "convex": exact shapes are. "surface": the same, and of a
                      skin its triangles, for rays and regions alone.
        histories     what queries with a time of their own ask.
        reuse_bounds  states that the arrays are those of the last frame, unchanged: it saves posing.
        report        "hits"; "links": hits without where they were met, a third of the memory; "counts": only
                      `Answers.counts`. Queries that find many links are faster so.
        surface_points  whether `Answers.surface_points` says where on the triangles of surfaces hits are; with
                      exact="surface" and report="hits".

        Raises `InputError` for a query that is refused, with its number.
        """
        if report not in _QUERY_REPORTS:
            raise ValueError(f"report: {report!r} is none of {', '.join(_QUERY_REPORTS)}")
        if surface_points and report != "hits":
            raise ValueError(f"surface_points: hits in full have them, not report={report!r}")
        posed = self._posed(poses, arguments)
        hits, counts, found, points, stats = self._engine.run_queries(
            self._inputs(posed),
            [one._id for one in histories],
            queries.array,
            queries.planes,
            exact,
            reuse_bounds,
            _QUERY_REPORTS.index(report),
            surface_points,
        )
        if stats.instances_masked:
            warn_found(self._engine, self._masked(posed), stats.instances_masked, 2)
        return Answers(hits, found, stats, counts, points)

    def add_history(self, batch: Batch, ticks: int) -> History:
        """Makes room for the poses of a batch at its last `ticks` moments, 1 to 65536."""
        return History(self, batch, self._engine.add_history(batch._id, ticks))

    # -------------------------------------------------------------------------------------------- what it is

    @property
    def isa(self) -> str:
        """The instruction set that runs, such as "avx2"."""
        return self._engine.isa

    @property
    def threads(self) -> int:
        """How many threads calls run on."""
        return self._engine.thread_count

    @property
    def memory(self) -> _cab.Memory:
        """How many bytes the engine holds for what: articulations, batches, workers, ..., total."""
        return self._engine.memory
