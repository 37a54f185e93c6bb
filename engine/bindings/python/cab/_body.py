"""Bodies: links, joints and boxes of one kind of character."""

from __future__ import annotations

import hashlib
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from . import _cab
from ._arrays import ArrayLike, Float32Array, Int32Array, StructuredArray, UInt32Array, small_array, unmasked
from ._options import Order, SkinKind
from ._shape import Shape

ShapesLike = Union[Shape, Sequence[Shape], None]


class Box(NamedTuple):
    """An oriented box: its centre (3,), its axes (3, 3), of which `axes[k]` is the k-th, and half extents (3,)."""

    center: Float32Array
    axes: Float32Array
    half: Float32Array


def fit_box(vertices: ArrayLike) -> Box:
    """Fits an oriented box about vertices (n, 3). Every vertex is inside. For when a mesh is loaded, not per frame."""
    fitted = _cab.fit_box(small_array(vertices, "f4", "vertices", (None, 3), "(n, 3)"))[0]
    return Box(fitted["center"], fitted["axis"], fitted["half"])


def box_array(half: ArrayLike, center: Optional[ArrayLike], axes: Optional[ArrayLike]) -> StructuredArray:
    """Boxes as the engine has them: half (n, 3), center (n, 3) or None, axes (n, 3, 3) or None."""
    sizes = small_array(half, "f4", "half", (None, 3), "(boxes, 3)")
    boxes = np.zeros(len(sizes), dtype=_cab.box_dtype)
    boxes["half"] = sizes
    if center is not None:
        boxes["center"] = small_array(center, "f4", "center", (len(sizes), 3), f"({len(sizes)}, 3)")
    if axes is None:
        boxes["axis"] = np.eye(3, dtype=np.float32)
    else:
        boxes["axis"] = small_array(axes, "f4", "axes", (len(sizes), 3, 3), f"({len(sizes)}, 3, 3)")
    return boxes


def shape_rows(shapes: Optional[Sequence[ShapesLike]], count: int) -> List[Tuple[Any, ...]]:
    """The shapes of each box, as the extension module takes them."""
    if shapes is None:
        return []
    if len(shapes) != count:
        raise ValueError(f"shapes: one entry per box is wanted, {count}, and {len(shapes)} are given")
    rows = []
    for box, given in enumerate(shapes):
        parts: Sequence[Any] = () if given is None else (given,) if isinstance(given, Shape) else given
        for part in parts:
            if not isinstance(part, Shape):
                raise TypeError(f"shapes[{box}]: cab.Shape is wanted, and {type(part).__name__} is given")
            rows.append(part._row(box))
    return rows


class Body:
    """Links, joints and boxes of one kind of character. It does not change, and may be in several worlds.

    `from_boxes` makes one of arrays, `from_skeleton` of joints and their names. Links are numbered from 0, each after
    its parent. All lengths are in one unit, which the caller chooses; poses and origins are in the same one.
    """

    __slots__ = ("_data", "_names")

    def __init__(self, data: _cab.BodyData, names: Optional[Sequence[str]]) -> None:
        """For the class methods below, which are how a body is made."""
        self._data = data
        count = len(data.parents)
        if names is not None and len(names) != count:
            raise ValueError(f"names: one name per link is wanted, {count}, and {len(names)} are given")
        self._names = tuple(f"link {link}" for link in range(count)) if names is None else tuple(map(str, names))

    @classmethod
    def from_boxes(
        cls,
        parents: ArrayLike,
        half: ArrayLike,
        *,
        center: Optional[ArrayLike] = None,
        axes: Optional[ArrayLike] = None,
        links: Optional[ArrayLike] = None,
        joints: Optional[ArrayLike] = None,
        shapes: Optional[Sequence[ShapesLike]] = None,
        names: Optional[Sequence[str]] = None,
        ignored_pairs: Optional[ArrayLike] = None,
        ignored_hops: int = 0,
        rest_pose: Optional[ArrayLike] = None,
        order: Order = "row",
    ) -> Body:
        """A body of boxes that are fixed to links.

        parents        (links,) integers: the index of each link's parent, lower than its own, or -1 for a root.
        half           (boxes, 3): half extents along each box's axes, 0 or more.
        center         (boxes, 3): centres in the frames of their links. Default: the frames' origins.
        axes           (boxes, 3, 3): axes[b, k] is x y z of box b's k-th axis; right-handed, orthonormal to 1e-5.
                       Default: the axes of the links.
        links          (boxes,) integers: the link of each box. Default: box b is on link b.
        joints         (links, 3): the joint with the parent, in the link's own frame. Default: the frame's origin.
        shapes         for each box None (the box itself), a `Shape`, or several; exact tests use them.
        names          a name per link, for messages.
        ignored_pairs  (pairs, 2) integers: links that are never reported against each other within a character.
        ignored_hops   links at most so many joints apart are ignored likewise: with 1 a link and its parent.
        rest_pose      poses of all links (links, 7), (links, 3, 4) or (links, 4, 4): links whose boxes touch in it are
                       ignored likewise. `order` is that of `World.run`.

        Raises TypeError and ValueError for arrays that do not fit, and `InputError` for numbers that make no body.
        """
        parent_array = small_array(parents, "i4", "parents", (None,), "(links,)")
        boxes = box_array(half, center, axes)
        n, link_count = len(boxes), len(parent_array)
        if links is None:
            if n != link_count:
                raise ValueError(f"links: there are {n} boxes and {link_count} links, so say which link each box is on")
            link_array = np.arange(n, dtype=np.uint32)
        else:
            link_array = small_array(links, "u4", "links", (n,), f"({n},)")
        joint_array = (
            None if joints is None else small_array(joints, "f4", "joints", (link_count, 3), f"({link_count}, 3)")
        )
        pairs = small_array(
            () if ignored_pairs is None else ignored_pairs, "u4", "ignored_pairs", (None, 2), "(pairs, 2)"
        )
        pose = None if rest_pose is None else one_pose(rest_pose)
        data = _cab.from_boxes(
            parent_array, joint_array, link_array, boxes, shape_rows(shapes, n), pairs, ignored_hops, pose,
            is_column(order),
        )
        require_sound(data)
        return cls(data, names)

    @classmethod
    def from_skeleton(
        cls,
        parents: ArrayLike,
        poses: ArrayLike,
        *,
        names: Optional[Sequence[str]] = None,
        stature: float = 0,
        thickness: float = 1,
        order: Order = "row",
    ) -> Body:
        """A body of human thickness about the bones of a skeleton. All joints are links; some have no box.

        parents    (joints,) integers: each joint's parent, lower than its own index, or -1 for the first joint.
        poses      the rest pose: places (joints, 3), or joints to model as float32 (joints, 7), (joints, 3, 4) or
                   (joints, 4, 4). Or frames of a motion, with one axis more in front, of which the first is the rest
                   pose: the others tell which joints move. Later poses are of the same joints.
        names      a name per joint, which tells body parts: "LeftUpLeg", "upperarm_l".
        stature    the person's height in the unit of the poses. Default: by the figure's own bones.
        thickness  a factor of all thicknesses.

        Joints that meet are ignored pairs. A skeleton that makes no body is a ValueError.
        """
        parent_array = small_array(parents, "i4", "parents", (None,), "(joints,)")
        count = len(parent_array)
        given: Any = poses if isinstance(poses, np.ndarray) else small_array(
            poses, "f8", "poses", (count, 3), f"({count}, 3), or an array of poses,"
        )
        if given.shape == (count, 3):
            places = small_array(given, "f4", "poses", (count, 3), f"({count}, 3)")
            pose_array = np.zeros((1, count, 7), dtype=np.float32)
            pose_array[0, :, 3] = 1
            pose_array[0, :, 4:] = places
        elif given.shape[:1] == (count,) and given.shape[1:] in ((7,), (3, 4), (4, 4)):
            pose_array = given[np.newaxis]
        else:
            pose_array = given
        data = _cab.from_skeleton(
            parent_array, [] if names is None else list(names), pose_array, is_column(order), stature, thickness
        )
        return cls(data, names)

    @classmethod
    def from_skin(
        cls,
        parents: ArrayLike,
        poses: Float32Array,
        vertices: ArrayLike,
        bones: ArrayLike,
        weights: ArrayLike,
        inverse_bind: Float32Array,
        *,
        triangles: Optional[ArrayLike] = None,
        bone_joints: Optional[ArrayLike] = None,
        names: Optional[Sequence[str]] = None,
        kinds: Sequence[SkinKind] = ("hull",),
        max_hull_vertices: int = 40,
        leaves_per_link: int = 1,
        inflate: bool = False,
        least_reach: float = 0,
        kept_joints: Optional[ArrayLike] = None,
        order: Order = "row",
    ) -> SkinnedBody:
        """A body about the mesh of a skinned character, for when it is loaded: milliseconds to seconds.

        parents       (joints,) integers: each joint's parent, lower than its own index, or -1 for a root.
        poses         (joints, 4, 4) from joint to model in the rest pose, or several poses (k, joints, 4, 4).
        vertices      (n, 3) in the mesh's own space; triangles (m, 3), counter-clockwise from outside.
        bones         (n, influences) integers: the bones of each vertex, and weights (n, influences) their shares.
        inverse_bind  (bones, 4, 4) from the mesh to the joint; bone_joints (bones,): its joint. Default: bone b is
                      joint b.
        names         a name per joint.
        kinds         of "hull", "box", "capsule", "sphere" and "ellipsoid": each box takes the one of least volume.
        inflate       whether bodies grow until every triangle of every pose is inside.
        least_reach   joints of a smaller reach have no link; kept_joints: the joints that have one.
        order         of all matrices, as in `World.run`. Their last row must be 0 0 0 1.

        A skin that makes no body is a ValueError.
        """
        unknown = [kind for kind in kinds if kind not in _SKIN_KINDS]
        if unknown or not kinds:
            raise ValueError(f"kinds: {unknown or kinds!r} is none of {', '.join(_SKIN_KINDS)}")
        recipe = _Recipe(
            "from_skin",
            (
                sum({_SKIN_KINDS[kind] for kind in kinds}),
                max_hull_vertices,
                leaves_per_link,
                inflate,
                least_reach,
                small_array(() if kept_joints is None else kept_joints, "u4", "kept_joints", (None,), "(k,)"),
            ),
            _skin_arrays(parents, poses, vertices, triangles, bones, weights, inverse_bind, bone_joints, order),
        )
        return SkinnedBody._made_by(recipe, names)

    @classmethod
    def from_surface(
        cls,
        parents: ArrayLike,
        poses: Float32Array,
        vertices: ArrayLike,
        triangles: ArrayLike,
        bones: ArrayLike,
        weights: ArrayLike,
        inverse_bind: Float32Array,
        *,
        bone_joints: Optional[ArrayLike] = None,
        names: Optional[Sequence[str]] = None,
        most_triangles: int = 128,
        order: Order = "row",
    ) -> SkinnedBody:
        """The mesh of a skinned character itself, whose triangles follow every pose by a linear blend.

        Arguments are those of `from_skin`. `exact="surface"` tests the triangles; without it boxes that hold them are
        the answer. The surface is cut into boxes of at most `most_triangles`, and where it bends in `poses`.

        A skin without triangles is a ValueError.
        """
        recipe = _Recipe(
            "from_surface",
            (most_triangles,),
            _skin_arrays(parents, poses, vertices, triangles, bones, weights, inverse_bind, bone_joints, order),
        )
        return SkinnedBody._made_by(recipe, names)

    def ignoring(self, pairs: Optional[ArrayLike] = None, hops: int = 0) -> Body:
        """The same body with more pairs of links ignored: `pairs` (n, 2), and links at most `hops` joints apart."""
        return Body(self._ignoring(pairs, hops), self._names)

    def _ignoring(self, pairs: Optional[ArrayLike], hops: int) -> _cab.BodyData:
        more = small_array(() if pairs is None else pairs, "u4", "pairs", (None, 2), "(n, 2)")
        data = self._data.ignoring(more, hops)
        require_sound(data)
        return data

    def sha256(self) -> str:
        """SHA-256 of links, joints, boxes, shapes, surface and ignored pairs, in hexadecimal digits."""
        data = self._data
        digest = hashlib.sha256(repr((self._names, data.ignored_hops)).encode())
        for array in (data.parents, data.joints, data.links, data.boxes, data.ignored_pairs, data.rest_pose):
            _add_to_digest(digest, array)
        if self.is_surface:
            for part_of_skin in data.skin:
                _add_to_digest(digest, part_of_skin)
            for triangles in data.triangles:
                _add_to_digest(digest, triangles)
        for part in data.parts:
            for value in part:
                _add_to_digest(digest, value)
        return digest.hexdigest()

    @property
    def names(self) -> Tuple[str, ...]:
        """The name of each link."""
        return self._names

    @property
    def parents(self) -> Int32Array:
        """(links,) int32: the parent of each link, or -1."""
        return self._data.parents

    @property
    def link_count(self) -> int:
        """How many links there are."""
        return len(self._names)

    @property
    def box_links(self) -> UInt32Array:
        """(boxes,) uint32: the link of each box."""
        return self._data.links

    @property
    def boxes(self) -> StructuredArray:
        """(boxes,) structured: `center`, `axis` and `half` of each box, in its link's frame."""
        return self._data.boxes

    @property
    def triangles(self) -> List[UInt32Array]:
        """By box: (k, 3) uint32, the vertices of the triangles that it holds, if `is_surface`."""
        return self._data.triangles

    @property
    def is_surface(self) -> bool:
        """Whether it has triangles: of `from_surface`, or of a `Robot` with shapes="surface"."""
        return len(self._data.skin[0]) > 0

    @property
    def ignored_pairs(self) -> UInt32Array:
        """(pairs, 2) uint32: the pairs of links that were given, or made, to be ignored."""
        return self._data.ignored_pairs

    def __reduce__(self) -> Tuple[Any, ...]:
        return Body, (self._data, self._names)

    def __repr__(self) -> str:
        return f"cab.{type(self).__name__}({self.link_count} links, {len(self.box_links)} boxes)"


def _skin_arrays(
    parents: ArrayLike,
    poses: Float32Array,
    vertices: ArrayLike,
    triangles: Optional[ArrayLike],
    bones: ArrayLike,
    weights: ArrayLike,
    inverse_bind: Float32Array,
    bone_joints: Optional[ArrayLike],
    order: Order,
) -> Dict[str, Any]:
    parent_array = small_array(parents, "i4", "parents", (None,), "(joints,)")
    matrices = np.asarray(unmasked(poses, "poses"))
    if matrices.ndim == 3:
        matrices = matrices[np.newaxis]
    vertex_array = small_array(vertices, "f4", "vertices", (None, 3), "(n, 3)")
    binds = by_columns(inverse_bind, "inverse_bind", (None, 4, 4), "(bones, 4, 4)", order)
    n, bone_count = len(vertex_array), len(binds)
    return {
        "parents": parent_array,
        "poses": by_columns(matrices, "poses", (None, len(parent_array), 4, 4), "(joints, 4, 4)", order),
        "vertices": vertex_array,
        "triangles": small_array(() if triangles is None else triangles, "u4", "triangles", (None, 3), "(m, 3)"),
        "bones": small_array(bones, "u4", "bones", (n, None), f"({n}, influences)"),
        "weights": small_array(weights, "f4", "weights", (n, None), f"({n}, influences)"),
        "inverse_bind": binds,
        "bone_joints": small_array(
            np.arange(bone_count) if bone_joints is None else bone_joints, "u4", "bone_joints", (bone_count,),
            f"({bone_count},)",
        ),
    }


class _Recipe(NamedTuple):
    # The call of the extension module that makes bodies of a skin, and what it is given.
    call: str
    rules: Tuple[Any, ...]
    arrays: Dict[str, Any]

    def make(self) -> _cab.SkinData:
        made: _cab.SkinData = getattr(_cab, self.call)(*self.rules, **self.arrays)
        return made


class SkinnedBody(Body):
    """A body that `Body.from_skin` or `Body.from_surface` made. `joints` says which joints have a link.

    It keeps the arrays that it is made of. A pickle holds them, and what reads it makes the body anew.
    """

    __slots__ = ("_skin", "_recipe")

    def __init__(
        self, skin: _cab.SkinData, names: Optional[Sequence[str]], data: _cab.BodyData, recipe: _Recipe
    ) -> None:
        """For `Body.from_skin` and `Body.from_surface`."""
        super().__init__(data, names)
        self._skin = skin
        self._recipe = recipe

    @classmethod
    def _made_by(cls, recipe: _Recipe, joint_names: Optional[Sequence[str]]) -> SkinnedBody:
        skin = recipe.make()
        names = None if joint_names is None else [joint_names[joint] for joint in skin.joints]
        return cls(skin, names, skin.body, recipe)

    def __reduce__(self) -> Tuple[Any, ...]:
        return _skinned_body, (self._recipe, self._names, self._data)

    def ignoring(self, pairs: Optional[ArrayLike] = None, hops: int = 0) -> SkinnedBody:
        """As `Body.ignoring`: joints and poses of links stay."""
        return SkinnedBody(self._skin, self._names, self._ignoring(pairs, hops), self._recipe)

    @property
    def joints(self) -> UInt32Array:
        """(links,) uint32: the joint of each link."""
        return self._skin.joints

    @property
    def source_triangles(self) -> List[UInt32Array]:
        """By box: which of the `triangles` that were given it holds, row by row of `Body.triangles`."""
        ends = np.cumsum([len(triangles) for triangles in self.triangles])
        return np.split(self._skin.source_triangles, ends[:-1]) if self.is_surface else []

    def link_poses(self, matrices: ArrayLike, order: Order = "row") -> Float32Array:
        """Poses (frames, links, 7) from the matrices of all joints (frames, joints, 4, 4), without scale and shear."""
        return self._skin.link_poses(
            by_columns(matrices, "matrices", (None, None, 4, 4), "(frames, joints, 4, 4)", order)
        )


def _skinned_body(recipe: _Recipe, names: Sequence[str], data: _cab.BodyData) -> SkinnedBody:
    return SkinnedBody(recipe.make(), names, data, recipe)


def require_sound(data: _cab.BodyData) -> None:
    """Raises `InputError` for a body that no world takes."""
    _cab.Engine("scalar", 1).add_articulation(data)


def _add_to_digest(digest: "hashlib._Hash", value: Any) -> None:
    if isinstance(value, np.ndarray):
        digest.update(f"{value.dtype.str} {value.shape}".encode())
        digest.update(np.ascontiguousarray(value).tobytes())
    else:
        digest.update(repr(value).encode())


_SKIN_KINDS = {"hull": 1, "box": 2, "capsule": 4, "sphere": 8, "ellipsoid": 16}


def by_columns(matrices: Any, name: str, shape: Sequence[Optional[int]], words: str, order: Order) -> Float32Array:
    """Matrices as a packed array that is indexed by column, then row. ValueError for those in the other order."""
    array: Float32Array = small_array(matrices, "f4", name, shape, words)
    column = is_column(order)
    _cab.require_last_rows(array, name, column)
    return array if column else np.ascontiguousarray(np.swapaxes(array, -1, -2))


def is_column(order: Order) -> bool:
    """Whether matrices are indexed by column, then row."""
    if order not in ("row", "column"):
        raise ValueError(f"order: 'row' or 'column' is wanted, and {order!r} is given")
    return order == "column"


def one_pose(pose: ArrayLike) -> Any:
    """A pose of all links as poses of one instance; that of an array is not copied."""
    given = pose if isinstance(pose, np.ndarray) else np.asarray(pose, dtype=np.float32)
    return given[np.newaxis]
