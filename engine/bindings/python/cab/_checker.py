"""Collision checks of robots: which states of the joints collide, and what touches in them."""

from typing import Optional

import numpy as np

from . import _cab
from ._arrays import ArrayLike, BoolArray, Float64Array, StructuredArray, small_array
from ._body import Body
from ._files import Robot

STATE_HIT = np.dtype([("state", "u4"), ("fixed", "i4"), ("link_a", "u2"), ("link_b", "u2"), ("depth", "f4")])

EDGE = np.dtype({"names": ["free", "colliding", "moment"], "formats": ["?", "?", "f8"], "offsets": [0, 1, 8]})


class CollisionChecker:
    """Which states of a robot collide, with the robot itself and with bodies that stand around it.

    robot    what moves. Lengths are in metres.
    ignored  (n, 2): pairs of links that are not tested, beside those of `robot.body`. Default: those of
             `robot.allowed_collisions()`.
    margin   metres that links are apart at least; closer ones count as touching.
    threads  how many threads calls run on; 0: all cores.
    isa      the instruction set, one of `cab.isas()`, or "auto".

    Shapes are tested exactly, sixteen states at a time. Any thread may call; one call runs at a time.
    """

    __slots__ = ("_checker", "_variables")

    def __init__(
        self,
        robot: Robot,
        *,
        ignored: Optional[ArrayLike] = None,
        margin: float = 0.0,
        threads: int = 1,
        isa: str = "auto",
    ) -> None:
        if ignored is None:
            allowed = robot.allowed_collisions()
            ignored = np.stack((allowed["a"], allowed["b"]), axis=1)
        body = robot.body.ignoring(ignored)
        self._checker = _cab.Checker(robot._data, body._data, isa, threads, margin)
        self._variables = len(robot.variables)

    def add_fixed(self, body: Body, poses: Optional[ArrayLike] = None) -> None:
        """Adds a body that stands still in the robot's frame, such as a table.

        poses  (links, 7): quaternion x y z w and translation of each of its links. Default: all at the robot's origin.
        """
        links = len(body.names)
        if poses is None:
            poses = np.tile(np.array([0, 0, 0, 1, 0, 0, 0], dtype=np.float32), (links, 1))
        self._checker.add_fixed(body._data, small_array(poses, "f4", "poses", (links, 7), f"({links}, 7)"))

    def collides(self, states: ArrayLike) -> BoolArray:
        """(n,) bool: whether any tested links touch in each of the states (n, variables).

        A state is done at its first touching pair, so this is faster than `hits`. A state with a number that is not
        finite is a ValueError.
        """
        return self._checker.collides(self._states(states))

    def hits(self, states: ArrayLike, *, depths: bool = False) -> StructuredArray:
        """The touching pairs of links of the states (n, variables): `cab.STATE_HIT`, sorted by state.

        state           index of the state
        link_a, link_b  the links. fixed is -1 if both are the robot's, else link_b is one of the fixed body with that
                        number, in the order of `add_fixed`
        depth           how deep they overlap, in metres, with depths=True, else NaN. Below 0: a distance within margin
        """
        return self._checker.hits(self._states(states), depths)

    def edges(
        self, starts: ArrayLike, ends: ArrayLike, *, resolution: float = 1e-3, first: bool = False
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

    def _states(self, states: ArrayLike) -> Float64Array:
        if isinstance(states, np.ndarray) and states.dtype == np.float64 and states.flags.c_contiguous:
            return states
        count = self._variables
        array: Float64Array = small_array(states, "f8", "states", (None, count), f"(n, {count})")
        return array

    @property
    def isa(self) -> str:
        """The instruction set that is used."""
        return self._checker.isa

    @property
    def threads(self) -> int:
        """How many threads calls run on."""
        return self._checker.thread_count
