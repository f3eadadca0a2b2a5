#!/usr/bin/env python3
"""Writes the bodies of `defrec render` that have no formula.

usage: make_bodies.py [--out FOLDER] [--work FOLDER] [NAME...]

CalculiX, an independent finite-element program, computes how they deform; the displacements of
layers of a grid are written to sdk/scenes/bodies/recorded. Not part of a build. Needs the
Debian packages calculix-ccx, gmsh and python3-numpy, and about ten minutes of one core. x is s, y
is t and z is the depth beneath the surface, mm; the tissue is neo-Hookean, with large
displacements.
"""
import argparse
import pathlib
import struct
import subprocess
import sys
import tempfile

import numpy as np

from hex_mesh import HexMesh
from tet_mesh import TetMesh

DEPTHS = [0, 2, 5, 10, 20, 30, 40]  # as kBodyDepths of the renderer
QUANTUM = 0.002  # mm
SHEAR = 1.0  # modulus; only the ratio of two stiffnesses has a meaning
TURN = np.radians(40)
RATIOS = {"030": 0.30, "049": 0.49}


def neo_hooke(name, poisson, stiffer=1.0):
    bulk = 2 * SHEAR * (1 + poisson) / (3 * (1 - 2 * poisson))
    return (
        f"*MATERIAL, NAME={name}\n*HYPERELASTIC, NEO HOOKE\n"
        f"{stiffer * SHEAR / 2:.9g}, {2 / (stiffer * bulk):.9g}\n"
    )


def node_set(name, nodes):
    return f"*NSET, NSET={name}\n" + "".join(f"{n + 1},\n" for n in nodes)


def mesh_deck(mesh, poisson, stiff=None, stiffer=1.0):
    deck = ["*NODE, NSET=ALL\n"]
    deck += [f"{i + 1}, {x:.9g}, {y:.9g}, {z:.9g}\n" for i, (x, y, z) in enumerate(mesh.nodes)]
    stiff = np.zeros(len(mesh.elements), bool) if stiff is None else stiff
    for name, chosen in (("TISSUE", ~stiff), ("STIFF", stiff)):
        if not chosen.any():
            continue
        deck.append(f"*ELEMENT, TYPE={mesh.element_type}, ELSET={name}\n")
        for i in np.flatnonzero(chosen):
            numbers = [str(i + 1)] + [str(n + 1) for n in mesh.elements[i]]
            deck.append(
                ", ".join(numbers[:11])
                + (",\n" + ", ".join(numbers[11:]) if numbers[11:] else "")
                + "\n"
            )
        deck.append(neo_hooke("OF_" + name, poisson, stiffer if name == "STIFF" else 1.0))
        deck.append(f"*SOLID SECTION, ELSET={name}, MATERIAL=OF_{name}\n")
    return "".join(deck)


def run(folder, deck):
    (folder / "body.inp").write_text(deck)
    with open(folder / "body.log", "w") as log:
        subprocess.run(
            ["ccx", "-i", "body"], cwd=folder, stdout=log, stderr=subprocess.STDOUT, check=True
        )


def displacements(folder, nodes):
    """By time: nodes x 3."""
    result, now = {}, None
    for line in open(folder / "body.dat"):
        fields = line.split()
        if line.lstrip().startswith("displacements"):
            now = np.full((nodes, 3), np.nan)
            result[round(float(fields[-1]), 6)] = now
        elif len(fields) == 4 and now is not None:
            now[int(fields[0]) - 1] = [float(f) for f in fields[1:]]
    return result


PRINT = "*NODE PRINT, NSET=ALL, FREQUENCY=1000\nU\n"


def lifted_deck(mesh, poisson, held, grasped, placed, increments):
    """Steps in which the grasped nodes follow placed(share) and the held ones stay."""
    deck = mesh_deck(mesh, poisson) + node_set("HELD", held) + "*BOUNDARY\nHELD, 1, 3, 0.\n"
    for step in range(1, increments + 1):
        deck += "*STEP, NLGEOM, INC=200\n*STATIC\n0.5, 1., 1e-4, 0.5\n*BOUNDARY\n"
        for node, moved in zip(grasped, placed(step / increments) - mesh.nodes[grasped]):
            deck += "".join(f"{node + 1}, {i + 1}, {i + 1}, {moved[i]:.9g}\n" for i in range(3))
        deck += PRINT + "*END STEP\n"
    return deck


def bent(mesh, nodes, start, middle):
    """Where nodes go that a beam from x = start takes along. Its plane z = middle keeps its length
    and bends to an arc that ends with TURN."""

    def placed(share):
        rest = mesh.nodes[nodes]
        turn = share * TURN
        ends = rest[:, 0].mean()
        radius = (ends - start) / turn
        end = np.array([start + radius * np.sin(turn), middle - radius * (1 - np.cos(turn))])
        along, up = np.array([np.cos(turn), -np.sin(turn)]), np.array([np.sin(turn), np.cos(turn)])
        moved = rest.copy()
        moved[:, [0, 2]] = (
            end + (rest[:, 0] - ends)[:, None] * along + (rest[:, 2] - middle)[:, None] * up
        )
        return moved

    return placed


def lifted(folder, poisson, length, width, layers, grasp_depth, grasp_width, planes):
    """A slab: its strip x < -length / 2 + 5 is held, and its opposite edge is lifted and turned.
    planes: along x and y, between the elements."""
    increments = 10
    xs, ys = np.arange(-length / 2, length / 2 + 1, 5), np.arange(-width / 2, width / 2 + 1, 5)
    mesh = HexMesh(*planes, layers)
    x, y, z = mesh.nodes.T
    held = np.flatnonzero(x <= -length / 2 + 5.001)
    grasped = np.flatnonzero(
        (x >= length / 2 - 5.001)
        & (z <= grasp_depth + 1e-3)
        & (np.abs(y) <= grasp_width / 2 + 1e-3)
    )
    placed = bent(mesh, grasped, -length / 2 + 5, layers[-1] / 2)
    run(folder, lifted_deck(mesh, poisson, held, grasped, placed, increments))
    return (
        mesh,
        displacements(folder, len(mesh.nodes)),
        [float(i) for i in range(1, increments + 1)],
        xs,
        ys,
    )


def organ(folder, poisson):
    planes = np.arange(-55, 56, 5), np.arange(-40, 41, 5)
    return lifted(folder, poisson, 110, 80, [0, 2, 5, 10, 14], 14, 40, planes)


def retract(folder, poisson):
    planes = np.concatenate([[-65], np.arange(-60, 61, 10), [65]]), np.arange(-45, 46, 10)
    return lifted(folder, poisson, 130, 90, [0, 2, 5, 10, 20, 30, 40, 50], 20, 50, planes)


def inclusion(folder, poisson):
    """A block on a base that holds it, with a stiff ball in it, under a Gaussian pressure with a
    standard deviation of 8 mm."""
    increments, ball = 8, np.array([9.0, -4.0, 18.0])
    # The facets cut the ball off: it is left the volume of one with a radius of 8 mm.
    mesh = TetMesh(folder, (-55, -45, 0), (55, 45, 50), ball, 8.124, 1.6)
    print(
        f"{len(mesh.nodes)} nodes, {len(mesh.elements)} elements, {mesh.in_ball.sum()} in the ball"
    )
    held = np.flatnonzero(mesh.nodes[:, 2] > 50 - 1e-6)
    # Pits of 6.0 and 8.7 mm. Nearly incompressible tissue creases beside deeper ones.
    wanted = 7.0 if poisson > 0.4 else 8.75  # mm, of a half-space with small displacements
    largest = wanted / ((1 - poisson) * np.sqrt(np.pi / 2) * 8 / SHEAR)
    forces = mesh.top_forces(lambda x, y: largest * np.exp(-(x * x + y * y) / 128))
    deck = (
        mesh_deck(mesh, poisson, mesh.in_ball, 10)
        + node_set("HELD", held)
        + "*BOUNDARY\nHELD, 1, 3, 0.\n"
        + f"*STEP, NLGEOM, INC=200\n*STATIC, DIRECT\n{1 / increments}, 1.\n*CLOAD\n"
        + "".join(f"{n + 1}, 3, {f:.9g}\n" for n, f in sorted(forces.items()))
        + PRINT.replace("1000", "1")
        + "*END STEP\n"
    )
    run(folder, deck)
    times = [i / increments for i in range(1, increments + 1)]
    return (
        mesh,
        displacements(folder, len(mesh.nodes)),
        times,
        np.arange(-52, 53, 4.0),
        np.arange(-44, 45, 4.0),
    )


BODIES = {"organ": (organ, 14), "retract": (retract, 50), "inclusion": (inclusion, 50)}


def write(path, mesh, by_time, times, xs, ys, thickness):
    depths = [d for d in DEPTHS if d < thickness]
    points = np.array([(x, y, z) for z in depths for y in ys for x in xs])
    nodes, weights = mesh.weights(points)
    states = []
    for time in times:
        moved = np.einsum("pn,pnc->pc", weights, by_time[time][nodes])
        assert np.isfinite(moved).all()
        states.append(np.rint(moved / QUANTUM))
    numbers = np.array(states)
    assert np.abs(numbers).max() < 32768
    header = struct.pack(
        "<4i5f",
        len(xs),
        len(ys),
        len(depths),
        len(times),
        xs[0],
        ys[0],
        xs[1] - xs[0],
        ys[1] - ys[0],
        QUANTUM,
    )
    path.write_bytes(header + numbers.astype("<i2").tobytes())
    largest = QUANTUM * np.abs(numbers).max()
    print(f"{path.name}: {path.stat().st_size} bytes, moves by at most {largest:.1f} mm")


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    root = pathlib.Path(__file__).resolve().parents[2]
    parser.add_argument("--out", type=pathlib.Path, default=root / "sdk/scenes/bodies/recorded")
    parser.add_argument("--work", type=pathlib.Path, help="keeps decks and results there")
    parser.add_argument("names", nargs="*", metavar="NAME", help="such as organ_030; default: all")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    for body, (make, thickness) in BODIES.items():
        for ratio, poisson in RATIOS.items():
            name = f"{body}_{ratio}"
            if options.names and name not in options.names:
                continue
            with tempfile.TemporaryDirectory() as temporary:
                folder = (options.work or pathlib.Path(temporary)) / name
                folder.mkdir(parents=True, exist_ok=True)
                write(options.out / f"{name}.bin", *make(folder, poisson), thickness)


if __name__ == "__main__":
    sys.exit(main())
