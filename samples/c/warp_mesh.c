/* Moves a preoperative model along with the tissue: reads a mesh and writes one mesh for each
 * frame, with a status and an expected error at each vertex.
 *   warp_mesh LEFT RIGHT FX,FY,CX,CY,BASELINE_MM MESH.obj OUT_FOLDER [DEVICE_ID]
 * MESH.obj is in the template frame (the rectified left camera of the frame that became the
 * template; an application registers its model to that), in mm. OUT_FOLDER/000000.ply and so on
 * are in the rectified left camera of their frame; status is DEFREC_POINT_*, expected_error_mm the
 * root mean square of the error to be expected. */
#define _POSIX_C_SOURCE 200809L
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#ifdef _WIN32
#include <direct.h>
#define mkdir(path, mode) _mkdir(path)
#endif

#include "mesh.h"
#include "tracking.h"

static void write_ply(const char* folder, size_t frame, const mesh* model, const double* xyz,
                      const uint8_t* status, const double* expected_error_mm) {
    char path[4096];
    size_t i;
    FILE* file;
    snprintf(path, sizeof path, "%s/%06zu.ply", folder, frame);
    file = fopen(path, "w");
    if (file == NULL) fail("%s: cannot be written", path);
    fprintf(
        file,
        "ply\nformat ascii 1.0\ncomment millimetres, left rectified camera\nelement vertex %zu\n",
        model->vertex_count);
    fprintf(file,
            "property float x\nproperty float y\nproperty float z\nproperty uchar status\nproperty "
            "float expected_error_mm\n");
    fprintf(file, "element face %zu\nproperty list uchar uint vertex_indices\nend_header\n",
            model->triangle_count);
    for (i = 0; i < model->vertex_count; ++i)
        fprintf(file, "%.4f %.4f %.4f %u %.4f\n", xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2],
                status[i], expected_error_mm[i]);
    for (i = 0; i < model->triangle_count; ++i)
        fprintf(file, "3 %u %u %u\n", model->triangles[3 * i], model->triangles[3 * i + 1],
                model->triangles[3 * i + 2]);
    if (fclose(file) != 0) fail("%s: could not be written to its end", path);
}

int main(int argc, char** argv) {
    stereo_sequence sequence;
    mesh model;
    tracking running;
    double *xyz, *expected_error_mm;
    uint8_t* status;
    size_t i;
    if (argc < 6 || argc > 7) {
        fprintf(stderr,
                "usage: warp_mesh LEFT RIGHT FX,FY,CX,CY,BASELINE_MM MESH.obj OUT_FOLDER "
                "[DEVICE_ID]\n");
        return 2;
    }
    sequence = open_sequence(argv[1], argv[2]);
    model = read_obj(argv[4]);
    if (mkdir(argv[5], 0777) != 0 && errno != EEXIST) fail("%s: cannot be made", argv[5]);
    xyz = allocate(model.vertex_count, 3 * sizeof *xyz);
    status = allocate(model.vertex_count, 1);
    expected_error_mm = allocate(model.vertex_count, sizeof *expected_error_mm);

    running = open_tracking(argv[3], &sequence.left, argc == 7 ? argv[6] : NULL, 0);

    for (i = 0; i < frame_count(&sequence); ++i) {
        defrec_result result;
        defrec_job job;
        read_frame(&sequence, i);
        job = track(&running, &sequence, timestamp_of(i), &result);
        if (result.vertex_count > 0) { /* there is a template */
            defrec_template surface;
            check(defrec_job_get_template(job, &surface), "reading the template");
            wait_for_body(surface); /* at once, but the first time */
            defrec_template_release(surface);
            check(defrec_job_warp_points(job, model.vertices, model.vertex_count, xyz, status,
                                         expected_error_mm),
                  "warping the mesh");
            write_ply(argv[5], i, &model, xyz, status, expected_error_mm);
        }
        defrec_job_release(job);
    }

    close_tracking(&running);
    free(model.vertices);
    free(model.triangles);
    free(xyz);
    free(status);
    free(expected_error_mm);
    close_sequence(&sequence);
    return 0;
}
