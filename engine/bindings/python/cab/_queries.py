"""Queries: rays, spheres, boxes, capsules, points and regions, as arrays."""

from __future__ import annotations

import math
from typing import Any, NamedTuple, Optional, get_args

import numpy as np

from . import _cab
from ._arrays import ArrayLike, BoolArray, StructuredArray, UInt32Array, small_array, unmasked
from ._options import Want

_KINDS = ("rays", "spheres", "boxes", "capsules", "points", "regions")
_RAY, _SPHERE, _BOX, _CAPSULE, _POINT, _REGION = range(len(_KINDS))
_WANTS = get_args(Want)
_NOW = math.inf


class Answers(NamedTuple):
    """What queries found.

    hits    structured, sorted by query, distance, batch, instance, link: query, batch, instance, link, leaf, distance,
            point (3,) relative to the query's position, normal (3,), inside (`cab.QUERY_HIT`). Of report="links" the
            first five alone (`cab.QUERY_LINK`), of "counts" nothing. None for queries that want "any".
    found   (queries,) bool: which queries found a link.
    stats   counts and seconds.
    counts  (queries,) uint32: how many hits each query has.
    surface_points  of each hit the triangle, a row of `Body.triangles[leaf]`, or 0xffffffff where it is not on
            triangles, and the weights (3,) of its corners (`cab.SURFACE_POINT`). None unless asked for.
    """

    hits: StructuredArray
    found: BoolArray
    stats: _cab.QueryStats
    counts: UInt32Array
    surface_points: Optional[StructuredArray] = None


class Queries:
    """Queries of any kinds, in order. Add up several: `rays(...) + points(...)`.

    `array` is structured (`cab.QUERY`), one entry per query; `planes` are those of regions. Both may be changed.
    """

    __slots__ = ("array", "planes")

    array: StructuredArray
    planes: StructuredArray

    def __init__(self, array: StructuredArray, planes: Optional[StructuredArray] = None) -> None:
        """For `cab.rays` and its like."""
        self.array = array
        self.planes = np.empty(0, dtype=_cab.query_plane_dtype) if planes is None else planes

    def __len__(self) -> int:
        return len(self.array)

    def __repr__(self) -> str:
        counts = np.bincount(self.array["kind"], minlength=len(_KINDS))
        return f"cab.Queries({', '.join(f'{n} {kind}' for n, kind in zip(counts, _KINDS) if n)})"

    def __add__(self, other: Queries) -> Queries:
        # Not by numpy.concatenate, which closes the gaps between fields.
        array = np.empty(len(self) + len(other), dtype=_cab.query_dtype)
        array[: len(self)] = self.array
        array[len(self) :] = other.array
        array["first_plane"][len(self) :] += np.uint32(len(self.planes))
        return Queries(array, np.concatenate((self.planes, other.planes)))

    def without(self, batch: Any, instances: ArrayLike) -> Queries:
        """The same queries, each leaving out one character of a batch: the shooter. `instances` is one or one each."""
        array = self.array.copy()
        array["ignored_batch"] = batch._id
        array["ignored_instance"] = unmasked(instances, "instances")
        return Queries(array, self.planes)


def _make(
    kind: int, positions: ArrayLike, want: Want, max_hits: Optional[int], layer_mask: ArrayLike, time: ArrayLike
) -> StructuredArray:
    if want not in _WANTS:
        raise ValueError(f"want: {want!r} is none of {', '.join(_WANTS)}")
    rows = np.atleast_2d(np.asarray(unmasked(positions, "positions")))
    places = small_array(rows, "f8", "positions", (None, 3), "(n, 3)")
    queries = np.zeros(len(places), dtype=_cab.query_dtype)
    queries["kind"] = kind
    queries["want"] = _WANTS.index(want)
    queries["max_hits"] = 0xFFFFFFFF if max_hits is None else max_hits
    queries["layer_mask"] = unmasked(layer_mask, "layer_mask")
    queries["time"] = unmasked(time, "time")
    queries["position"] = places
    queries["orientation"] = (0, 0, 0, 1)
    return queries


def rays(
    positions: ArrayLike,
    directions: ArrayLike,
    *,
    length: ArrayLike = math.inf,
    radius: ArrayLike = 0,
    want: Want = "closest",
    max_hits: Optional[int] = None,
    layer_mask: ArrayLike = 0xFFFFFFFF,
    time: ArrayLike = _NOW,
) -> Queries:
    """Rays, or spheres that are moved along them.

    positions   (n, 3) float64: where they begin, in the world.
    directions  (n, 3) or (3,): of any length but 0.
    length      how far they go, one number or (n,). Default: without end.
    radius      of the sphere that is moved. Default: 0, a ray.
    want        "closest" (default), "all" or "any": whether there is a link at all, the fastest.
    max_hits    with "all": the most hits of each query.
    layer_mask  a character is looked at if one of these bits is in its layer.
    time        when it is asked, of histories. Default: now.
    """
    queries = _make(_RAY, positions, want, max_hits, layer_mask, time)
    queries["direction"] = unmasked(directions, "directions")
    queries["length"] = unmasked(length, "length")
    queries["radius"] = unmasked(radius, "radius")
    return Queries(queries)


def spheres(
    centers: ArrayLike,
    radius: ArrayLike,
    *,
    want: Want = "all",
    with_depth: bool = False,
    max_hits: Optional[int] = None,
    layer_mask: ArrayLike = 0xFFFFFFFF,
    time: ArrayLike = _NOW,
) -> Queries:
    """Links that overlap spheres. with_depth: hits say how deep, as minus their distance. Others as in `rays`."""
    queries = _make(_SPHERE, centers, want, max_hits, layer_mask, time)
    queries["radius"] = unmasked(radius, "radius")
    queries["with_depth"] = with_depth
    return Queries(queries)


def boxes(
    centers: ArrayLike,
    half: ArrayLike,
    *,
    orientations: Optional[ArrayLike] = None,
    want: Want = "all",
    with_depth: bool = False,
    max_hits: Optional[int] = None,
    layer_mask: ArrayLike = 0xFFFFFFFF,
    time: ArrayLike = _NOW,
) -> Queries:
    """Links that overlap oriented boxes: half extents (n, 3) or (3,), quaternions x y z w (n, 4) or (4,)."""
    queries = _make(_BOX, centers, want, max_hits, layer_mask, time)
    queries["half"] = unmasked(half, "half")
    queries["with_depth"] = with_depth
    if orientations is not None:
        queries["orientation"] = unmasked(orientations, "orientations")
    return Queries(queries)


def capsules(
    centers: ArrayLike,
    radius: ArrayLike,
    half_length: ArrayLike,
    *,
    orientations: Optional[ArrayLike] = None,
    want: Want = "all",
    with_depth: bool = False,
    max_hits: Optional[int] = None,
    layer_mask: ArrayLike = 0xFFFFFFFF,
    time: ArrayLike = _NOW,
) -> Queries:
    """Links that overlap capsules along their z, twice `half_length` long without the ends; turned by quaternions."""
    queries = _make(_CAPSULE, centers, want, max_hits, layer_mask, time)
    queries["radius"] = unmasked(radius, "radius")
    queries["half"][:, 2] = unmasked(half_length, "half_length")
    queries["with_depth"] = with_depth
    if orientations is not None:
        queries["orientation"] = unmasked(orientations, "orientations")
    return Queries(queries)


def points(
    positions: ArrayLike,
    distance: ArrayLike = math.inf,
    *,
    want: Want = "closest",
    max_hits: Optional[int] = None,
    layer_mask: ArrayLike = 0xFFFFFFFF,
    time: ArrayLike = _NOW,
) -> Queries:
    """Links within a distance of points, nearest first. With "all" and `max_hits` the nearest few."""
    queries = _make(_POINT, positions, want, max_hits, layer_mask, time)
    queries["length"] = unmasked(distance, "distance")
    return Queries(queries)


def regions(
    positions: ArrayLike,
    planes: ArrayLike,
    *,
    want: Want = "all",
    max_hits: Optional[int] = None,
    layer_mask: ArrayLike = 0xFFFFFFFF,
    time: ArrayLike = _NOW,
) -> Queries:
    """Links whose boxes are not wholly outside of any of several planes, such as those of a frustum.

    planes  (n, k, 4), or (k, 4) for all: normal x y z outwards, offset. A point p is inside of a plane if
            dot(normal, p - position) <= offset.
    """
    queries = _make(_REGION, positions, want, max_hits, layer_mask, time)
    given = np.asarray(unmasked(planes, "planes"), dtype=np.float32)
    if given.ndim == 2:
        given = np.broadcast_to(given, (len(queries), *given.shape))
    if given.ndim != 3 or given.shape[0] != len(queries) or given.shape[2] != 4:
        raise ValueError(f"planes: ({len(queries)}, k, 4) or (k, 4) is wanted, and the shape {given.shape} is given")
    count = given.shape[1]
    rows = np.empty(len(queries) * count, dtype=_cab.query_plane_dtype)
    rows["normal"] = given[..., :3].reshape(-1, 3)
    rows["offset"] = given[..., 3].reshape(-1)
    queries["first_plane"] = np.arange(len(queries), dtype=np.uint32) * np.uint32(count)
    queries["plane_count"] = count
    return Queries(queries, rows)
