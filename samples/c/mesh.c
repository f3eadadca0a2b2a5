/* See mesh.h. */
#include "mesh.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "input.h"

void* allocate(size_t count, size_t size) {
    void* memory = calloc(count, size);
    if (memory == NULL) fail("out of memory");
    return memory;
}

mesh read_obj(const char* path) {
    mesh model = {0, 0, NULL, NULL};
    char line[256];
    size_t i;
    FILE* file = fopen(path, "r");
    if (file == NULL) fail("%s: cannot be read", path);
    while (fgets(line, sizeof line, file) != NULL) {
        model.vertex_count += strncmp(line, "v ", 2) == 0;
        model.triangle_count += strncmp(line, "f ", 2) == 0;
    }
    if (model.vertex_count == 0) fail("%s: has no vertices", path);
    model.vertices = allocate(model.vertex_count, 3 * sizeof *model.vertices);
    model.triangles = allocate(model.triangle_count + 1, 3 * sizeof *model.triangles);
    rewind(file);
    model.vertex_count = model.triangle_count = 0;
    while (fgets(line, sizeof line, file) != NULL) {
        double* v = model.vertices + 3 * model.vertex_count;
        uint32_t* f = model.triangles + 3 * model.triangle_count;
        char rest;
        line[strcspn(line, "\r\n")] = '\0';
        if (strncmp(line, "v ", 2) == 0) {
            if (sscanf(line, "v %lf %lf %lf %c", &v[0], &v[1], &v[2], &rest) != 3)
                fail("%s: \"v X Y Z\" expected, found \"%s\"", path, line);
            ++model.vertex_count;
        } else if (strncmp(line, "f ", 2) == 0) {
            if (sscanf(line, "f %u %u %u %c", &f[0], &f[1], &f[2], &rest) != 3)
                fail("%s: \"f A B C\" expected, found \"%s\"", path, line);
            ++model.triangle_count;
        }
    }
    fclose(file);
    for (i = 0; i < 3 * model.triangle_count; ++i)
        if (model.triangles[i]-- == 0 || model.triangles[i] >= model.vertex_count)
            fail("%s: a triangle names a vertex that is not there", path);
    return model;
}
