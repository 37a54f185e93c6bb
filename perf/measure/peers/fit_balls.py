#!/usr/bin/env python3
"""Writes a URDF file whose collision shapes are balls that hold all triangles of the meshes and boxes of another.

    perf/measure/peers/fit_balls.py ROBOT.urdf BALLS.urdf [--balls N] [--package NAME=DIR]

N balls for each mesh that is longer than 10 cm (default 6), 3 for smaller ones and 1 for boxes. Triangles are cut until
their edges are shorter than 2 cm, and put into cells by their middles (k-means, the best of 6 starts); a ball holds the
corners of all triangles of its cell. Meshes are binary STL or OBJ files without scales.
"""

import argparse
import pathlib
import xml.etree.ElementTree as ET

import numpy as np


def read_triangles(path: pathlib.Path) -> np.ndarray:
    """(n, 3, 3) corners."""
    if path.suffix == ".stl":
        row = np.dtype([("normal", "<f4", 3), ("at", "<f4", (3, 3)), ("end", "<u2")])
        return np.frombuffer(path.read_bytes()[84:], dtype=row)["at"].astype(float)
    vertices, faces = [], []
    for words in (line.split() for line in path.read_text().splitlines()):
        if words[:1] == ["v"]:
            vertices.append([float(word) for word in words[1:4]])
        if words[:1] == ["f"]:
            corners = [int(word.split("/")[0]) - 1 for word in words[1:]]
            faces += [[corners[0], corners[k], corners[k + 1]] for k in range(1, len(corners) - 1)]
    return np.array(vertices)[np.array(faces)]


def cut(triangles: np.ndarray, longest: float) -> np.ndarray:
    """Halves triangles along their longest edges until these are short."""
    done = []
    while len(triangles):
        edges = np.linalg.norm(triangles - np.roll(triangles, -1, axis=1), axis=2)
        short = edges.max(1) <= longest
        done.append(triangles[short])
        triangles, edges = triangles[~short], edges[~short]
        turn = (np.arange(3) + edges.argmax(1)[:, None]) % 3  # the longest edge first
        a, b, c = np.moveaxis(np.take_along_axis(triangles, turn[..., None], axis=1), 1, 0)
        triangles = np.concatenate([np.stack([a, (a + b) / 2, c], 1), np.stack([(a + b) / 2, b, c], 1)])
    return np.concatenate(done)


def ball(points: np.ndarray) -> "tuple[np.ndarray, float]":
    center = points.mean(0)
    for step in range(2, 2000):
        center += (points[((points - center) ** 2).sum(1).argmax()] - center) / step
    return center, 1.0001 * np.sqrt(((points - center) ** 2).sum(1).max())


def fit(triangles: np.ndarray, count: int, random: np.random.Generator) -> "list[tuple[np.ndarray, float]]":
    triangles = cut(triangles, 0.02)
    middles = triangles.mean(1)
    tries = []
    for _ in range(6):
        centers = middles[random.choice(len(middles), count, replace=False)]
        for _ in range(30):
            cell = ((middles[:, None] - centers) ** 2).sum(2).argmin(1)
            centers = np.array([middles[cell == k].mean(0) if (cell == k).any() else centers[k] for k in range(count)])
        tries.append([ball(triangles[cell == k].reshape(-1, 3)) for k in range(count) if (cell == k).any()])
    return min(tries, key=lambda balls: sum(radius**3 for _, radius in balls))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robot", type=pathlib.Path)
    parser.add_argument("out")
    parser.add_argument("--balls", type=int, default=6)
    parser.add_argument("--package", default="=", help="NAME=DIR, for package://NAME paths")
    options = parser.parse_args()
    name, folder = options.package.split("=", 1)
    random, tree, total = np.random.default_rng(1), ET.parse(options.robot), 0
    for link in tree.getroot().findall("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
        for shape in link.findall("collision"):
            origin = shape.find("origin")
            place = {} if origin is None else origin.attrib
            mesh, box = shape.find("geometry/mesh"), shape.find("geometry/box")
            if mesh is not None:
                if any(float(angle) for angle in place.get("rpy", "0").split()) or mesh.get("scale"):
                    parser.error(f"{link.get('name')}: a mesh is turned or scaled")
                path = mesh.get("filename", "").replace(f"package://{name}/", folder + "/", 1)
                triangles = read_triangles(options.robot.parent / path)
                is_large = np.ptp(triangles.reshape(-1, 3), axis=0).max() > 0.1
                balls = fit(triangles, options.balls if is_large else 3, random)
            elif box is not None:
                half = [float(word) / 2 for word in box.get("size", "").split()]
                balls = [(np.zeros(3), 1.0001 * float(np.linalg.norm(half)))]
            else:
                parser.error(f"{link.get('name')}: a shape is neither a mesh nor a box")
            link.remove(shape)
            at = np.array([float(word) for word in place.get("xyz", "0 0 0").split()])
            for center, radius in balls:
                collision = ET.SubElement(link, "collision")
                ET.SubElement(collision, "origin", xyz=" ".join(f"{word:.6f}" for word in center + at))
                ET.SubElement(ET.SubElement(collision, "geometry"), "sphere", radius=f"{radius + 1e-6:.6f}")
            total += len(balls)
    tree.write(options.out)
    print(total, "balls")


if __name__ == "__main__":
    main()
