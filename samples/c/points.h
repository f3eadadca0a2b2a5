/* Points that are followed: pixels of the first left image, and where they are in each frame. */
#ifndef DEFREC_SAMPLES_POINTS_H
#define DEFREC_SAMPLES_POINTS_H
#include <stdio.h>

#include "tracking.h"

typedef struct {
    size_t count;
    int is_looked_up; /* on the first image, whether it showed a surface or not */
    int is_known;     /* it did, and its template is still followed */
    long* id;
    double* uv;
    uint8_t* found;  /* 1: the template has a surface there */
    double* at_rest; /* xyz, template frame */
    double* now;     /* xyz, rectified left camera of the frame */
    uint8_t* status;
    double* expected_error_mm;
} followed_points;
/* A CSV file with the columns id,u,v (px). */
followed_points read_points(const char* path);
void free_points(followed_points* points);
/* Moves them along to the frame of the job. To be called of every frame, from the first on. */
void follow(followed_points* points, const tracking* running, defrec_job job,
            const defrec_result* result);
/* A CSV file with a row for each point in each frame. */
void write_header(FILE* file);
void write_points(FILE* file, size_t frame, const followed_points* points);
#endif
