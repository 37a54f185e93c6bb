"""cab: which links of many articulated characters touch.

    body = cab.Body.from_boxes(parents=[-1, 0], half=[[.2, .2, .5], [.1, .1, .4]])
    world = cab.World()
    crowd = world.add(body, 1000)
    frame = world.run(poses, origins=origins)    # poses: float32 (1000, 2, 7)
    frame.hits["instance_a"]                     # structured arrays, no object per hit

`Body` is what moves, `World` is who lives at the same time, and `Clip` is recorded motion. `rays` and its like ask a
world. Poses go from link to character ("model space"), as float32: quaternions x y z w and translations, or matrices.
They are never copied. Any unit of length will do. docs/python.md of the project has whole programs.
"""

from typing import List, NamedTuple

from . import _cab
from ._body import Body, Box, SkinnedBody, fit_box
from ._checker import EDGE, NEAREST, STATE_HIT, Attached, CollisionChecker
from ._clip import CLIP_HIT, DISTANCE, INTERVAL, Clip, intervals_of
from ._errors import BusyError, Error, FileError, InputError, MaskedWarning, OutOfMemory, UnsupportedError
from ._files import ALLOWED_COLLISION, MAX_FILE_BYTES, Motion, Robot, Variable, companion_files, load_motion
from ._policies import Policies, PolicyField, policy_table, presets
from ._queries import Answers, Queries, boxes, capsules, points, rays, regions, spheres
from ._shape import Shape
from ._status import Status
from ._table import Table
from ._world import Batch, Frame, History, Posed, World

FrameStats = _cab.FrameStats
Memory = _cab.Memory
QueryStats = _cab.QueryStats

HIT = _cab.hit_dtype
CONTACT = _cab.contact_dtype
TOUCHING_TRIANGLES = _cab.touching_triangles_dtype
SURFACE_POINT = _cab.surface_point_dtype
QUERY = _cab.query_dtype
QUERY_HIT = _cab.query_hit_dtype
QUERY_LINK = _cab.query_link_dtype


class BuildInfo(NamedTuple):
    """Which optional packages the library was built with."""

    fcl: bool
    qhull: bool
    tbb: bool


def abi_version() -> int:
    """The version of the C API's structs and calls, `CAB_ABI_VERSION`. Data goes between equal ones alone."""
    return _cab.abi_version()


def build_info() -> BuildInfo:
    """Which optional packages the library was built with."""
    return BuildInfo(*_cab.build_info())


def isas() -> List[str]:
    """The instruction sets that run here. The best one, which "auto" takes, is last. All give the same bits."""
    return _cab.available_isas()


__version__ = _cab.version()

__all__ = [
    "ALLOWED_COLLISION",
    "Answers",
    "Attached",
    "Batch",
    "Body",
    "Box",
    "BuildInfo",
    "BusyError",
    "CLIP_HIT",
    "CONTACT",
    "Clip",
    "CollisionChecker",
    "DISTANCE",
    "EDGE",
    "Error",
    "FileError",
    "Frame",
    "FrameStats",
    "HIT",
    "History",
    "INTERVAL",
    "InputError",
    "MAX_FILE_BYTES",
    "MaskedWarning",
    "Memory",
    "Motion",
    "NEAREST",
    "OutOfMemory",
    "Policies",
    "PolicyField",
    "Posed",
    "QUERY",
    "QUERY_HIT",
    "QUERY_LINK",
    "Queries",
    "QueryStats",
    "Robot",
    "Shape",
    "STATE_HIT",
    "SURFACE_POINT",
    "TOUCHING_TRIANGLES",
    "SkinnedBody",
    "Status",
    "Table",
    "UnsupportedError",
    "Variable",
    "World",
    "abi_version",
    "boxes",
    "build_info",
    "capsules",
    "companion_files",
    "fit_box",
    "intervals_of",
    "isas",
    "load_motion",
    "points",
    "policy_table",
    "presets",
    "rays",
    "regions",
    "spheres",
]
