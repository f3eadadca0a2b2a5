/* defrec_c.h - the C API of defrec. C99; no other defrec header is needed.
 *
 * Rules that hold everywhere in this file
 *   versions   DEFREC_API_MAJOR changes only with an incompatible change (and with it the library's file
 *              name). Minor versions only add functions, enum values and struct fields at the end.
 *   structs    A struct whose first field is struct_size may grow: DEFREC_INIT(&s) sets the size and zeroes the
 *              rest, and zero always means "default". A struct shorter than the library's reads as if its
 *              missing fields were zero; a longer one is accepted if its unknown tail is zero. Of an output,
 *              as many bytes are written as both sides know. Structs without struct_size are frozen.
 *   errors     Functions return a defrec_status: 0 or more is success, negative is failure. On failure no
 *              output is written and nothing needs cleaning up; defrec_last_error() says what went wrong.
 *   handles    A handle keeps its parent alive, so handles may be destroyed in any order. Destroy and release
 *              functions return nothing and accept NULL. A destroyed handle is answered with
 *              DEFREC_ERROR_HANDLE where it can be recognised.
 *   strings    UTF-8, NUL-terminated.
 *   threads    "any": any thread, concurrently. "one": one thread at a time per handle; a second caller is
 *              answered with DEFREC_ERROR_BUSY. No callback may call back into defrec (DEFREC_ERROR_STATE).
 *   pixels     (0, 0) is the centre of the top-left pixel, x to the right, y down.
 *   lengths    millimetres. Cameras: x right, y down, z forward. "Rectified camera" is the left camera after
 *              rectification; "template frame" is the rectified camera of the frame that gave the template.
 *   disparity  a left pixel (x, y) matches the right pixel (x - d, y), d >= 0; depth = f * baseline / d.
 */
#ifndef DEFREC_C_H
#define DEFREC_C_H
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define DEFREC_API_MAJOR 1
#define DEFREC_API_MINOR 1

#if defined(_WIN32)
#  define DEFREC_CALL __cdecl
#  if defined(DEFREC_BUILD)
#    define DEFREC_API __declspec(dllexport)
#  else
#    define DEFREC_API __declspec(dllimport)
#  endif
#else
#  define DEFREC_CALL
#  define DEFREC_API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

typedef int32_t defrec_status;
enum {
    DEFREC_OK                  = 0,
    DEFREC_TIMEOUT             = 1,    /* a wait ended before the work did */
    DEFREC_ERROR_ARGUMENT      = -1,   /* a caller's mistake */
    DEFREC_ERROR_VERSION       = -2,   /* sizes or versions do not fit together */
    DEFREC_ERROR_UNSUPPORTED   = -3,   /* valid, but this device or build cannot */
    DEFREC_ERROR_OUT_OF_MEMORY = -4,
    DEFREC_ERROR_DEVICE_LOST   = -5,   /* destroy the tracker and open another device */
    DEFREC_ERROR_PLUGIN        = -6,   /* a plugin broke its contract, or was refused */
    DEFREC_ERROR_IO            = -7,
    DEFREC_ERROR_HANDLE        = -8,   /* not a live handle of the expected kind */
    DEFREC_ERROR_BUSY          = -9,   /* queue full, or another thread is inside this handle */
    DEFREC_ERROR_STATE         = -10,  /* not possible now: from a callback, before a template, after a fork */
    DEFREC_ERROR_INTERNAL      = -99
};

typedef struct defrec_context_  *defrec_context;
typedef struct defrec_rig_      *defrec_rig;
typedef struct defrec_tracker_  *defrec_tracker;
typedef struct defrec_template_ *defrec_template;
typedef struct defrec_job_      *defrec_job;
typedef struct defrec_stage_    *defrec_stage;
typedef struct defrec_memory_   *defrec_memory;

#define DEFREC_INIT(p) (memset((p), 0, sizeof *(p)), (void)((p)->struct_size = (uint32_t)sizeof *(p)))

/* ---- library ------------------------------------------------------------------------------------------- */

/* major * 1000 + minor of the library in use. threads: any. since: 1.0 */
DEFREC_API uint32_t DEFREC_CALL defrec_version(void);

/* The library's release, for people: "0.1.0". Static storage. threads: any. since: 1.0 */
DEFREC_API const char *DEFREC_CALL defrec_version_string(void);

/* The name of a status, "DEFREC_ERROR_ARGUMENT"; "unknown status" for others. threads: any. since: 1.0 */
DEFREC_API const char *DEFREC_CALL defrec_status_name(defrec_status status);

/* What went wrong in this thread's last failed call, one sentence: what was given, what was expected. Never NULL;
 * valid until this thread calls defrec again. threads: any. since: 1.0 */
DEFREC_API const char *DEFREC_CALL defrec_last_error(void);

/* ---- context ------------------------------------------------------------------------------------------- */

enum { DEFREC_LOG_DEBUG = 1, DEFREC_LOG_INFO = 2, DEFREC_LOG_WARNING = 3, DEFREC_LOG_ERROR = 4 };

/* level: DEFREC_LOG_*; source: "sdk" or a plugin's name. Called from any thread, must not call defrec. */
typedef void(DEFREC_CALL *defrec_log_fn)(void *user, int32_t level, const char *source, const char *text);
/* alignment is a power of two. Returns NULL when out of memory. Called from any thread. */
typedef void *(DEFREC_CALL *defrec_alloc_fn)(void *user, size_t size, size_t alignment);
typedef void(DEFREC_CALL *defrec_free_fn)(void *user, void *ptr);
/* Calls body(arg, 0..count-1), each once, on any threads, and returns when all have returned. */
typedef void(DEFREC_CALL *defrec_parallel_for_fn)(void *user, size_t count,
                                                  void(DEFREC_CALL *body)(void *arg, size_t index), void *arg);

enum {
    DEFREC_CONTEXT_ONLY_GIVEN_PLUGINS = 1u << 0, /* look nowhere but in plugin_paths */
    DEFREC_CONTEXT_USE_ENVIRONMENT    = 1u << 1  /* honour DEFREC_PLUGIN_PATH (never when privileged) */
};

typedef struct defrec_context_desc {
    uint32_t               struct_size;
    uint32_t               flags;             /* DEFREC_CONTEXT_* */
    const char *const     *plugin_paths;      /* absolute folders or manifest files, searched first */
    size_t                 plugin_path_count;
    defrec_log_fn          log;               /* NULL: no log */
    void                  *log_user;
    int32_t                log_level;         /* the lowest level reported; 0: DEFREC_LOG_INFO */
    uint32_t               threads;           /* of the library's own pool, the caller's included; 0: one per core */
    defrec_alloc_fn        alloc;             /* both or neither: maps, all memory of CPU backends, and where a device
                                                 has no page-locked memory of its own, pixels and what is read back */
    defrec_free_fn         free;
    void                  *alloc_user;
    defrec_parallel_for_fn parallel_for;      /* the application's own threads instead of the pool; may be NULL */
    void                  *parallel_for_user;
} defrec_context_desc;

/* Finds and loads the plugins. Succeeds with none found: look at defrec_plugin_get. desc may be NULL.
 * threads: any. since: 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_context_create(const defrec_context_desc *desc, defrec_context *out);
/* threads: any. since: 1.0 */
DEFREC_API void DEFREC_CALL defrec_context_destroy(defrec_context context);

typedef struct defrec_plugin_info {
    uint32_t    struct_size;
    int32_t     verdict;      /* DEFREC_OK when loaded, else why it was refused */
    const char *name;         /* strings live as long as the context */
    const char *path;
    const char *version;
    const char *reason;       /* why it was refused, one sentence; "" when loaded */
} defrec_plugin_info;
/* Every candidate that was looked at, loaded or refused, in the order of the search. 0 for a bad handle.
 * threads: any. since: 1.0 */
DEFREC_API size_t DEFREC_CALL defrec_plugin_count(defrec_context context);
DEFREC_API defrec_status DEFREC_CALL defrec_plugin_get(defrec_context context, size_t index, defrec_plugin_info *out);

enum { DEFREC_DEVICE_CPU = 1, DEFREC_DEVICE_CUDA = 2, DEFREC_DEVICE_VULKAN = 3 };
enum {
    DEFREC_STAGE_RECTIFY = 0,
    DEFREC_STAGE_STEREO  = 1,
    DEFREC_STAGE_ORB     = 2,
    DEFREC_STAGE_MATCH   = 3,
    DEFREC_STAGE_ALIGN   = 4,
    DEFREC_STAGE_RANSAC  = 5,
    DEFREC_STAGE_LM      = 6,
    DEFREC_STAGE_WARP    = 7,
    DEFREC_STAGE_COUNT_V1 = 8
};
enum {
    DEFREC_FEATURE_REPEATABLE = 1u << 0, /* the same input gives the same bits */
    DEFREC_FEATURE_SOFTWARE   = 1u << 1  /* a graphics driver that computes on the processor, slower than the CPU backend */
};

typedef struct defrec_device_info {
    uint32_t    struct_size;
    uint32_t    kind;          /* DEFREC_DEVICE_* */
    const char *id;            /* stable and unique: "cpu", "reference", "cuda:GPU-1a2b", "vulkan:10005:0000" */
    const char *name;
    const char *driver;
    uint64_t    memory_bytes;
    uint32_t    stages;        /* bit 1 << DEFREC_STAGE_* */
    uint32_t    features;      /* DEFREC_FEATURE_* */
    uint32_t    conformance;   /* version of the conformance suite passed, 0 if none */
    uint32_t    reserved;
} defrec_device_info;
/* Devices of all loaded plugins, fastest kind first (CUDA, Vulkan on a GPU, CPU, software, reference), then by id: the same
 * order in every run. threads: any. since: 1.0 */
DEFREC_API size_t DEFREC_CALL defrec_device_count(defrec_context context);
DEFREC_API defrec_status DEFREC_CALL defrec_device_get(defrec_context context, size_t index, defrec_device_info *out);

enum {
    DEFREC_MEMORY_HOST = 1,  /* the processor's memory, for devices that compute in it */
    DEFREC_MEMORY_CUDA = 2   /* memory of a CUDA device (cudaMalloc), of the process's primary context */
};

/* ---- images and rigs ----------------------------------------------------------------------------------- */

enum { DEFREC_FORMAT_GRAY8 = 1, DEFREC_FORMAT_BGR8 = 2, DEFREC_FORMAT_RGB8 = 3, DEFREC_FORMAT_BGRA8 = 4 };

enum { DEFREC_MIN_WIDTH = 64, DEFREC_MIN_HEIGHT = 48, DEFREC_MAX_SIDE = 8192 };

typedef struct defrec_image {
    uint32_t    struct_size;
    uint32_t    format;        /* DEFREC_FORMAT_* */
    uint32_t    width, height; /* px */
    uint64_t    stride;        /* bytes from row to row; 0: width * bytes per pixel, or what memory has */
    const void *pixels;        /* host memory, stride * (height - 1) + width * bytes per pixel bytes; or NULL and: */
    defrec_memory memory;      /* the pixels lie here, from its first byte: see defrec_memory_import. since: 1.1 */
} defrec_image;

typedef struct defrec_intrinsics { /* frozen */
    double   fx, fy, cx, cy;       /* px */
    double   distortion[14];       /* OpenCV's order: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tx ty */
    uint32_t distortion_count;     /* 0, 4, 5, 8, 12 or 14 */
    uint32_t reserved;
} defrec_intrinsics;

typedef struct defrec_rig_desc {
    uint32_t          struct_size;
    uint32_t          flags;         /* 0 */
    uint32_t          width, height; /* of the raw images, px */
    defrec_intrinsics left, right;
    double            rotation[9];   /* x_right = rotation * x_left + translation; row-major */
    double            translation[3];/* mm; x < 0 for a right camera on the right */
} defrec_rig_desc;

typedef struct defrec_camera { double fx, fy, cx, cy, baseline_mm; } defrec_camera; /* frozen */

/* Checks the calibration (finite, focal lengths > 0, a rotation, a horizontal baseline, monotone distortion) and computes the
 * rectification (Bouguet's, as OpenCV's stereoRectify: half the rotation to each eye, then x along the baseline).
 * Cameras that are rectified already (no distortion, rotation = I, same intrinsics, translation along x) are used
 * as they are, without resampling. threads: any. since: 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_rig_create(defrec_context context, const defrec_rig_desc *desc, defrec_rig *out);
/* threads: any. since: 1.0 */
DEFREC_API void DEFREC_CALL defrec_rig_destroy(defrec_rig rig);

typedef struct defrec_rig_info {
    uint32_t      struct_size;
    uint32_t      identity;      /* 1: frames are rectified already and not resampled */
    uint32_t      width, height; /* of the rectified images, px */
    defrec_camera camera;        /* of the rectified images */
    double        rotation[9];   /* x_rectified = rotation * x_left_raw; row-major */
} defrec_rig_info;
/* threads: any. since: 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_rig_get(defrec_rig rig, defrec_rig_info *out);
/* Maps count pixels (u, v) of the raw left image to the rectified left image, or back; NaN where there is no answer.
 * in and out may be the same.
 * threads: any. since: 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_rig_rectify_pixels(defrec_rig rig, const double *raw_uv, size_t count, double *rectified_uv);
DEFREC_API defrec_status DEFREC_CALL defrec_rig_distort_pixels(defrec_rig rig, const double *rectified_uv, size_t count, double *raw_uv);

/* ---- stages: records --------------------------------------------------------------------------------- */
/* Records are frozen and lie in arrays without padding; floats are IEEE single. docs/stages.md defines each stage. */

enum { DEFREC_DISPARITY_ONE = 16 };          /* disparities are int16 in 1/16 px */
enum { DEFREC_DISPARITY_NONE = -32768 };     /* no evidence at this pixel */
enum { DEFREC_ORB_ANGLE_BINS = 32 };         /* orientation bin k is the angle k * 2 pi / 32 from x towards y */
enum { DEFREC_SKIN_NODES = 4 };              /* control points that move one surface point */

typedef struct defrec_feature { /* 48 bytes */
    int32_t  x, y;              /* in the image, 1/16 px */
    uint16_t level, angle;      /* pyramid level; orientation bin */
    uint32_t score;             /* corner score, larger is stronger */
    uint32_t descriptor[8];     /* bit i is bit i % 32 of word i / 32 */
} defrec_feature;

typedef struct defrec_landmark { /* 48 bytes: a feature of the template */
    uint32_t descriptor[8];
    float    position[3];        /* template frame, mm */
    uint32_t reserved;
} defrec_landmark;

typedef struct defrec_match {    /* 40 bytes: one for each landmark */
    int32_t feature;             /* index of the live feature, -1: none */
    int32_t distance, second;    /* Hamming distance to it and to the second best at another place, 0..256 */
    float   u, v;                /* the live feature's pixel */
    float   position[3];         /* the live feature in the rectified camera, mm; 0 0 0 where depth is unknown */
    float   weight;              /* 0..1 after preselection (stage ransac), before it 1 for a match with depth */
    uint32_t reserved;
} defrec_match;

typedef struct defrec_surface_point { /* 56 bytes: a point that control points move */
    float   position[3];         /* template frame, mm */
    float   normal[3];           /* unit length, towards the camera */
    int32_t node[DEFREC_SKIN_NODES];   /* control points; unused entries repeat one, with weight 0 */
    float   weight[DEFREC_SKIN_NODES]; /* sum 1 */
} defrec_surface_point;

typedef struct defrec_patch {    /* 88 bytes: a piece of the template's image that is searched in each frame */
    float   u, v;                /* its centre in the view it was taken from, px */
    int32_t view;                /* which view */
    uint32_t reserved;
    float   position[3];         /* template frame, mm */
    float   tangent_u[3];        /* how position moves, mm, for one pixel to the right in the view, along the surface */
    float   tangent_v[3];        /* likewise for one pixel down */
    int32_t node[DEFREC_SKIN_NODES];
    float   weight[DEFREC_SKIN_NODES];
    uint32_t reserved2;
} defrec_patch;

typedef struct defrec_patch_prediction { /* 32 bytes */
    int32_t u, v;                /* predicted centre in the live image, 1/256 px */
    int32_t view_from_live[4];   /* 2x2 row-major, 1/65536: offset in the view = matrix * offset in the live image */
    int32_t valid;               /* 1: inside the image, facing the camera, not stretched out of all proportion */
    int32_t reserved;
} defrec_patch_prediction;

typedef struct defrec_patch_observation { /* 32 bytes */
    int32_t u, v;                /* where it was found, 1/256 px */
    int32_t score;               /* ZNCC, 1/4096 */
    int32_t valid;               /* 1: found */
    float   information[3];      /* uu, uv, vv: curvature of the score at the peak, per px^2; 0 along a direction without texture */
    uint32_t reserved;
} defrec_patch_observation;

typedef struct defrec_motion {   /* 32 bytes: a unit dual quaternion, a rigid motion x -> R x + t */
    float real[4];               /* w x y z */
    float dual[4];               /* w x y z: 0.5 * t * real */
} defrec_motion;

typedef struct defrec_edge {     /* 12 bytes: a connection between control points */
    int32_t a, b;                /* a < b */
    float   weight;              /* > 0 */
} defrec_edge;

enum {                           /* what a frame says of a surface point */
    DEFREC_OBSERVED      = 0,    /* the live surface lies where the point is */
    DEFREC_NO_DEPTH      = 1,    /* no disparity there */
    DEFREC_OCCLUDED      = 2,    /* the live surface lies in front of it */
    DEFREC_OUTSIDE       = 3,    /* outside the image, or behind the camera */
    DEFREC_INCONSISTENT  = 4     /* the live surface lies behind it, or it faces away */
};
typedef struct defrec_surface_sample { /* 32 bytes */
    float    position[3];        /* rectified camera, mm */
    float    normal[3];
    float    residual;           /* live depth minus the point's depth, mm; 0 without depth */
    uint32_t observation;        /* DEFREC_OBSERVED ... */
} defrec_surface_sample;

typedef struct defrec_ransac_summary { /* 64 bytes */
    int32_t valid_matches;       /* matches with depth */
    int32_t references;          /* accepted references */
    int32_t inliers;             /* matches with weight > 0.5 after merging */
    int32_t best_support;        /* matches within H of the best reference's rigid motion */
    float   rotation[9];         /* of the best reference: x_live = rotation * x_template + translation */
    float   translation[3];
} defrec_ransac_summary;

typedef struct defrec_lm_summary { /* 64 bytes */
    float    initial_cost, final_cost;
    float    icp_cost, match_cost, patch_cost, arap_cost; /* of the final state, weighted */
    int32_t  iterations;         /* taken */
    int32_t  icp_points, matches, patches; /* residuals with weight > 0 in the final state */
    float    icp_rms, match_rms, patch_rms; /* mm, mm, px; weighted root mean squares */
    float    damping;            /* the last lambda */
    int32_t  failed;             /* 1: a system could not be solved and the motions are those given */
    uint32_t reserved;
} defrec_lm_summary;

/* ---- stages: parameters -------------------------------------------------------------------------------- */
/* Zero means default wherever the default is named. A plugin gets parameters with every default filled in. */

typedef struct defrec_rectify_params {
    uint32_t struct_size;
    uint32_t format;             /* DEFREC_FORMAT_* of the source */
    uint32_t source_width, source_height;
    uint32_t source_stride;      /* bytes; default: width * bytes per pixel */
    uint32_t width, height;      /* of the result; default: the source's */
    uint32_t stride;             /* of the result, bytes; default: width */
    uint32_t saturation;         /* gray values from here on count as highlights and are masked; default 235, 256: none */
    uint32_t highlight_radius;   /* px (Chebyshev) that the mask grows round highlights, at most 16; default 4 */
} defrec_rectify_params;

typedef struct defrec_stereo_params {
    uint32_t struct_size;
    uint32_t width, height, stride; /* of gray images and masks, width and height at least 2; stride in bytes, default: width */
    int32_t  min_disparity;      /* px, >= 0 */
    uint32_t disparities;        /* number searched, at most 510; default 128 */
    uint32_t radius;             /* of the correlation window of the search, px of half resolution, 2 to 6; default 4 */
    uint32_t refine_radius;      /* of the correlation window at full resolution, px, 2 to 6; default 4 */
    uint32_t min_score;          /* ZNCC of the search below this is no evidence, 1/4096; default 1600 (0.39) */
    uint32_t refine_score;       /* ZNCC at full resolution that a pixel needs which the search left open, 1/4096; default 2000 (0.49) */
    uint32_t uniqueness;         /* lead of the best score over any other that is not close to it, 1/4096; default 40 (0.01) */
    uint32_t texture;            /* least standard deviation of gray in the window, 1/16 gray level; default 8 */
    uint32_t left_right;         /* largest difference between left and right winner, px of half resolution; default 1 */
    uint32_t edge;               /* a range of disparities in a neighbourhood above this is a depth edge, 1/16 px of half resolution; default 24 */
    uint32_t support;            /* of 25 neighbours, how many must agree with a disparity, itself included; default 10 */
    uint32_t fill_radius;        /* px, at most 8; holes up to about this radius are filled from their rim; default 6 */
    uint32_t smooth_radius;      /* px, at most 3; of the smoothing window; default 3 */
    uint32_t smooth_range;       /* neighbours that differ by more are another surface, 1/16 px, at most 256; default 24 */
    uint32_t smooth_passes;      /* at most 8; default 4 */
} defrec_stereo_params;

typedef struct defrec_orb_params {
    uint32_t struct_size;
    uint32_t width, height, stride; /* of gray image and mask; stride in bytes, default: width */
    uint32_t levels;             /* of the pyramid, each 4/5 of the one below; 1..8, default 4 */
    uint32_t cell;               /* one corner at most for each cell of this side, px of its level; 4..16, default 8 */
    uint32_t threshold;          /* FAST threshold, gray levels; 1..254, default 3 */
    uint32_t capacity;           /* most features; 1..65535, default 2048 */
    uint32_t spacing;            /* least distance between features of one level, px of the level; 1..63, default 4;
                                    grows until the features fit the capacity */
} defrec_orb_params;

typedef struct defrec_match_params {
    uint32_t      struct_size;
    uint32_t      landmarks;     /* most landmarks; 1..65535 */
    uint32_t      features;      /* most live features; 1..65535 */
    uint32_t      max_distance;  /* largest Hamming distance of a match; 1..256, default 64 */
    uint32_t      ratio;         /* most best / second best, 1/256; 1..256, default 218 (0.85); 256: no ratio test */
    uint32_t      width, height, stride; /* of the disparity image; stride in elements, default: width */
    defrec_camera camera;
} defrec_match_params;

typedef struct defrec_align_params {
    uint32_t      struct_size;
    uint32_t      patches;       /* most patches */
    uint32_t      nodes;         /* exact count of control points */
    uint32_t      views;         /* images patches are taken from; default 1 */
    uint32_t      width, height, stride; /* of the live image, the mask and each view; stride in bytes, default: width */
    uint32_t      level;         /* search on images halved this many times; 0 to 3, default 0 */
    uint32_t      patch_radius;  /* px of that level, 1 to 7; default 5 */
    uint32_t      search_radius; /* px of that level, 1 to 16; default 4; found is what lies less far away than this */
    uint32_t      min_score;     /* ZNCC, 1/4096; default 2867 (0.7) */
    uint32_t      texture;       /* least standard deviation of the patch, 1/16 gray level; default 16 */
    defrec_camera camera;
} defrec_align_params;

typedef struct defrec_ransac_params {
    uint32_t struct_size;
    uint32_t landmarks;          /* most landmarks */
    uint32_t references;         /* 1 to 1024; default 30 */
    uint32_t iterations;         /* 1 to 100; default 10 */
    float    threshold_mm;       /* the paper's H; default: a tenth of the RMS radius of each frame's live points, at least 1 mm */
    uint32_t min_support;        /* matches within H that a reference needs, itself included; default 6; 1/32 of all matches is added */
    uint64_t seed;
} defrec_ransac_params;

enum { DEFREC_SOLVER_COUPLED = 1, DEFREC_SOLVER_INDEPENDENT = 2 };
typedef struct defrec_lm_params {
    uint32_t      struct_size;
    uint32_t      solver;        /* DEFREC_SOLVER_*; default coupled: conjugate gradients over all control points; independent is the paper's */
    uint32_t      nodes, edges, points, landmarks, patches; /* exact counts, as given to prepare */
    uint32_t      width, height, stride; /* of the disparity image; stride in elements, default: width */
    defrec_camera camera;
    uint32_t      iterations;    /* default 10 */
    uint32_t      cg_iterations; /* most conjugate gradient steps in one iteration; default 20 */
    uint32_t      presolve;      /* 1: first move everything rigidly onto the weighted matches */
    float         node_spacing_mm; /* typical; lengths in the ARAP term are divided by it; default 5 */
    float         icp_weight, match_weight, patch_weight, arap_weight;      /* default 1, 10, 10, 1 */
    float         length_weight, angle_weight, rotation_weight;             /* default 1, 20, 100 */
    float         icp_tukey_mm, match_tukey_mm, patch_tukey_px;             /* default 3, 5, 4 */
    float         association_mm;  /* live surface farther than this along the ray is another surface; default 10 */
    float         damping;         /* first lambda; default 1e-3 */
    float         match_threshold_mm; /* H in the weight 1 - d / (5 H) of matches that preselection left at 0; default 2 */
} defrec_lm_params;

typedef struct defrec_warp_params {
    uint32_t      struct_size;
    uint32_t      nodes, points;   /* exact counts, as given to prepare */
    uint32_t      width, height, stride; /* of the disparity image; stride in elements, default: width */
    uint32_t      reserved;
    defrec_camera camera;
    float         tolerance_mm;    /* live depth within this of the point's is an observation; default 2 */
} defrec_warp_params;

/* ---- stages on their own ------------------------------------------------------------------------------- */

typedef struct defrec_buffer { void *data; uint64_t size; } defrec_buffer;             /* frozen; host memory, size in bytes */
typedef struct defrec_const_buffer { const void *data; uint64_t size; } defrec_const_buffer; /* frozen */

/* Creates one stage on one device. params: the stage's defrec_*_params. device_id NULL: the first device that offers
 * the stage. threads: any. since: 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_stage_create(defrec_context context, const char *device_id, uint32_t stage,
                                                         const void *params, defrec_stage *out);
/* threads: any. since: 1.0 */
DEFREC_API void DEFREC_CALL defrec_stage_destroy(defrec_stage stage);
/* Gives a stage the inputs that stay the same from run to run (a template); match, align, lm and warp need it
 * before their first run. Which buffers, in which order and of which sizes: docs/stages.md. threads: one. since: 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_stage_prepare(defrec_stage stage, const defrec_const_buffer *in, size_t in_count);
/* Runs it and waits. An optional buffer that is not given has data NULL and size 0. A buffer that is too small is an
 * argument error whose text names the size needed. threads: one. since: 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_stage_run(defrec_stage stage, const defrec_const_buffer *in, size_t in_count,
                                                      const defrec_buffer *out, size_t out_count);

/* ---- tracking ------------------------------------------------------------------------------------------ */

typedef struct defrec_tracker_desc {
    uint32_t    struct_size;
    uint32_t    flags;                 /* 0 */
    const char *device_id;             /* NULL: the first device with every stage */
    uint64_t    seed;
    uint32_t    format;                /* DEFREC_FORMAT_* of the frames; default BGR8 */
    uint32_t    frames_in_flight;      /* submitted and not yet released; default 2, most 16 */
    uint32_t    disparities;           /* most searched, px; default: found from the first frame */
    int32_t     min_disparity;         /* px; used with disparities */
    float       min_depth_mm;          /* nearest surface expected; default 20 */
    float       node_spacing_px;       /* between control points in the template's image; default: width / 24 */
    float       vertex_spacing_px;     /* between template vertices; default: width / 120, at least 4 */
    uint32_t    max_features;          /* default 1024 */
    uint32_t    max_patches;           /* default 1024 */
    float       arap_weight;           /* of the smoothness term; default 0.2 */
    uint32_t    keep_disparity;        /* 1: results carry the disparity image */
    uint32_t    coarse_iterations, fine_iterations; /* of Levenberg-Marquardt; default 3, 3 */
    uint32_t    timed;                 /* 1: the host waits after each stage, so that the times of results are the device's; slower.
                                          Otherwise they are those of queueing where a device computes by itself */
    uint32_t    memory_stride;         /* of left and right images in a defrec_memory, bytes; default: width * bytes per pixel. since: 1.1 */
} defrec_tracker_desc;

/* Opens the device and allocates everything that a frame needs; afterwards no frame allocates, but those that capture a template.
 * threads: any. since: 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_tracker_create(defrec_context context, defrec_rig rig, const defrec_tracker_desc *desc,
                                                           defrec_tracker *out);
/* Waits for the frame being computed; frames still queued end with DEFREC_ERROR_STATE. Jobs stay valid until
 * released. threads: any. since: 1.0 */
DEFREC_API void DEFREC_CALL defrec_tracker_destroy(defrec_tracker tracker);

typedef struct defrec_memory_desc {
    uint32_t struct_size;
    uint32_t kind;             /* DEFREC_MEMORY_* */
    void    *address;          /* of that kind, a multiple of 16 */
    uint64_t size;             /* bytes */
} defrec_memory_desc;

/* Lets this tracker's device work in the caller's memory, without a copy. The memory stays the caller's, and must outlive the handle and
 * every job that was given it. What the device cannot reach is DEFREC_ERROR_UNSUPPORTED. Import once what frames use in turn: it
 * allocates. threads: any. since: 1.1 */
DEFREC_API defrec_status DEFREC_CALL defrec_memory_import(defrec_tracker tracker, const defrec_memory_desc *desc, defrec_memory *out);
/* Frames that were submitted with it are computed all the same. threads: any. since: 1.1 */
DEFREC_API void DEFREC_CALL defrec_memory_release(defrec_memory memory);

enum { DEFREC_FRAME_CAPTURE_TEMPLATE = 1u << 0 }; /* make this frame the template (the first usable frame is, unless one was set) */

typedef struct defrec_frame {
    uint32_t            struct_size;
    uint32_t            flags;         /* DEFREC_FRAME_* */
    int64_t             timestamp_ns;  /* strictly growing */
    const defrec_image *left, *right;  /* the rig's size, the tracker's format */
    const defrec_image *ignore;        /* GRAY8, the rig's size: nonzero pixels of the left image are not tissue; NULL: none */
    defrec_memory       samples;       /* NULL, or where the device leaves a defrec_surface_sample per template vertex, those behind the
                                          result's vertices and normals; too small is how the job fails. since: 1.1 */
} defrec_frame;

/* Queues a frame; jobs of one tracker run in order. Host pixels are copied before it returns. Pixels in a defrec_memory are complete when
 * it is called and stay as they are until the job is done. A full queue is DEFREC_ERROR_BUSY; a timestamp that does not grow is
 * DEFREC_ERROR_ARGUMENT. threads: one. since: 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_tracker_submit(defrec_tracker tracker, const defrec_frame *frame, defrec_job *out);

/* DEFREC_OK: done. DEFREC_TIMEOUT: not yet. Negative: how the job failed. UINT64_MAX waits for ever. threads: any. since: 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_job_wait(defrec_job job, uint64_t timeout_ns);
/* Gives the job's place in the queue back; waits if it is running. threads: any. since: 1.0 */
DEFREC_API void DEFREC_CALL defrec_job_release(defrec_job job);

enum {                                 /* state of a frame */
    DEFREC_INITIALISING = 0,           /* no template yet */
    DEFREC_TRACKING     = 1,
    DEFREC_DEGRADED     = 2,           /* followed, with less evidence than usual: see reasons */
    DEFREC_LOST         = 3,           /* geometry is the last known and not to be believed */
    DEFREC_RELOCALISED  = 4            /* found again in this frame; a new epoch */
};
enum {                                 /* reasons, a mask */
    DEFREC_REASON_DARK            = 1u << 0,  /* left or right image black */
    DEFREC_REASON_SATURATED       = 1u << 1,
    DEFREC_REASON_NO_TEXTURE      = 1u << 2,
    DEFREC_REASON_FEW_MATCHES     = 1u << 3,
    DEFREC_REASON_OCCLUDED        = 1u << 4,
    DEFREC_REASON_LARGE_RESIDUAL  = 1u << 5,
    DEFREC_REASON_FAST_MOTION     = 1u << 6,
    DEFREC_REASON_OUT_OF_VIEW     = 1u << 7,
    DEFREC_REASON_NO_DEPTH        = 1u << 8,
    DEFREC_REASON_ONE_EYE         = 1u << 9,  /* the eyes do not match each other */
    DEFREC_REASON_FROZEN          = 1u << 10, /* the same pixels as the frame before */
    DEFREC_REASON_GAP             = 1u << 11, /* time since the last frame is more than twice the usual */
    DEFREC_REASON_EYES_SWAPPED    = 1u << 12,
    DEFREC_REASON_LOW_CONTRAST    = 1u << 13  /* smoke, blur, a wet lens */
};
enum {                                 /* status of a vertex or point */
    DEFREC_POINT_OBSERVED     = 0,
    DEFREC_POINT_EXTRAPOLATED = 1,     /* from its neighbourhood: occluded, outside or without depth */
    DEFREC_POINT_UNKNOWN      = 2      /* not to be believed: the frame is lost, or nothing near it was seen for long */
};
enum { DEFREC_MAX_TIMED_STAGES = 16 };
typedef struct defrec_stage_time { const char *name; double milliseconds; } defrec_stage_time; /* frozen */

typedef struct defrec_result {
    uint32_t               struct_size;
    uint32_t               state;            /* DEFREC_INITIALISING ... */
    uint32_t               reasons;          /* DEFREC_REASON_* */
    uint32_t               epoch;            /* counts templates and relocalisations */
    int64_t                timestamp_ns;
    uint64_t               frame;            /* counts submitted frames from 0 */
    uint32_t               age;              /* frames since the geometry was last supported by evidence */
    uint32_t               features;         /* found in the left image */
    uint32_t               matches;          /* of them matched to landmarks, with depth */
    uint32_t               inliers;          /* of them preselected */
    uint32_t               patches;          /* found by guided search */
    float                  observed_share;   /* 0..1 of the vertices inside the image */
    float                  mean_residual_mm; /* mean |depth residual| of observed vertices */
    float                  patch_residual_px;/* RMS distance between found and deformed patches */
    double                 rigid_motion[12]; /* rectified camera from template frame, 3x4 row-major: best rigid fit of all vertices */
    /* The pointers below live until the job is released; counts are 0 without a template. */
    const defrec_motion   *motions;          /* per control point, rectified camera from template frame */
    const float           *node_positions;   /* xyz per control point, now */
    uint64_t               node_count;
    const float           *vertices;         /* xyz per template vertex, rectified camera */
    const float           *normals;
    const uint8_t         *vertex_status;    /* DEFREC_POINT_* */
    const float           *expected_error_mm;/* one standard deviation */
    uint64_t               vertex_count;
    const defrec_landmark *landmarks;        /* of the template */
    const defrec_match    *landmark_matches; /* one per landmark; weight 0: outlier */
    uint64_t               landmark_count;
    const defrec_patch_observation *patch_observations; /* one per template patch */
    uint64_t               patch_count;
    const int16_t         *disparity;        /* width * height of the rectified image, or NULL: see keep_disparity */
    defrec_stage_time      times[DEFREC_MAX_TIMED_STAGES]; /* in order of execution */
    uint32_t               time_count;
    uint32_t               reserved;
} defrec_result;
/* After defrec_job_wait gave DEFREC_OK. threads: any. since: 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_job_result(defrec_job job, defrec_result *out);

/* Moves count points xyz, mm, given in the template frame (on or near the surface: a preoperative model, say) to the
 * frame of this job. status (DEFREC_POINT_*) and expected_error_mm may be NULL. threads: any. since: 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_job_warp_points(defrec_job job, const double *template_xyz, size_t count, double *xyz,
                                                            uint8_t *status, double *expected_error_mm);

/* ---- templates ----------------------------------------------------------------------------------------- */

/* The tracker's present template. DEFREC_ERROR_STATE before there is one. threads: any. since: 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_tracker_get_template(defrec_tracker tracker, defrec_template *out);
/* Tracks this template from the next submitted frame on; the rig must have the same rectified camera and size.
 * threads: one. since: 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_tracker_set_template(defrec_tracker tracker, defrec_template surface);
/* threads: any. since: 1.0 */
DEFREC_API void DEFREC_CALL defrec_template_release(defrec_template surface);

typedef struct defrec_template_info {
    uint32_t                    struct_size;
    uint32_t                    width, height;   /* of the rectified image it was taken from */
    uint32_t                    reserved;
    defrec_camera               camera;
    /* The pointers live as long as the handle. */
    const defrec_surface_point *vertices;
    uint64_t                    vertex_count;
    const uint32_t             *triangles;       /* three vertex indices each, counter-clockwise seen from the camera */
    uint64_t                    triangle_count;
    const float                *nodes;           /* xyz per control point, template frame */
    uint64_t                    node_count;
    const defrec_edge          *edges;
    uint64_t                    edge_count;
    const defrec_landmark      *landmarks;
    uint64_t                    landmark_count;
    const defrec_patch         *patches;
    uint64_t                    patch_count;
    const uint8_t              *image;           /* width * height gray values of the rectified left image */
} defrec_template_info;
DEFREC_API defrec_status DEFREC_CALL defrec_template_get(defrec_template surface, defrec_template_info *out);

/* Finds the surface points under count pixels (u, v) of the rectified left image that gave the template: xyz, mm, template frame.
 * found (1 or 0) per pixel: 0 where the template has no surface, xyz is then 0. threads: any. since: 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_template_lift(defrec_template surface, const double *uv, size_t count, double *xyz,
                                                          uint8_t *found);

/* A file holds one template, its layout is versioned and checked on loading. threads: any. since: 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_template_save(defrec_template surface, const char *path);
DEFREC_API defrec_status DEFREC_CALL defrec_template_load(defrec_context context, const char *path, defrec_template *out);

#ifdef __cplusplus
}
#endif
#endif
