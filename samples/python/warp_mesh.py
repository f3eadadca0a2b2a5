#!/usr/bin/env python3
"""Moves a preoperative model along with the tissue: reads a mesh and writes one mesh for each
frame, with a status and an expected error at each vertex.

warp_mesh.py LEFT RIGHT FX,FY,CX,CY,BASELINE_MM MESH.obj OUT_FOLDER [DEVICE_ID]

MESH.obj is in the template frame (the rectified left camera of the frame that became the template;
an application registers its model to that), in mm. OUT_FOLDER/000000.ply and so on are in the
rectified left camera of their frame; status is defrec.PointStatus, expected_error_mm the
root mean square of the error to be expected.
"""
import pathlib
from typing import Optional

import numpy
from numpy.typing import NDArray

import defrec
from input import Sequence, parse_camera, run, wait_for_body
from mesh import read_obj


def write_ply(
    path: pathlib.Path, moved: defrec.WarpedPoints, triangles: NDArray[numpy.int64]
) -> None:
    with open(path, "w") as file:
        print("ply\nformat ascii 1.0\ncomment millimetres, left rectified camera", file=file)
        print(f"element vertex {len(moved.xyz)}", file=file)
        for name in ("float x", "float y", "float z", "uchar status", "float expected_error_mm"):
            print(f"property {name}", file=file)
        print(
            f"element face {len(triangles)}\nproperty list uchar uint vertex_indices\nend_header",
            file=file,
        )
        for (x, y, z), status, error in zip(*moved):
            print(f"{x:.4f} {y:.4f} {z:.4f} {status} {error:.4f}", file=file)
        for a, b, c in triangles:
            print(f"3 {a} {b} {c}", file=file)


def main(
    left_folder: str,
    right_folder: str,
    camera: str,
    mesh_file: str,
    out_folder: str,
    device_id: Optional[str] = None,
) -> None:
    sequence = Sequence(left_folder, right_folder)
    vertices, triangles = read_obj(mesh_file)
    folder = pathlib.Path(out_folder)
    folder.mkdir(exist_ok=True)

    with defrec.Context() as context:
        rig = defrec.Rig.rectified(context, sequence.width, sequence.height, parse_camera(camera))
        # Without a device id, the fastest is used.
        tracker = defrec.Tracker(context, rig, device_id, format=defrec.Format.RGB8)
        for frame, job in enumerate(tracker.process(sequence)):
            if len(job.result().vertices) > 0:  # there is a template
                with job.template() as template:
                    wait_for_body(template)
                write_ply(folder / f"{frame:06}.ply", job.warp_points(vertices), triangles)


if __name__ == "__main__":
    run(main, "warp_mesh LEFT RIGHT FX,FY,CX,CY,BASELINE_MM MESH.obj OUT_FOLDER [DEVICE_ID]", 5, 6)
