"""Types of arrays, and small arrays from what Python programs have at hand. Poses are never converted."""

from __future__ import annotations

from typing import Any, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt

Float32Array = npt.NDArray[np.float32]
Float64Array = npt.NDArray[np.float64]
Int32Array = npt.NDArray[np.int32]
UInt8Array = npt.NDArray[np.uint8]
UInt32Array = npt.NDArray[np.uint32]
BoolArray = npt.NDArray[np.bool_]
ArrayLike = npt.ArrayLike
StructuredArray = npt.NDArray[np.void]

Shape = Tuple[Union[int, str], ...]


def unmasked(value: Any, name: str) -> Any:
    """The value itself. TypeError for a masked array, whose mask would be lost."""
    if isinstance(value, np.ma.MaskedArray):
        raise TypeError(f"{name}: a masked array is given, whose mask would be lost; {name}.filled() makes one without")
    return value


def small_array(
    value: Any, dtype: Any, name: str, shape: Sequence[Union[int, None]], words: str, *, copy: bool = True
) -> Any:
    """A packed array of that dtype and shape (None: any length). For what is given once, not for every frame.

    A copy, so that no other thread writes into it while a call reads it; with copy=False the array itself, if it fits.
    TypeError for what is no number, ValueError for another shape.
    """
    try:
        given = np.asarray(unmasked(value, name))
    except ValueError:
        given = np.empty(0, dtype=object)
    if given.size == 0 and given.dtype == np.float64:
        given = given.astype(dtype)
    kind = np.dtype(dtype).kind
    if given.dtype.kind not in {"i": "iu", "u": "iu", "b": "b"}.get(kind, "fiu"):
        raise TypeError(f"{name}: {np.dtype(dtype)} of shape {words} is wanted, and {given.dtype} is given")
    if kind in "iu" and given.size and (given.min() < np.iinfo(dtype).min or given.max() > np.iinfo(dtype).max):
        raise ValueError(f"{name}: a number is out of the range of {np.dtype(dtype)}")
    array = np.array(given, dtype=dtype, order="C") if copy else np.ascontiguousarray(given, dtype=dtype)
    if array.size == 0 and len(shape) == 2 and array.ndim == 1 and shape[1] is not None:
        array = array.reshape(0, shape[1])
    if array.ndim != len(shape) or any(s is not None and s != n for s, n in zip(shape, array.shape)):
        raise ValueError(f"{name}: {np.dtype(dtype)} of shape {words} is wanted, and the shape {array.shape} is given")
    return array


def borrowed(value: Any, dtype: Any, name: str, shape: Sequence[Union[int, None]], words: str) -> Any:
    """An array, or None, as it is, since it is borrowed; of a list and other sequences a small array."""
    if value is None or isinstance(value, np.ndarray):
        return value
    return small_array(value, dtype, name, shape, words)
