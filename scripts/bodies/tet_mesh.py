"""A block with a ball in it, of quadratic tetrahedra (C3D10) with straight edges, by gmsh."""
import subprocess

import numpy as np

GEOMETRY = """SetFactory("OpenCASCADE");
Box(1) = {{{x0}, {y0}, 0, {dx}, {dy}, {dz}}};
Sphere(2) = {{{cx}, {cy}, {cz}, {radius}}};
BooleanFragments{{ Volume{{1}}; Delete; }}{{ Volume{{2}}; Delete; }}
Mesh.ElementOrder = 2;
Mesh.SecondOrderLinear = 1;
Mesh.CharacteristicLengthFromPoints = 0;
Mesh.CharacteristicLengthExtendFromBoundary = 0;
Field[1] = MathEval;
Field[1].F = "{size} + 0.16*Sqrt(x*x+y*y+z*z)";
Field[2] = MathEval;
Field[2].F = "{size} + 0.16*Sqrt((x-({cx}))^2+(y-({cy}))^2+(z-({cz}))^2)";
Field[3] = Min;
Field[3].FieldsList = {{1, 2}};
Background Field = 3;
"""
# Edges whose middles are nodes 5 to 10 of ccx.
EDGES = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]
# gmsh's last two edges are the other way round.
FROM_GMSH = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]


def shapes(bary):
    """Quadratic shape functions at barycentric coordinates: ... x 10."""
    corners = bary * (2 * bary - 1)
    middles = np.stack([4 * bary[..., a] * bary[..., b] for a, b in EDGES], -1)
    return np.concatenate([corners, middles], -1)


class TetMesh:
    element_type = "C3D10"

    def __init__(self, folder, low, high, ball, radius, size):
        """size: mm, of edges at the origin and in the ball's middle; they grow from there."""
        low, high = np.array(low, float), np.array(high, float)
        (folder / "block.geo").write_text(
            GEOMETRY.format(
                x0=low[0],
                y0=low[1],
                dx=high[0] - low[0],
                dy=high[1] - low[1],
                dz=high[2],
                cx=ball[0],
                cy=ball[1],
                cz=ball[2],
                radius=radius,
                size=size,
            )
        )
        subprocess.run(
            ["gmsh", "-3", "-format", "msh22", "-v", "2", "block.geo", "-o", "block.msh"],
            cwd=folder,
            check=True,
        )
        lines = (folder / "block.msh").read_text().split("\n")
        start = lines.index("$Nodes") + 1
        nodes = np.array(
            [line.split()[1:] for line in lines[start + 1 : start + 1 + int(lines[start])]], float
        )
        start = lines.index("$Elements") + 1
        rows = [
            [int(x) for x in line.split()]
            for line in lines[start + 1 : start + 1 + int(lines[start])]
        ]
        tets = [r for r in rows if r[1] == 11]
        elements = np.array([r[-10:] for r in tets])[:, FROM_GMSH] - 1
        used, elements = np.unique(elements, return_inverse=True)
        self.nodes, self.elements = nodes[used], elements.reshape(-1, 10)
        middles = self.nodes[self.elements[:, :4]].mean(axis=1)
        self.in_ball = np.linalg.norm(middles - ball, axis=1) < radius

    def weights(self, points):
        """Nodes that points lie between and their weights: points x 10 each."""
        corners = self.nodes[self.elements[:, :4]]
        inverse = np.linalg.inv(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2))
        nodes, weights = [], []
        for point in points:
            shares = np.einsum("eij,ej->ei", inverse, point - corners[:, 0])
            bary = np.concatenate([1 - shares.sum(-1, keepdims=True), shares], -1)
            best = int(bary.min(1).argmax())
            assert bary[best].min() > -1e-6, point
            nodes.append(self.elements[best])
            weights.append(shapes(bary[best]))
        return np.array(nodes), np.array(weights)

    def top_forces(self, pressure):
        """Forces on the nodes of the face z = 0 that a pressure on it is worth: node to force."""
        # Each face in four parts, with Gauss's three points in each.
        forces = {}
        gauss = np.array([(2 / 3, 1 / 6, 1 / 6), (1 / 6, 2 / 3, 1 / 6), (1 / 6, 1 / 6, 2 / 3)])
        a, b, c = np.eye(3)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        parts = np.array([(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)])
        quadrature = (gauss @ parts).reshape(-1, 3)
        for face in [(0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)]:
            on_top = (np.abs(self.nodes[self.elements[:, list(face)], 2]) < 1e-6).all(1)
            middles = [
                4 + [set(e) for e in EDGES].index({face[a], face[b]})
                for a, b in ((0, 1), (1, 2), (0, 2))
            ]
            for element in self.elements[on_top]:
                corners = self.nodes[element[list(face)], :2]
                area = 0.5 * abs(np.cross(corners[1] - corners[0], corners[2] - corners[0]))
                names = element[list(face) + middles]
                for b in quadrature:
                    weight = area / len(quadrature) * pressure(*(b @ corners))
                    values = np.concatenate([b * (2 * b - 1), 4 * b * b[[1, 2, 0]]])
                    for name, value in zip(names, values):
                        forces[name] = forces.get(name, 0.0) + weight * value
        return forces
