"""A block of quadratic bricks (C3D20R) with planes at given coordinates."""
import numpy as np

# Offsets of the 20 nodes of a brick, in half cells: corners, then the middles of the edges.
PLACES = "000 200 220 020 002 202 222 022 100 210 120 010 102 212 122 012 001 201 221 021"
OFFSETS = np.array([[int(digit) for digit in place] for place in PLACES.split()])


def with_middles(planes):
    planes = np.asarray(planes, float)
    return np.sort(np.concatenate([planes, (planes[1:] + planes[:-1]) / 2]))


class HexMesh:
    element_type = "C3D20R"

    def __init__(self, xs, ys, zs):
        halves = [with_middles(p) for p in (xs, ys, zs)]
        cells = [len(p) - 1 for p in (xs, ys, zs)]
        first = np.stack(
            np.meshgrid(*[2 * np.arange(n) for n in cells], indexing="ij"), -1
        ).reshape(-1, 1, 3)
        places = first + OFFSETS[None]
        sizes = [len(h) for h in halves]
        keys = (places[..., 0] * sizes[1] + places[..., 1]) * sizes[2] + places[..., 2]
        used, elements = np.unique(keys, return_inverse=True)
        self.elements = elements.reshape(keys.shape)
        i, j, k = used // (sizes[1] * sizes[2]), used // sizes[2] % sizes[1], used % sizes[2]
        self.nodes = np.stack([halves[0][i], halves[1][j], halves[2][k]], -1)

    def weights(self, points):
        """Nodes that points lie on and their weights: points x 8 each. The points are nodes, or
        middles of faces that lie across z."""
        at = {tuple(np.round(p, 6)): n for n, p in enumerate(self.nodes)}
        faces = {}
        for element in self.elements:
            for corners, middles in (
                ((0, 1, 2, 3), (8, 9, 10, 11)),
                ((4, 5, 6, 7), (12, 13, 14, 15)),
            ):
                middle = self.nodes[element[list(corners)]].mean(0)
                faces[tuple(np.round(middle, 6))] = element[list(corners + middles)]
        of_face = np.array([-0.25] * 4 + [0.5] * 4)
        nodes, weights = [], []
        for point in points:
            key = tuple(np.round(point, 6))
            nodes.append(np.full(8, at[key]) if key in at else faces[key])
            weights.append(np.eye(8)[0] if key in at else of_face)
        return np.array(nodes), np.array(weights)
