"""Characters and robots from files: motion files through assimp, URDF and MJCF."""

from __future__ import annotations

import os
import threading
from typing import (
    TYPE_CHECKING, Any, Dict, List, Literal, Mapping, NamedTuple, Optional, Sequence, Tuple, Union, get_args, overload,
)

import numpy as np

from . import _cab
from ._arrays import (
    ArrayLike, BoolArray, Float32Array, Float64Array, StructuredArray, UInt32Array, small_array, unmasked,
)
from ._body import Body
from ._errors import UnsupportedError
from ._options import MotionBody
from ._status import Status
from ._table import LinkNames, Table, table_of

if TYPE_CHECKING:
    from ._checker import CollisionChecker

PathLike = Union[str, bytes, "os.PathLike[str]", "os.PathLike[bytes]"]

_BODIES = get_args(MotionBody)

MAX_FILE_BYTES: int = _cab.max_file_bytes

ALLOWED_COLLISION = np.dtype([("a", "u4"), ("b", "u4"), ("reason", "U8"), ("touching", "u4")])


class Motion(NamedTuple):
    """A character of a motion file. Lengths are in metres.

    body     its links are the file's joints that have bodies.
    poses    float32 (frames, links, 7), for `Clip.add` and `Batch.posed`.
    origins  float64 (frames, 3): where the character stands in the world.
    fps      frames per second; 0 for a file without motion, which has one frame. `Clip` wants a number above 0.
    notes    what was merged, dropped or doubted.
    """

    body: Body
    poses: Float32Array
    origins: Float64Array
    fps: float
    notes: Tuple[str, ...]


def _bytes_or_none(path: Optional[PathLike]) -> Optional[bytes]:
    return None if path is None else os.fsencode(path)


def _need_files() -> None:
    if not _cab.reads_files:
        raise UnsupportedError(
            Status.EXACT_NOT_BUILT, "this build of cab reads no files: build it with -D CAB_PYTHON_FILES=ON"
        )


def load_motion(
    path: PathLike,
    *,
    units: Union[float, str, None] = None,
    motion: Optional[PathLike] = None,
    motion_units: float = 0,
    animation: Union[str, int, None] = None,
    fps: float = 0,
    body: MotionBody = "skeleton",
    stature: float = 0,
    thickness: float = 1,
) -> Motion:
    """Reads a character and its motion: BVH, AMC with ASF beside it, glTF, FBX, Collada and what else assimp reads.

    units        the length of one unit of the file, in metres. Default: as the file says, or 1. "auto": one in which
                 the figure is as tall as a person, if it is not; notes say which.
    motion       another file that has the motion, whose nodes are matched by name; motion_units is its unit.
    animation    name of the animation, or its number from 0 on. Default: the first.
    fps          of files that do not say it (AMC). Default: 120.
    body         what it is made of: "skeleton" (default), ellipsoids about the file's bones; "skin", hulls about its
                 meshes; or "surface", the triangles of these meshes, which follow them as they bend (exact="surface").
    stature      the person's height in metres, for thickness. Default: by the figure's own bones.
    thickness    a factor of all thicknesses.

    The file is read in a child process with limits. A bad one is a `FileError` that names file, line and reason.
    """
    _need_files()
    if units is not None and units != "auto" and (isinstance(units, str) or units == 0):
        raise ValueError(f"units is a length in metres or 'auto', not {units!r}")
    if body not in _BODIES:
        raise ValueError(f"body: {body!r} is none of {', '.join(_BODIES)}")
    data, names, poses, origins, seconds, notes = _cab.load_motion(
        os.fsencode(path), 0.0 if units is None or units == "auto" else float(units), units == "auto",
        _bytes_or_none(motion), motion_units,
        None if animation is None else os.fsencode(str(animation)), fps, _BODIES.index(body), stature, thickness,
    )
    return Motion(Body(data, names), poses, origins, 1 / seconds if seconds > 0 else 0.0, tuple(notes))


def companion_files(path: PathLike) -> List[str]:
    """The files that `load_motion` reads with a file: the skeleton of an AMC file, the buffers that a glTF file names.

    Files that are not there may be among them. The file is read in a child process with limits, and its motion is not.
    """
    _need_files()
    return [os.fsdecode(file) for file in _cab.companion_files(os.fsencode(path))]


class Variable(NamedTuple):
    """A number of a joint state, with its limits and its value at rest: radians or metres."""

    name: str
    lower: float
    upper: float
    rest: float


StatesLike = Union[ArrayLike, Mapping[str, ArrayLike]]


def state_array(variables: Sequence[Variable], states: StatesLike) -> Float64Array:
    """(n, variables) float64: states as they are, one state, or numbers by names of variables, where others rest."""
    unmasked(states, "states")
    if isinstance(states, np.ndarray) and states.dtype == np.float64 and states.ndim == 2 and states.flags.c_contiguous:
        return states
    count = len(variables)
    if not isinstance(states, Mapping):
        is_one = (
            isinstance(states, (list, tuple, np.ndarray)) and len(states) == count > 0 and np.ndim(states[0]) == 0
        )
        array: Float64Array = small_array(
            [states] if is_one else states, "f8", "states", (None, count), f"(n, {count}) or ({count},)"
        )
        return array
    names = [variable.name for variable in variables]
    unknown = [name for name in states if name not in names]
    if unknown:
        raise ValueError(f"states: the robot has no variable {unknown[0]!r}; it has {', '.join(names)}")
    columns = []
    for name, _, _, rest in variables:
        what = f"states[{name!r}]"
        column = np.atleast_1d(np.asarray(unmasked(states.get(name, rest), what)))
        columns.append(small_array(column, "f8", what, (None,), "(n,)"))
    longest = max((len(column) for column in columns if len(column) != 1), default=1)  # 0 where a name has no states
    array = np.empty((longest, count))
    for k, (name, column) in enumerate(zip(names, columns)):
        if len(column) not in (1, longest):
            raise ValueError(f"states[{name!r}]: one number or {longest} are wanted, and {len(column)} are given")
        array[:, k] = column
    return array


class Robot:
    """A robot of a URDF or MJCF file: its body, and the joints that pose it. Lengths are in metres.

    packages             folders by name, for package:// paths of meshes.
    srdf                 an SRDF file, whose disabled pairs of links are ignored pairs of the body.
    leave_out_missing    whether a shape is left out whose mesh file is not there. Default: the robot is refused.
    shapes               what meshes become: "hulls" (default), convex ones, or "surface": their triangles. These have
                         no inside, no depths and no distances, and are not padded (docs/robots.md).
    leaves_per_link      the most hulls that a mesh becomes, 1 (default) to 64: it is cut where that saves volume.

    Files are read in child processes with limits. A bad one is a `FileError` that names file, line or element and
    reason. A pickle has the paths, and what reads it reads the files again.

    States are (n, variables) in the order of `variables`; or one state (variables,); or by names, such as
    `{"elbow": [0.1, 0.2]}`, where variables that are not named have their value at rest. An empty list is no state.
    """

    __slots__ = ("_arguments", "_data", "_body", "_variables", "_lock", "_checker")

    def __init__(
        self,
        path: PathLike,
        *,
        packages: Optional[Dict[str, PathLike]] = None,
        srdf: Optional[PathLike] = None,
        leave_out_missing: bool = False,
        shapes: Literal["hulls", "surface"] = "hulls",
        leaves_per_link: int = 1,
    ) -> None:
        _need_files()
        if shapes not in ("hulls", "surface"):
            raise ValueError(f"shapes is 'hulls' or 'surface', not {shapes!r}")
        if not 1 <= leaves_per_link <= 64:
            raise ValueError(f"leaves_per_link is from 1 to 64, not {leaves_per_link!r}")
        if shapes == "surface" and leaves_per_link > 1:
            raise ValueError("leaves_per_link cuts hulls, and shapes='surface' has none")
        self._arguments = (path, packages, srdf, leave_out_missing, shapes, leaves_per_link)
        folders = [(os.fsencode(name), os.fsencode(folder)) for name, folder in (packages or {}).items()]
        self._data = _cab.load_robot(
            os.fsencode(path), folders, _bytes_or_none(srdf), leave_out_missing, shapes == "surface", leaves_per_link
        )
        self._body = Body(self._data.body, self._data.names)
        self._variables = tuple(Variable(*row) for row in self._data.variables)
        self._lock = threading.RLock()  # of what calls write into _data, and of _checker
        self._checker: Optional[CollisionChecker] = None

    def __reduce__(self) -> Tuple[Any, ...]:
        return _robot, self._arguments

    def __repr__(self) -> str:
        return f"cab.Robot({self._body.link_count} links, {len(self._variables)} variables)"

    @property
    def body(self) -> Body:
        """Links and collision shapes. Links that a joint connects are tested, unless `Body.ignoring(hops=1)`."""
        return self._body

    @property
    def variables(self) -> Tuple[Variable, ...]:
        """What a joint state is of, in its order."""
        return self._variables

    @property
    def notes(self) -> Tuple[str, ...]:
        """What was left out or held still."""
        return tuple(self._data.notes)

    def rest(self) -> Float64Array:
        """(variables,): the state at rest."""
        return np.array([variable.rest for variable in self._variables], dtype=np.float64)

    def states(self, states: StatesLike) -> Float64Array:
        """(n, variables) float64: the states that all calls take, such as `{"elbow": [0.1, 0.2]}`, as one array."""
        return state_array(self._variables, states)

    def table(self, rows: StructuredArray) -> Table:
        """Rows of `hits`, `distances` or `allowed_collisions` of this robot with the names of links.

        `CollisionChecker.table` takes those of a checker with surroundings or attached objects.
        """
        if "reason" not in (rows.dtype.names or ()):
            return self._own_checker().table(rows)
        links = LinkNames([self._body.names])
        return table_of(rows, {"a": lambda: links(0, rows["a"]), "b": lambda: links(0, rows["b"])})

    @property
    def adjacent_pairs(self) -> UInt32Array:
        """(pairs, 2) uint32: links with shapes that a joint connects or that are one rigid body (docs/robots.md)."""
        return np.array(self._data.adjacent_pairs, dtype=np.uint32).reshape(-1, 2)

    @property
    def welded_pairs(self) -> UInt32Array:
        """(pairs, 2) uint32: those of `adjacent_pairs` that no joint of an MJCF file moves against each other."""
        return np.array(self._data.welded_pairs, dtype=np.uint32).reshape(-1, 2)

    @property
    def listed_pairs(self) -> UInt32Array:
        """(pairs, 2) uint32: links that a <pair> of an MJCF file lists, to be tested whatever else holds."""
        return np.array(self._data.listed_pairs, dtype=np.uint32).reshape(-1, 2)

    def allowed_collisions(
        self, samples: int = 10000, seed: int = 1, *, margin: float = 0.0, threads: int = 1
    ) -> StructuredArray:
        """The pairs of links that need no test, as `cab robot` finds them (docs/robots.md): `cab.ALLOWED_COLLISION`.

        Those that the file or the SRDF file excludes; without an SRDF file also adjacent links, those that touch in at
        least 95 % of `samples` random states within the limits of the joints, and those that come within `margin`
        metres of each other in none, nor at rest ("never"). Beyond the limits, and for distances, test those of
        "never" too.

        a, b     the links, a < b
        reason   "file", "welded", "adjacent", "default", "always" or "never"
        touching in how many of the samples they touch
        """
        with self._lock:
            rows = self._data.disabled_pairs(samples, seed, threads, margin)
        return np.array(rows, dtype=ALLOWED_COLLISION)

    def collides(self, states: StatesLike) -> BoolArray:
        """(n,) bool: whether links of the robot touch in each of the states (n, variables).

        A `CollisionChecker` of this robot, made at the first call, which leaves out `allowed_collisions()`. For states
        beyond the limits of joints take one with `ignored=robot.adjacent_pairs`.
        """
        return self._own_checker().collides(states)

    def hits(self, states: StatesLike, *, depths: bool = False) -> StructuredArray:
        """Which links touch in the states (n, variables): `CollisionChecker.hits` of the same checker."""
        return self._own_checker().hits(states, depths=depths)

    def clearance(self, states: StatesLike, most: float = 1.0) -> Float64Array:
        """How near links come in the states (n, variables): `CollisionChecker.clearance` of the same checker."""
        return self._own_checker().clearance(states, most)

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
        """The nearest links in the states (n, variables): `CollisionChecker.distances` of the same checker."""
        checker = self._own_checker()
        return checker.distances(states, most, gradients=True) if gradients else checker.distances(states, most)

    def edges(
        self, starts: StatesLike, ends: StatesLike, *, resolution: float = 1e-3, first: bool = False
    ) -> StructuredArray:
        """Whether links touch on straight ways between states: `CollisionChecker.edges` of the same checker."""
        return self._own_checker().edges(starts, ends, resolution=resolution, first=first)

    def _own_checker(self) -> CollisionChecker:
        from ._checker import CollisionChecker

        with self._lock:
            if self._checker is None:
                self._checker = CollisionChecker(self)
            return self._checker

    def random_states(self, count: int, seed: int = 1, first: int = 0) -> Float64Array:
        """(count, variables): random states within the limits, of the numbers `first`, `first` + 1, and so on.

        A state depends on the seed and its number alone, so that parts of a sample are drawn anywhere.
        """
        return self._data.random_states(count, seed, first)

    def poses(self, states: StatesLike) -> Float32Array:
        """The poses of joint states (n, variables): float32 (n, links, 7), in the robot's frame.

        They are computed in double, sixteen states at a time, and rounded once. A state with a NaN or an infinity has
        NaN in its poses, so that a world masks it. Some nanoseconds per link and state.
        """
        return self._data.poses(self.states(states))


def _robot(
    path: PathLike,
    packages: Optional[Dict[str, PathLike]],
    srdf: Optional[PathLike],
    leave_out_missing: bool,
    shapes: Literal["hulls", "surface"],
    leaves_per_link: int,
) -> Robot:
    return Robot(
        path,
        packages=packages,
        srdf=srdf,
        leave_out_missing=leave_out_missing,
        shapes=shapes,
        leaves_per_link=leaves_per_link,
    )
