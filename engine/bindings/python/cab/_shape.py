"""Convex shapes: the exact shape of a box of a body, for exact tests."""

from __future__ import annotations

from typing import Any, Optional, Tuple

from ._arrays import ArrayLike, Float32Array, small_array

_KINDS = ("box", "ellipsoid", "capsule", "hull", "sphere", "cylinder", "half_space")
_BOX, _ELLIPSOID, _CAPSULE, _HULL, _SPHERE, _CYLINDER, _HALF_SPACE = range(len(_KINDS))

_NO_TURN = (0.0, 0.0, 0.0, 1.0)
_HERE = (0.0, 0.0, 0.0)


class Shape:
    """One convex part, in the frame of its link. It must lie within its box.

    `position` is x y z of the part's origin in the link's frame, and `rotation` a quaternion x y z w of length 1 that
    turns from the part's frame to the link's. All lengths are in the unit of the poses, and must be above 0.
    """

    __slots__ = ("_kind", "_position", "_rotation", "_size", "_vertices")

    def __init__(
        self, kind: int, position: ArrayLike, rotation: ArrayLike, size: ArrayLike, vertices: Optional[Float32Array]
    ) -> None:
        """For the class methods below, which are how a shape is made."""
        self._kind = kind
        self._position = tuple(float(x) for x in small_array(position, "f4", "position", (3,), "(3,)"))
        self._rotation = tuple(float(x) for x in small_array(rotation, "f4", "rotation", (4,), "(4,)"))
        self._size = tuple(float(x) for x in small_array(size, "f4", "size", (3,), "(3,)"))
        self._vertices = vertices

    @classmethod
    def box(cls, half: ArrayLike, position: ArrayLike = _HERE, rotation: ArrayLike = _NO_TURN) -> Shape:
        """A box of half extents `half` (3,) along its x y z."""
        return cls(_BOX, position, rotation, half, None)

    @classmethod
    def ellipsoid(cls, radii: ArrayLike, position: ArrayLike = _HERE, rotation: ArrayLike = _NO_TURN) -> Shape:
        """An ellipsoid of radii (3,) along its x y z."""
        return cls(_ELLIPSOID, position, rotation, radii, None)

    @classmethod
    def sphere(cls, radius: float, position: ArrayLike = _HERE) -> Shape:
        """A sphere."""
        return cls(_SPHERE, position, _NO_TURN, (radius, 0, 0), None)

    @classmethod
    def capsule(
        cls, radius: float, half_length: float, position: ArrayLike = _HERE, rotation: ArrayLike = _NO_TURN
    ) -> Shape:
        """A capsule along its z: a segment of twice `half_length`, and all that is within `radius` of it."""
        return cls(_CAPSULE, position, rotation, (radius, half_length, 0), None)

    @classmethod
    def cylinder(
        cls, radius: float, half_length: float, position: ArrayLike = _HERE, rotation: ArrayLike = _NO_TURN
    ) -> Shape:
        """A cylinder along its z with flat ends, twice `half_length` long."""
        return cls(_CYLINDER, position, rotation, (radius, half_length, 0), None)

    @classmethod
    def hull(cls, vertices: ArrayLike, position: ArrayLike = _HERE, rotation: ArrayLike = _NO_TURN) -> Shape:
        """The convex hull of vertices (n, 3): at least three, not all on one line."""
        points = small_array(vertices, "f4", "vertices", (None, 3), "(n, 3)")
        return cls(_HULL, position, rotation, _HERE, points)

    @classmethod
    def half_space(cls, position: ArrayLike = _HERE, rotation: ArrayLike = _NO_TURN) -> Shape:
        """A floor or a wall without end: all points with z <= 0. Its box says where it is looked at."""
        return cls(_HALF_SPACE, position, rotation, _HERE, None)

    def __repr__(self) -> str:
        size = tuple(f"{x:.6g}" for x in self._size if x)
        what = f"{len(self._vertices)} vertices" if self._vertices is not None else ", ".join(size)
        return f"cab.Shape.{_KINDS[self._kind]}({what})"

    def _row(self, leaf: int) -> Tuple[Any, ...]:
        return (leaf, self._kind, self._position, self._rotation, self._size, self._vertices)
