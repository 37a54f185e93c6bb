"""The names that options take, for type checkers. `policy_table()` and `presets()` say what policies mean."""

from typing import Literal

Isa = Literal["auto", "scalar", "sse2", "avx2", "avx512", "neon64", "wasm128"]
Order = Literal["row", "column"]
Refit = Literal["cab", "best3", "cab_sum", "covariance", "aabb_hull", "aabb_vertices"]
Strategy = Literal["tree", "rows", "links", "brute", "auto"]
Exact = Literal["none", "fcl", "convex", "surface"]
Extents = Literal["children", "leaves"]
Sat = Literal["all_15", "faces_6"]
Preset = Literal["paper", "balanced", "tight"]
Report = Literal["hits", "in_contact", "distances"]
Resting = Literal["reported", "skipped"]
QueryReport = Literal["hits", "links", "counts"]
Want = Literal["any", "closest", "all"]
MotionBody = Literal["skeleton", "skin", "surface"]
SkinKind = Literal["hull", "box", "capsule", "sphere", "ellipsoid"]
