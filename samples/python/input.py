"""Input of the samples: a camera on the command line, folders of PNG images."""
import pathlib
import sys
from typing import Callable, Iterator, List, Tuple

import numpy
from numpy.typing import NDArray
from PIL import Image

import defrec

Image8 = NDArray[numpy.uint8]


def run(main: Callable[..., None], usage: str, min_count: int, max_count: int) -> None:
    """Calls main with the command line's arguments; a failure ends the program with a message."""
    if not min_count <= len(sys.argv) - 1 <= max_count:
        print(f"usage: {usage}", file=sys.stderr)
        sys.exit(2)
    try:
        main(*sys.argv[1:])
    except (defrec.Error, OSError, ValueError) as error:
        sys.exit(str(error))


def wait_for_body(template: defrec.Template) -> None:
    """Waits for the body beneath the surface, as results of a recording must not depend on when it
    is ready. A live loop goes on meanwhile: Result.body says whether it is. A template of which no
    body can be made moves points rigidly beneath its surface."""
    try:
        template.wait_body()
    except defrec.Error as error:
        if error.status != defrec.Status.ERROR_UNSUPPORTED:
            raise


def is_given_up(result: defrec.Result) -> bool:
    """Whether a tracker that had a template has none in this frame: it was given up, which is said
    on standard error. All in its frame of reference is void then, and the next template needs a
    registration of its own."""
    if len(result.vertices) > 0:
        return False
    print(
        f"frame {result.frame}: the template was given up; the targets are lost until they are "
        "registered to another",
        file=sys.stderr,
    )
    return True


def parse_camera(text: str) -> defrec.Camera:
    """ "FX,FY,CX,CY,BASELINE_MM" of a rectified pair of images."""
    try:
        fx, fy, cx, cy, baseline_mm = (float(number) for number in text.split(","))
    except ValueError:
        raise ValueError(f'the camera is "{text}"; FX,FY,CX,CY,BASELINE_MM expected') from None
    return defrec.Camera(fx=fx, fy=fy, cx=cx, cy=cy, baseline_mm=baseline_mm)


def read_rgb(path: pathlib.Path) -> Image8:
    """(height, width, 3) uint8."""
    with Image.open(path) as image:
        return numpy.asarray(image.convert("RGB"))


def read_gray(path: str) -> Image8:
    """(height, width) uint8."""
    with Image.open(path) as image:
        return numpy.asarray(image.convert("L"))


class Sequence:
    """Two folders of PNG images in the order of their names, at 30 frames a second."""

    def __init__(self, left_folder: str, right_folder: str) -> None:
        lefts, rights = _png_files(left_folder), _png_files(right_folder)
        if len(lefts) != len(rights):
            raise ValueError(
                f"{left_folder} has {len(lefts)} images, {right_folder} has {len(rights)}"
            )
        self._files = list(zip(lefts, rights))
        left, _, _ = self[0]
        self.height, self.width, _ = left.shape

    def __len__(self) -> int:
        return len(self._files)

    def __iter__(self) -> Iterator[Tuple[Image8, Image8, int]]:
        return (self[frame] for frame in range(len(self)))

    def __getitem__(self, frame: int) -> Tuple[Image8, Image8, int]:
        """Left image, right image, timestamp in ns."""
        left, right = self._files[frame]
        return read_rgb(left), read_rgb(right), frame * 1_000_000_000 // 30


def _png_files(folder: str) -> List[pathlib.Path]:
    files = sorted(path for path in pathlib.Path(folder).iterdir() if path.suffix == ".png")
    if not files:
        raise ValueError(f"{folder}: no PNG images in it")
    return files
