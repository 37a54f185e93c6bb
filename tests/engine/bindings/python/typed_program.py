"""A program that uses all of the package, for mypy --strict. It is not run."""

from typing import List, Optional, Tuple

import numpy as np
import numpy.typing as npt

import cab


def crowd(poses: npt.NDArray[np.float32], origins: npt.NDArray[np.float64]) -> int:
    body = cab.Body.from_boxes([-1, 0], [[0.1, 0.1, 0.1]] * 2, shapes=[cab.Shape.sphere(0.1), None], names=["a", "b"])
    with cab.World(threads=2, isa="auto") as world:
        batch: cab.Batch = world.add(body, len(poses))
        frame: cab.Frame = world.run(poses, origins=[[0, 0, 0]] * len(poses))
        frame = world.run(poses, origins=origins, within=True, exact="convex", policies="tight")
        posed: cab.Posed = batch.posed(poses, origins=origins, in_contact=True)
        frame = world.run([posed], pairs=[(batch, batch)], policies=cab.Policies(refit="cab"))
        depth: Optional[npt.NDArray[np.void]] = frame.contacts
        stats: cab.FrameStats = frame.stats
        seconds: float = stats.seconds_total
        queries: cab.Queries = cab.rays([[0, 0, 0]], [1, 0, 0]) + cab.points([[0, 0, 0]], 2.0)
        answers: cab.Answers = world.query(queries, posed)
        history: cab.History = world.add_history(batch, 4)
        history.record(seconds, posed)
        found: npt.NDArray[np.bool_] = answers.found
        names: Tuple[str, ...] = body.names
        return len(frame.hits) + len(names) + int(found.sum()) + (0 if depth is None else len(depth))


def options(world: cab.World, poses: npt.NDArray[np.float32]) -> None:
    world.run(poses, exact="convx")  # type: ignore[arg-type]
    world.run(poses, policies="slow")  # type: ignore[arg-type]
    world.run(poses, report="all", resting="skipped")  # type: ignore[arg-type]
    cab.Policies(refit="cab", sat="faces")  # type: ignore[arg-type]
    cab.rays([[0, 0, 0]], [1, 0, 0], want="first")  # type: ignore[arg-type]
    cab.World(isa="mmx")  # type: ignore[arg-type]


def clip(body: cab.Body, poses: npt.NDArray[np.float32]) -> List[str]:
    recording = cab.Clip(body, poses, fps=120)
    number: int = recording.add(body, poses, name="b")
    lines = [recording.link_name(number, 0), cab.__version__]
    for row in recording.intervals(min_depth=0.01, gap=2):
        lines.append(f"{row['first']} {row['depth']}")
    table: cab.Table = recording.table(recording.hits())
    lines += [str(name) for name in table["link_a"]]
    return lines


def failing(world: cab.World, body: cab.Body) -> cab.Status:
    try:
        world.add(body, 0)
    except cab.InputError as error:
        return error.status
    return cab.Status.OK


def states(robot: cab.Robot) -> int:
    held = cab.Attached(robot.body.names[-1], cab.Body.from_boxes([-1], [[0.1, 0.1, 0.1]]), touching=["a"], name="box")
    checker = cab.CollisionChecker(robot, margin=0.01, padding={"box": 0.01}, attached=[held])
    checker.add_fixed(robot.body)
    colliding: npt.NDArray[np.bool_] = checker.collides(robot.random_states(8))
    free: npt.NDArray[np.bool_] = checker.edges([robot.rest()], [robot.rest()])["free"]
    hits = robot.hits({"elbow": 0.5}, depths=True)
    print(checker.table(hits), robot.table(robot.allowed_collisions()))
    return int(free.sum()) + int(colliding.sum()) + len(hits) + len(robot.allowed_collisions(100))


def what_there_is() -> Tuple[List[str], bool]:
    fields: List[cab.PolicyField] = cab.policy_table()
    assert fields and cab.presets()
    return cab.isas(), cab.build_info().fcl
