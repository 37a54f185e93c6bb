"""What the tests of the Python package share."""

import os
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import cab

ROOT = Path(__file__).resolve().parents[4]


def rounds(count: int) -> int:
    """`count` by CAB_TEST_ROUNDS, at least 1: a number, or a fraction such as 1/4."""
    return max(1, int(count * Fraction(os.environ.get("CAB_TEST_ROUNDS", "1"))))


@pytest.fixture
def rng() -> np.random.Generator:
    """Random numbers of the seed CAB_TEST_SEED, which is printed when a test fails."""
    seed = int(os.environ.get("CAB_TEST_SEED", "1"))
    print(f"CAB_TEST_SEED={seed}")
    return np.random.default_rng(seed)


@pytest.fixture
def chain() -> cab.Body:
    """Eight links in a row, with the boxes of the golden frames."""
    return make_chain(8)


def make_chain(links: int, **more) -> cab.Body:
    """Links in a row, each with a box of 1 x 0.25 x 0.25 before its joint."""
    return cab.Body.from_boxes(
        np.arange(links) - 1, np.tile([0.5, 0.125, 0.125], (links, 1)), center=np.tile([0.5, 0, 0], (links, 1)), **more
    )


def random_poses(rng: np.random.Generator, count: int, links: int, spread: float = 2) -> np.ndarray:
    """Rotations of any direction, translations within `spread`: float32 (count, links, 7)."""
    poses = rng.uniform(-spread, spread, (count, links, 7)).astype(np.float32)
    quaternions = rng.standard_normal((count, links, 4))
    poses[..., :4] = quaternions / np.linalg.norm(quaternions, axis=-1, keepdims=True)
    return poses


def matrices_of(poses: np.ndarray) -> np.ndarray:
    """(n, links, 7) as float64 matrices (n, links, 4, 4) by rows."""
    x, y, z, w = np.moveaxis(poses[..., :4].astype(np.float64), -1, 0)
    matrices = np.zeros((*poses.shape[:2], 4, 4))
    matrices[..., 0, :3] = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], -1)
    matrices[..., 1, :3] = np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], -1)
    matrices[..., 2, :3] = np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], -1)
    matrices[..., :3, 3] = poses[..., 4:]
    matrices[..., 3, 3] = 1
    return matrices


def separation(center_a, axes_a, half_a, center_b, axes_b, half_b) -> float:
    """The largest gap of two boxes along the fifteen axes that can part them, in double; at most 0: they touch."""
    axes = [*axes_a, *axes_b, *(np.cross(u, v) for u in axes_a for v in axes_b)]
    worst = -np.inf
    for axis in axes:
        length = np.linalg.norm(axis)
        if length < 1e-6:
            continue
        axis = axis / length
        reach = half_a @ np.abs(axes_a @ axis) + half_b @ np.abs(axes_b @ axis)
        worst = max(worst, abs((center_b - center_a) @ axis) - reach)
    return worst
