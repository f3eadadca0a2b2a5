/* A triangle mesh and its file: what the samples with a preoperative model share. */
#ifndef DEFREC_SAMPLES_MESH_H
#define DEFREC_SAMPLES_MESH_H
#include <stddef.h>
#include <stdint.h>

typedef struct {
    size_t vertex_count, triangle_count;
    double* vertices;    /* xyz */
    uint32_t* triangles; /* three indices from 0 */
} mesh;

/* Zeros; ends the program where there is no memory. */
void* allocate(size_t count, size_t size);
/* The lines "v X Y Z" and "f A B C" of an OBJ file. */
mesh read_obj(const char* path);
#endif
