"""Collision checks of robots: which states of the joints collide, and what touches in them."""

from __future__ import annotations

import threading
from typing import Any, List, Literal, Mapping, NamedTuple, Optional, Sequence, Tuple, Union, overload

import numpy as np

from . import _cab
from ._arrays import ArrayLike, BoolArray, Float64Array, StructuredArray, small_array
from ._body import Body
from ._files import Robot, StatesLike, state_array
from ._options import Isa
from ._table import Table, table_of

STATE_HIT = np.dtype([("state", "u4"), ("fixed", "i4"), ("link_a", "u4"), ("link_b", "u4"), ("depth", "f4")])

NEAREST = np.dtype(
    [
        ("distance", "f4"),
        ("fixed", "i4"),
        ("link_a", "u4"),
        ("link_b", "u4"),
        ("normal", "f4", 3),
        ("point_a", "f4", 3),
        ("point_b", "f4", 3),
    ]
)

EDGE = np.dtype({"names": ["free", "colliding", "moment"], "formats": ["?", "?", "f8"], "offsets": [0, 1, 8]})


class Attached(NamedTuple):
    """A rigid object that a link of a robot holds, for `CollisionChecker`. Lengths are in metres.

    link      name of the link that holds it, or of an object before it in the list.
    body      its shapes: a body of one link.
    pose      (7,): quaternion x y z w, of any length, and translation, from the body's frame to that of `link`.
    touching  names of links that it may touch beside `link`, or of objects before it in the list.
    name      what `names`, `padding` and messages call it.
    """

    link: str
    body: Body
    pose: ArrayLike = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    touching: Sequence[str] = ()
    name: str = "object"


_HeldRow = Tuple[str, _cab.BodyData, int, Float64Array, List[int]]


def _held_rows(links: Sequence[str], attached: Sequence[Attached]) -> List[_HeldRow]:
    """Name, shapes, link, pose and links that may be touched of each object, as the extension module takes them."""
    names = list(links)
    rows: List[_HeldRow] = []
    for held in attached:
        if not isinstance(held, Attached):
            raise TypeError(f"attached: a list of cab.Attached is wanted, and {type(held).__name__} is in it")
        what = f"attached {held.name!r}"
        if held.name in names:
            raise ValueError(f"{what}: there is a link or an object of that name")
        if isinstance(held.touching, str):
            raise TypeError(f"{what}: touching is a list of names, and one text is given")
        for name in (held.link, *held.touching):
            if name not in names:
                raise ValueError(f"{what}: the robot has no link {name!r}")
        if held.body.link_count != 1:
            raise ValueError(f"{what}: a body of one link is wanted, and this one has {held.body.link_count}")
        pose = small_array(held.pose, "f8", f"{what}, pose", (7,), "(7,)")
        if not (np.isfinite(pose).all() and pose[:4].any()):
            raise ValueError(f"{what}: pose is no quaternion x y z w and translation")
        # As in MoveIt, objects that one link holds are not tested against each other.
        beside = [len(links) + k for k, row in enumerate(rows) if row[2] == names.index(held.link)]
        touching = [names.index(name) for name in held.touching] + beside
        rows.append((held.name, held.body._data, names.index(held.link), pose, touching))
        names.append(held.name)
    return rows


def _padding_of(
    links: Sequence[str], held: Sequence[_HeldRow], padding: Union[float, Mapping[str, float]]
) -> List[float]:
    """The length of each link, then of each object; none if none has one."""
    names = [*links, *(row[0] for row in held)]
    if isinstance(padding, Mapping):
        for name in padding:
            if name not in names:
                raise ValueError(f"padding: the robot has no link {name!r}")
        lengths = [float(padding.get(name, 0)) for name in links]
        for row in held:
            lengths.append(float(padding.get(row[0], lengths[row[2]])))
    else:
        lengths = [float(padding)] * len(names)
    for name, length in zip(names, lengths):
        if not 0 <= length <= 1e18:
            raise ValueError(f"padding: {length} of link {name!r} is not a length from 0 to 1e18 metres")
    return lengths if any(lengths) else []


class CollisionChecker:
    """Which states of a robot collide, with the robot itself and with bodies that stand around it.

    robot    what moves. Lengths are in metres.
    ignored  (n, 2): pairs of links that are not tested, beside those of `robot.body`. Default: those of
             `robot.allowed_collisions(margin=margin)`. `clearance` and `distances` see those of reason "never", too:
             they have an engine of their own, made at the first of these calls, with a copy of what was added. States
             beyond the limits of joints may bring such links together: give `robot.adjacent_pairs` for these.
    margin   metres that links are apart at least; closer ones count as touching.
    padding  metres by which links grow against what `add_fixed` and `add_points` add, not against each other, as in
             MoveIt: a number for all links, or numbers by their names, and 0 for others. Objects have that of the
             link that holds them, if they are not named. All calls see grown links: depths and distances too.
             docs/robots.md says what shapes become.
    attached objects that links hold, each a `cab.Attached`. Each is one link more, after those of the robot. It is not
             tested against the link that holds it, those of its `touching`, and objects that the same link holds.
    threads  how many threads calls run on; 0: all cores.
    isa      the instruction set, one of `cab.isas()`, or "auto".

    Shapes are tested exactly, sixteen states at a time. Any thread may call; one call runs at a time. States are given
    as to `Robot`: (n, variables), one state, or by names. Bodies with triangles (`Robot` with shapes="surface") have no
    depths and no distances: `hits` with depths, `clearance` and `distances` raise an error where there is one, and
    padding is for robots without.
    """

    __slots__ = ("_added", "_checker", "_links", "_lock", "_near", "_near_arguments", "_variables")

    def __init__(
        self,
        robot: Robot,
        *,
        ignored: Optional[ArrayLike] = None,
        margin: float = 0.0,
        padding: Union[float, Mapping[str, float]] = 0.0,
        attached: Sequence[Attached] = (),
        threads: int = 1,
        isa: Isa = "auto",
    ) -> None:
        body, near = robot.body, None
        if ignored is None:
            allowed = robot.allowed_collisions(margin=margin)
            ignored = pairs = np.stack((allowed["a"], allowed["b"]), axis=1)
            never = allowed["reason"] == "never"
            if never.any():
                near = body.ignoring(pairs[~never])
        body = body.ignoring(ignored)
        held = _held_rows(body.names, attached)
        lengths = _padding_of(body.names, held, padding)
        self._checker = _cab.Checker(robot._data, body._data, isa, threads, margin, lengths, held)
        # For distances: the same checker, or one that tests more pairs, made when it is first needed.
        self._near: Optional[_cab.Checker] = None if near else self._checker
        self._near_arguments: Tuple[Any, ...] = (
            (robot._data, near._data, isa, threads, 0.0, lengths, held) if near else ()
        )
        self._added: List[Tuple[Any, ...]] = []  # what that one gets then
        self._lock = threading.Lock()  # of what is added
        self._variables = robot.variables
        self._links = (*body.names, *(row[0] for row in held))

    def add_fixed(self, body: Body, poses: Optional[ArrayLike] = None) -> None:
        """Adds a body that stands still in the robot's frame, such as a table.

        poses  (links, 7): quaternion x y z w and translation of each of its links. Default: all at the robot's origin.
        """
        links = len(body.names)
        if poses is None:
            poses = np.tile(np.array([0, 0, 0, 1, 0, 0, 0], dtype=np.float32), (links, 1))
        array = small_array(poses, "f4", "poses", (links, 7), f"({links}, 7)")
        self._add("add_fixed", body._data, array, body.names)

    def add_points(self, points: ArrayLike, radius: float, *, name: str = "points") -> None:
        """Adds points that stand still in the robot's frame, such as those of a depth camera, each as a ball.

        points  (n, 3), in metres. They are copied.
        radius  of each ball, in metres: above 0, up to 5e17.
        name    what `names` calls them, with the number of a point.

        0.2 microseconds per point; then calls take 7 ns per point, and a state 3 to 90 microseconds: thin a cloud out.
        """
        array = small_array(points, "f4", "points", (None, 3), "(n, 3)")
        self._add("add_points", array, radius, name)

    def _add(self, name: str, *arguments: Any) -> None:
        with self._lock:
            getattr(self._checker, name)(*arguments)
            if self._near is self._checker:
                return
            # Arrays may be the caller's, who may write into them.
            self._added.append((name, *(np.copy(a) if isinstance(a, np.ndarray) else a for a in arguments)))
            if self._near is not None:
                try:
                    getattr(self._near, name)(*arguments)
                except BaseException:
                    self._near = None  # else it would number what comes later otherwise
                    raise

    def _for_distances(self) -> _cab.Checker:
        with self._lock:
            if self._near is None:
                near = _cab.Checker(*self._near_arguments)
                for name, *arguments in self._added:
                    getattr(near, name)(*arguments)
                self._near = near
            return self._near

    def collides(self, states: StatesLike) -> BoolArray:
        """(n,) bool: whether any tested links touch in each of the states (n, variables).

        A state is done at its first touching pair, so this is faster than `hits`. A state with a number that is not
        finite is a ValueError.
        """
        return self._checker.collides(self._states(states))

    def hits(self, states: StatesLike, *, depths: bool = False) -> StructuredArray:
        """The touching pairs of links of the states (n, variables): `cab.STATE_HIT`, sorted by state.

        state           index of the state
        link_a, link_b  the links. fixed is -1 if both are the robot's, else link_b is a link of the fixed body, or the
                        number of a point, with that number in the order of `add_fixed` and `add_points`
        depth           how deep they overlap, in metres, with depths=True, else NaN. Below 0: a distance within margin
        """
        return self._checker.hits(self._states(states), depths)

    def clearance(self, states: StatesLike, most: float = 1.0) -> Float64Array:
        """(n,): the distance of the nearest two tested links in each of the states (n, variables), in metres.

        most  how far to look: where no links are as near it is infinite, and less is faster.

        Below 0: less how deep the two that are deepest overlap. The margin of the checker plays no part.
        """
        distance: Float64Array = self.distances(states, most)["distance"].astype(np.float64)
        return distance

    @overload
    def distances(
        self, states: StatesLike, most: float = ..., *, gradients: Literal[False] = ...
    ) -> StructuredArray: ...
    @overload
    def distances(
        self, states: StatesLike, most: float = ..., *, gradients: Literal[True]
    ) -> Tuple[StructuredArray, Float64Array]: ...

    def distances(
        self, states: StatesLike, most: float = 1.0, *, gradients: bool = False
    ) -> Union[StructuredArray, Tuple[StructuredArray, Float64Array]]:
        """The nearest two tested links in each of the states (n, variables): `cab.NEAREST` (n,).

        distance          as `clearance` has it; where it is infinite the rest is 0
        link_a, link_b    the links, and fixed, as `hits` has them
        normal            of length 1, from a to b
        point_a, point_b  the nearest, or deepest, points of both, in the robot's frame

        With gradients=True a pair: the same, and float64 (n, variables): how the distance changes with each variable,
        in metres per radian or metre, while both points stay where they are on their links. 0 where it is infinite.
        """
        rows, slopes = self._for_distances().distances(self._states(states), most, gradients)
        return (rows, slopes) if gradients else rows

    def names(self, rows: StructuredArray) -> List[Tuple[str, str]]:
        """The names of the two links of each row of `hits` or `distances`; of a point it is "points 17"."""

        def other(row: np.void) -> str:
            fixed, link = int(row["fixed"]), int(row["link_b"])
            names = self._links if fixed < 0 else self._checker.fixed_names[fixed]
            return f"{names} {link}" if isinstance(names, str) else names[link]

        pairs = []
        for k, row in enumerate(rows):
            try:
                pairs.append((self._links[int(row["link_a"])], other(row)))
            except IndexError:
                words = f"link_a {row['link_a']}, fixed {row['fixed']}, link_b {row['link_b']}"
                raise ValueError(f"rows[{k}]: {words} are of another checker, whose `table` takes them") from None
        return pairs

    def table(self, rows: StructuredArray) -> Table:
        """Rows of `hits` or `distances` of this checker with the names of links, as people read them."""
        pairs = np.array(self.names(rows), dtype=np.str_).reshape(-1, 2)
        return table_of(
            rows, {"link_a": lambda: pairs[:, 0], "link_b": lambda: pairs[:, 1]}, left_out=("fixed",)
        )

    def __repr__(self) -> str:
        return f"cab.CollisionChecker({len(self._links)} links, {len(self._checker.fixed_names)} fixed)"

    def edges(
        self, starts: StatesLike, ends: StatesLike, *, resolution: float = 1e-3, first: bool = False
    ) -> StructuredArray:
        """Whether links touch on straight ways between states, starts and ends (n, variables): `cab.EDGE` (n,).

        Every joint goes linearly from its value in `starts` to that in `ends`.

        free       no tested links touch at any moment. This is proven by bounds of motion, not sampled
        colliding  links touch at some moment. Neither free nor colliding: links come so near to each other that
                   intervals in which they move by less than `resolution`, in metres, decide nothing
        moment     with first=True the first moment, 0 to 1, at which links touch or may touch, to the resolution;
                   before it the way is free. Else, and of a free way, NaN
        """
        return self._checker.edges(self._states(starts), self._states(ends), resolution, first)

    def _states(self, states: StatesLike) -> Float64Array:
        return state_array(self._variables, states)

    @property
    def isa(self) -> str:
        """The instruction set that is used."""
        return self._checker.isa

    @property
    def threads(self) -> int:
        """How many threads calls run on."""
        return self._checker.thread_count
