"""A plane with texture that faces the cameras: what a pair of cameras sees of it, without any image
file."""
import random

from defrec import Camera

WIDTH, HEIGHT = 192, 144
CAMERA = Camera(fx=200, fy=200, cx=95.5, cy=71.5, baseline_mm=4)
DISPARITY = 16
DEPTH_MM = CAMERA.fx * CAMERA.baseline_mm / DISPARITY


def texture(width, height, cell=4, seed=1):
    """Smooth noise as rows of gray values."""
    values = random.Random(seed)
    columns, rows = width // cell + 2, height // cell + 2
    nodes = [[values.randrange(40, 216) for _ in range(columns)] for _ in range(rows)]
    made = []
    for y in range(height):
        row, down = divmod(y, cell)
        edge = [nodes[row][i] * (cell - down) + nodes[row + 1][i] * down for i in range(columns)]
        made.append(
            bytes(
                (edge[x // cell] * (cell - x % cell) + edge[x // cell + 1] * (x % cell))
                // (cell * cell)
                for x in range(width)
            )
        )
    return made


_TEXTURE = texture(WIDTH + DISPARITY + 16, HEIGHT)


def pair(shift=0):
    """Left and right gray image, bytes; the plane lies shift px further left than in pair(0)."""
    left = b"".join(row[shift : shift + WIDTH] for row in _TEXTURE)
    right = b"".join(row[shift + DISPARITY : shift + DISPARITY + WIDTH] for row in _TEXTURE)
    return left, right
