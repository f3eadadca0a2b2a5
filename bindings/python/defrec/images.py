"""Images of a sequence for track(): folders, files, arrays and videos, in one view or two."""
from __future__ import annotations

import errno
import importlib
import itertools
import math
import os
import pathlib
import re
from typing import Any, Iterable, Iterator, List, NamedTuple, Optional, Sequence, Tuple, Union

from ._arrays import numpy
from .enums import Format

Images = Union[str, "os.PathLike[str]", Iterable[Any]]
"""A video, a folder of images in the order of their names, or images: files or arrays."""

_EXTENSIONS = {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm", ".ppm", ".pnm", ".webp"}
_LAYOUTS = ("side-by-side", "top-bottom")


class Pairs(NamedTuple):
    """Left and right image of each frame."""

    images: Iterator[Tuple[Any, Any]]
    colours: Format
    """The order of the three channels of left images: OpenCV's of arrays and videos, Pillow's of
    image files."""
    rate: Optional[float]
    """Frames per second, where a video says it."""


class _View(NamedTuple):
    images: Iterator[Any]
    colours: Format = Format.BGR8
    rate: Optional[float] = None
    files: Sequence[pathlib.Path] = ()
    """Those of a folder."""


def pairs_of(left: Images, right: Optional[Images], layout: Optional[str]) -> Pairs:
    """Left and right images; with a layout left holds both views, and right is None."""
    if layout is not None and layout not in _LAYOUTS:
        raise ValueError(f"layout is {layout!r}; {' or '.join(_LAYOUTS)} expected")
    if layout is not None and right is not None:
        raise TypeError("right was given beside a layout; left then holds both views")
    if layout is not None and numpy is None:
        raise ImportError("a layout needs NumPy (pip install numpy)")
    view = _view(left)
    if layout is not None:
        return Pairs(_halves(view.images, layout), view.colours, view.rate)
    if right is None:
        raise TypeError(f"right is None without a layout ({' or '.join(_LAYOUTS)})")
    other = _view(right)
    if view.files and other.files:
        _require_pairs(view.files, other.files)
    return Pairs(_pairs(view.images, other.images), view.colours, view.rate)


def pillow(module: str) -> Any:
    """A module of Pillow."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise ImportError(
            f"image files and pictures need Pillow (pip install pillow): {error}"
        ) from error


def _view(images: Images) -> _View:
    files: Sequence[pathlib.Path] = ()
    if isinstance(images, (str, os.PathLike)):
        path = pathlib.Path(images)
        if path.is_file():
            return _video(path)
        images = files = _files_of(path)
    images = iter(images)
    first = list(itertools.islice(images, 1))
    is_file = bool(first) and isinstance(first[0], (str, os.PathLike))
    colours = Format.RGB8 if is_file else Format.BGR8
    return _View(_read(itertools.chain(first, images)), colours, files=files)


def _files_of(folder: pathlib.Path) -> List[pathlib.Path]:
    if not folder.is_dir():
        what = (
            "no such folder; give the folder itself instead of a pattern"
            if re.search(r"%\d*d|[*?]", folder.name)
            else "no such folder of images, and no such video"
        )
        raise OSError(errno.ENOENT, what, str(folder))
    files = sorted(
        (file for file in folder.iterdir() if file.suffix.lower() in _EXTENSIONS),
        key=_name_order,
    )
    if not files:
        raise ValueError(f"{folder}: no images in it")
    return files


def _require_pairs(lefts: Sequence[pathlib.Path], rights: Sequence[pathlib.Path]) -> None:
    """Files are paired by their place in the order: one that is missing on one side would pair all
    that follow wrongly."""
    for i, (left, right) in enumerate(zip(lefts, rights)):
        if _digits_of(left) == _digits_of(right):
            continue
        if i == 0:  # the cameras count from different starts: no name agrees
            break
        raise ValueError(
            f"{left} would be paired with {right}: an image is missing on one side; remove its"
            " partner"
        )
    if len(lefts) != len(rights):
        raise ValueError(
            f"there are {len(lefts)} images in left and {len(rights)} in right; they must pair up"
        )


def _digits_of(path: pathlib.Path) -> str:
    return "".join(re.findall("[0-9]", path.stem))


def _video(path: pathlib.Path) -> _View:
    try:
        cv2 = importlib.import_module("cv2")
    except ImportError as error:
        raise ImportError(
            f"{path}: videos need OpenCV (pip install opencv-python-headless, or Debian's package"
            f" python3-opencv): {error}"
        ) from error
    video = cv2.VideoCapture(str(path))
    if not video.isOpened():
        raise OSError(errno.EINVAL, "not a video that OpenCV can read", str(path))
    rate = float(video.get(cv2.CAP_PROP_FPS))
    return _View(
        _frames(video), rate=rate if math.isfinite(rate) and 0.001 <= rate <= 10000 else None
    )


def _frames(video: Any) -> Iterator[Any]:
    try:
        while True:
            has_image, image = video.read()
            if not has_image:
                return
            yield image
    finally:
        video.release()


def _halves(images: Iterator[Any], layout: str) -> Iterator[Tuple[Any, Any]]:
    for image in images:
        both = numpy.asarray(image)
        axis = 1 if layout == "side-by-side" else 0
        size = both.shape[axis] if both.ndim > axis else 0
        if size == 0 or size % 2 != 0:
            raise ValueError(
                f"an image has shape {both.shape}; {'an even width' if axis else 'an even height'}"
                f" expected of two views {layout}"
            )
        first, second = numpy.split(both, 2, axis=axis)
        yield first, second


def _name_order(path: pathlib.Path) -> List[Tuple[int, str]]:
    """As people count: frame_9 before frame_10."""
    return [
        (int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", path.name)
    ]


def _read(images: Iterator[Any]) -> Iterator[Any]:
    for image in images:
        yield _image_file(image) if isinstance(image, (str, os.PathLike)) else image


def _image_file(path: Union[str, "os.PathLike[str]"]) -> Any:
    with pillow("PIL.Image").open(path) as image:
        gray = image.mode in ("L", "1")
        return _pixels(image.convert("L" if gray else "RGB"))


def _pixels(image: Any) -> Any:
    """Pixels of a Pillow image, with a shape: NumPy's array or a memoryview."""
    if numpy is not None:
        return numpy.asarray(image)
    channels = len(image.getbands())
    shape = [image.height, image.width] + ([channels] if channels > 1 else [])
    return memoryview(image.tobytes()).cast("B", shape)


def _pairs(lefts: Iterator[Any], rights: Iterator[Any]) -> Iterator[Tuple[Any, Any]]:
    end = object()
    for number, image in enumerate(lefts):
        partner = next(rights, end)
        if partner is end:
            raise ValueError(f"right has {number} images, left has more")
        yield image, partner
    if next(rights, end) is not end:
        raise ValueError("right has more images than left")
