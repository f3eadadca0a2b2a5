"""A triangle mesh of an OBJ file, for the samples."""
import pathlib
from typing import Dict, List, Tuple

import numpy
from numpy.typing import NDArray


def read_obj(path: str) -> Tuple[NDArray[numpy.float64], NDArray[numpy.int64]]:
    """Vertices (n, 3) and triangles (m, 3), from 0, of the lines "v X Y Z" and "f A B C"."""
    rows: Dict[str, List[Tuple[float, float, float]]] = {"v": [], "f": []}
    for line in pathlib.Path(path).read_text().splitlines():
        word, *numbers = line.split() or [""]
        if word in rows:
            try:
                a, b, c = (float(number) if word == "v" else int(number) for number in numbers)
            except ValueError:
                raise ValueError(
                    f'{path}: "v X Y Z" or "f A B C" expected, found "{line}"'
                ) from None
            rows[word].append((a, b, c))
    vertices = numpy.array(rows["v"], numpy.float64)
    triangles = numpy.array(rows["f"], numpy.int64).reshape(-1, 3) - 1
    if len(vertices) == 0:
        raise ValueError(f"{path}: has no vertices")
    if triangles.size > 0 and not 0 <= triangles.min() <= triangles.max() < len(vertices):
        raise ValueError(f"{path}: a triangle names a vertex that is not there")
    return vertices, triangles
