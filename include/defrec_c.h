/** @file
 *  The C API of defrec. C99; no other defrec header is needed. Rules that hold everywhere in this
 *  file:
 *
 *  - **Versions.** DEFREC_API_MAJOR changes only with an incompatible change (and with it the
 *    library's file name). Minor versions only add functions, enum values and struct fields at the
 *    end. So take a negative status that you do not know for a failure, a state that you do not
 *    know for DEFREC_LOST, and pass over flags and reasons that you do not know.
 *  - **Structs.** A struct whose first field is struct_size may grow: `DEFREC_INIT(&s)` sets the
 *    size and zeroes the rest, and zero always means "default". A struct shorter than the library's
 *    reads as if its missing fields were zero; a longer one is accepted if its unknown tail is
 *    zero. An output is written as far as both sides know it. Structs without struct_size are
 *    frozen.
 *  - **Errors.** Functions return a defrec_status: 0 or more is success, negative is failure. On
 *    failure no output is written and nothing needs cleaning up; defrec_last_error() says what went
 *    wrong. "errors" names what a function gives beside these, which any may give:
 *    DEFREC_ERROR_ARGUMENT for NULL where something is expected, DEFREC_ERROR_VERSION for a
 *    struct_size that does not fit, DEFREC_ERROR_HANDLE, DEFREC_ERROR_STATE from a callback, after
 *    a fork, or where the application's parallel_for left a body out, DEFREC_ERROR_OUT_OF_MEMORY,
 *    DEFREC_ERROR_INTERNAL.
 *  - **Handles.** A handle keeps its parent alive, so handles may be destroyed in any order.
 *    Destroy and release functions return nothing and accept NULL. A destroyed handle is answered
 *    with DEFREC_ERROR_HANDLE where it can be recognised.
 *  - **Outputs.** `out` receives the result; a new handle is the caller's to destroy. A count of 0
 *    with NULL is fine.
 *  - **Strings.** UTF-8, NUL-terminated.
 *  - **Threads.** "any": any thread, concurrently. "one": one thread at a time per handle; a second
 *    caller is answered with DEFREC_ERROR_BUSY. No callback may call back into defrec
 *    (DEFREC_ERROR_STATE).
 *  - **Pixels.** (0, 0) is the centre of the top-left pixel, x to the right, y down.
 *  - **Lengths.** Millimetres. Cameras: x right, y down, z forward. "Rectified camera" is the left
 *    camera after rectification; "template frame" is the rectified camera of the frame that gave
 *    the template.
 *  - **Disparity.** A left pixel (x, y) matches the right pixel (x - d, y), d >= 0; depth = f *
 *    baseline / (d + offset), with the camera's disparity offset.
 */
#ifndef DEFREC_C_H
#define DEFREC_C_H
#include <stddef.h>
#include <stdint.h>
#include <string.h>

/** @defgroup library Library, statuses and handles
 *  @{ */

#define DEFREC_API_MAJOR 1 /**< this header's; a library of another major version has another file
                                name */
#define DEFREC_API_MINOR 0 /**< this header's */

/** @def DEFREC_CALL
 *  The calling convention of every function. */
/** @def DEFREC_API
 *  Imports a function. DEFREC_BUILD is defined while the library itself is built. */
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

typedef int32_t defrec_status; /**< what every call answers: DEFREC_OK, DEFREC_TIMEOUT or a
                                    DEFREC_ERROR_* */
/** Values of defrec_status. */
enum {
    DEFREC_OK                  = 0,   /**< done */
    DEFREC_TIMEOUT             = 1,   /**< a wait ended before the work did */
    DEFREC_ERROR_ARGUMENT      = -1,  /**< a caller's mistake */
    DEFREC_ERROR_VERSION       = -2,  /**< sizes or versions do not fit together */
    DEFREC_ERROR_UNSUPPORTED   = -3,  /**< valid, but this device or build cannot */
    DEFREC_ERROR_OUT_OF_MEMORY = -4,  /**< memory of the process or of the device is used up */
    DEFREC_ERROR_DEVICE_LOST   = -5,  /**< gone, or did not answer in time: destroy the tracker and
                                           open another device */
    DEFREC_ERROR_PLUGIN        = -6,  /**< a plugin broke its contract, or was refused */
    DEFREC_ERROR_IO            = -7,  /**< a file cannot be read or written, or is damaged */
    DEFREC_ERROR_HANDLE        = -8,  /**< not a live handle of the expected kind */
    DEFREC_ERROR_BUSY          = -9,  /**< queue full, or another thread is inside this handle */
    DEFREC_ERROR_STATE         = -10, /**< not possible now: from a callback, before a template,
                                           after a fork */
    DEFREC_ERROR_INTERNAL      = -99  /**< a fault of the library; please report it with the error
                                           message */
};

typedef struct defrec_context_  *defrec_context;  /**< loaded plugins, their devices, threads and
                                                       memory: defrec_context_create() */
typedef struct defrec_rig_      *defrec_rig;      /**< two calibrated cameras:
                                                       defrec_rig_create() */
typedef struct defrec_tracker_  *defrec_tracker;  /**< follows one surface on one device:
                                                       defrec_tracker_create() */
typedef struct defrec_template_ *defrec_template; /**< the surface that is followed:
                                                       defrec_tracker_get_template() */
typedef struct defrec_job_      *defrec_job;      /**< a submitted frame, then its result:
                                                       defrec_tracker_submit() */
typedef struct defrec_stage_    *defrec_stage;    /**< one stage on its own:
                                                       defrec_stage_create() */
typedef struct defrec_memory_   *defrec_memory;   /**< the caller's memory, known to a tracker:
                                                       defrec_memory_import() */
typedef struct defrec_targets_  *defrec_targets;  /**< points of a plan, prepared for a template:
                                                       defrec_targets_create() */

typedef struct defrec_registration_ *defrec_registration; /**< where a preoperative model lies:
                                                               defrec_registration_from_surface()
                                                               and those beside it */
typedef struct defrec_hand_eye_     *defrec_hand_eye;     /**< where a camera is on the marker that
                                                               a navigation system sees:
                                                               defrec_hand_eye_create() */
typedef struct defrec_plan_         *defrec_plan;         /**< a registered model and its targets,
                                                               for one template:
                                                               defrec_plan_create() */
typedef struct defrec_predictor_    *defrec_predictor;    /**< where points are when they are shown:
                                                               defrec_predictor_create() */

/** Makes *p all default: zero, with struct_size set. */
#define DEFREC_INIT(p) \
  (memset((p), 0, sizeof *(p)), (void)((p)->struct_size = (uint32_t)sizeof *(p)))

/** major * 1000 + minor of the library in use.
 *  @threads any @since 1.0 */
DEFREC_API uint32_t DEFREC_CALL defrec_version(void);

/** The library's release, for people: "0.1.0". Static storage.
 *  @threads any @since 1.0 */
DEFREC_API const char *DEFREC_CALL defrec_version_string(void);

/** The name of a status, "DEFREC_ERROR_ARGUMENT"; "unknown status" for others. Static storage.
 *  @threads any @since 1.0 */
DEFREC_API const char *DEFREC_CALL defrec_status_name(defrec_status status);

/** What went wrong in this thread's last failed call, an error message: what was given, what was
 *  expected. Never NULL, "" before the first failure; calls that succeed leave it. Valid until this
 *  thread calls defrec again.
 *  @threads any @since 1.0 */
DEFREC_API const char *DEFREC_CALL defrec_last_error(void);

/** @} */
/** @defgroup context Contexts, plugins and devices
 *  @{ */

/** How much a message of the log matters. */
enum {
    DEFREC_LOG_DEBUG   = 1, /**< for those who develop defrec or a plugin */
    DEFREC_LOG_INFO    = 2, /**< what was found, loaded and chosen */
    DEFREC_LOG_WARNING = 3, /**< something was refused or left out, and work goes on */
    DEFREC_LOG_ERROR   = 4  /**< something failed */
};

/** Receives the log. level: DEFREC_LOG_*; source: "sdk" or a plugin's name; text lives as long as
 *  the call. Called from any thread, must not call defrec. */
typedef void(DEFREC_CALL *defrec_log_fn)(
    void *user, int32_t level, const char *source, const char *text);
/** Gives size bytes at a multiple of alignment, a power of two, or NULL when out of memory. Called
 *  from any thread. */
typedef void *(DEFREC_CALL *defrec_alloc_fn)(void *user, size_t size, size_t alignment);
/** Takes back what the defrec_alloc_fn gave. Called from any thread. */
typedef void(DEFREC_CALL *defrec_free_fn)(void *user, void *ptr);
/** Calls body(arg, 0..count-1), each once, on any threads, and returns when all have returned. */
typedef void(DEFREC_CALL *defrec_parallel_for_fn)(
    void *user, size_t count, void(DEFREC_CALL *body)(void *arg, size_t index), void *arg);

/** Flags of defrec_context_desc. */
enum {
    DEFREC_CONTEXT_ONLY_GIVEN_PLUGINS = 1u << 0, /**< look nowhere but in plugin_paths */
    DEFREC_CONTEXT_USE_ENVIRONMENT    = 1u << 1  /**< honour DEFREC_PLUGIN_PATH (never when
                                                      privileged) */
};

/** What a context is made with. Nothing it points to is kept but the callbacks and what they are
 *  given. */
typedef struct defrec_context_desc {
    uint32_t               struct_size;       /**< see DEFREC_INIT */
    uint32_t               flags;             /**< DEFREC_CONTEXT_* */
    const char *const     *plugin_paths;      /**< absolute folders or manifest files, searched
                                                   first */
    size_t                 plugin_path_count; /**< number of plugin_paths @range 0..1000 */
    defrec_log_fn          log;               /**< NULL: no log */
    void                  *log_user;          /**< handed to log */
    int32_t                log_level;         /**< the lowest level reported, DEFREC_LOG_*
                                                   @default DEFREC_LOG_INFO @range DEFREC_LOG_* */
    uint32_t               threads;           /**< threads of the library's own pool, the caller's
                                                   included @default "one per core" @range 1..256 */
    defrec_alloc_fn        alloc;             /**< both or neither of alloc and free: maps, all
                                                   memory of CPU backends, and where a device has no
                                                   page-locked memory of its own, pixels and what is
                                                   read back */
    defrec_free_fn         free;              /**< see alloc */
    void                  *alloc_user;        /**< handed to alloc and free */
    defrec_parallel_for_fn parallel_for;      /**< the application's own threads instead of the
                                                   pool; may be NULL */
    void                  *parallel_for_user; /**< handed to parallel_for */
    /** How long a plugin may take to start, to return from a call or to do a frame's work; then its
     *  device is quarantined: see DEFREC_FEATURE_QUARANTINED. @default 60000 @range 10..3600000
     *  @unit ms */
    uint32_t plugin_deadline_ms;
} defrec_context_desc;

/** Finds and loads the plugins. Succeeds with none found: look at defrec_plugin_get(). desc may be
 *  NULL.
 *  @errors DEFREC_ERROR_ARGUMENT: a field of desc is out of range, or alloc comes without free. A
 *  plugin that is refused is no error.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_context_create(
    const defrec_context_desc *desc, defrec_context *out);
/** What was made from the context goes on working, and keeps its plugins loaded.
 *  @threads any @since 1.0 */
DEFREC_API void DEFREC_CALL defrec_context_destroy(defrec_context context);

/** A plugin that was looked at. The strings live as long as the context. */
typedef struct defrec_plugin_info {
    uint32_t    struct_size; /**< see DEFREC_INIT */
    int32_t     verdict;     /**< defrec_status: DEFREC_OK when loaded, else why it was refused */
    const char *name;        /**< from the manifest; the file's name where that cannot be read */
    const char *path;        /**< path of the manifest, or of the folder that was refused */
    const char *version;     /**< the plugin's own, from the manifest */
    const char *reason;      /**< why it was refused, or devices of it left out; else "" */
} defrec_plugin_info;
/** The number of candidates that were looked at, loaded or refused. 0 for a bad handle.
 *  @threads any @since 1.0 */
DEFREC_API size_t DEFREC_CALL defrec_plugin_count(defrec_context context);
/** Candidate number index, from 0, in the order of the search.
 *  @errors DEFREC_ERROR_ARGUMENT: there is none of that index.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_plugin_get(
    defrec_context context, size_t index, defrec_plugin_info *out);

/** Kinds of devices. */
enum {
    DEFREC_DEVICE_CPU    = 1, /**< the processor */
    DEFREC_DEVICE_CUDA   = 2, /**< a GPU through CUDA */
    DEFREC_DEVICE_VULKAN = 3  /**< a GPU, or a driver in software, through Vulkan */
};
/** Stages, each defined by a page of docs/stages.md. */
enum {
    DEFREC_STAGE_RECTIFY  = 0, /**< gray image and mask of the rectified camera */
    DEFREC_STAGE_STEREO   = 1, /**< disparity */
    DEFREC_STAGE_ORB      = 2, /**< features */
    DEFREC_STAGE_MATCH    = 3, /**< features to landmarks */
    DEFREC_STAGE_ALIGN    = 4, /**< guided search for patches */
    DEFREC_STAGE_RANSAC   = 5, /**< preselection of matches */
    DEFREC_STAGE_LM       = 6, /**< motions of the control points */
    DEFREC_STAGE_WARP     = 7, /**< deformed surface, compared with the disparity */
    DEFREC_STAGE_COUNT_V1 = 8  /**< how many there are */
};
/** Features of a device. */
enum {
    DEFREC_FEATURE_REPEATABLE  = 1u << 0, /**< the same input gives the same bits */
    DEFREC_FEATURE_SOFTWARE    = 1u << 1, /**< a graphics driver that computes on the processor,
                                               slower than the CPU backend */
    DEFREC_FEATURE_QUARANTINED = 1u << 2  /**< did not answer within plugin_deadline_ms: it is not
                                               opened again in this context, and what it holds is
                                               left behind */
};

/** A device that a loaded plugin offers. The strings live as long as the context. */
typedef struct defrec_device_info {
    uint32_t    struct_size;  /**< see DEFREC_INIT */
    uint32_t    kind;         /**< DEFREC_DEVICE_* */
    const char *id;           /**< stable and unique: "cpu", "reference", "cuda:GPU-1a2b",
                                   "vulkan:10005:0000" */
    const char *name;         /**< for people */
    const char *driver;       /**< and its version, for people; may be "" */
    uint64_t    memory_bytes; /**< the device's memory */
    uint32_t    stages;       /**< bit 1 << DEFREC_STAGE_* for each it offers */
    uint32_t    features;     /**< DEFREC_FEATURE_* */
    uint32_t    conformance;  /**< version of the conformance suite passed, 0 if none */
    uint32_t    reserved;     /**< 0 */
} defrec_device_info;
/** The number of devices of all loaded plugins. 0 for a bad handle.
 *  @threads any @since 1.0 */
DEFREC_API size_t DEFREC_CALL defrec_device_count(defrec_context context);
/** Device number index, from 0: fastest kind first (CUDA, Vulkan on a GPU, CPU, software,
 *  reference), then by id; the same order in every run.
 *  @errors DEFREC_ERROR_ARGUMENT: there is none of that index.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_device_get(
    defrec_context context, size_t index, defrec_device_info *out);

/** @} */
/** @defgroup rig Images and rigs
 *  @{ */

/** Kinds of memory that a defrec_memory may name. */
enum {
    DEFREC_MEMORY_HOST = 1, /**< the processor's memory, for devices that compute in it */
    DEFREC_MEMORY_CUDA = 2  /**< memory of a CUDA device (cudaMalloc), of the process's primary
                                 context */
};

/** Formats of pixels, 8 bits a channel. All stages compute gray values; the colours of host pixels
 *  tell the tracker besides where something lies on the tissue. */
enum {
    DEFREC_FORMAT_GRAY8 = 1, /**< 1 byte */
    DEFREC_FORMAT_BGR8  = 2, /**< 3 bytes, OpenCV's order */
    DEFREC_FORMAT_RGB8  = 3, /**< 3 bytes */
    DEFREC_FORMAT_BGRA8 = 4  /**< 4 bytes; the fourth is ignored */
};

/** Limits of image sizes, px. */
enum {
    DEFREC_MIN_WIDTH  = 64,  /**< least width */
    DEFREC_MIN_HEIGHT = 48,  /**< least height */
    DEFREC_MAX_SIDE   = 8192 /**< most width and height */
};

/** An image: pixels of the host or a defrec_memory, one of the two. */
typedef struct defrec_image {
    uint32_t      struct_size;   /**< see DEFREC_INIT */
    uint32_t      format;        /**< DEFREC_FORMAT_* */
    uint32_t      width, height; /**< px */
    uint64_t      stride;        /**< bytes from row to row; 0: width * bytes per pixel, or what
                                      memory has */
    const void   *pixels;        /**< host memory, stride * (height - 1) + width * bytes per pixel
                                      bytes; or NULL and memory */
    defrec_memory memory;        /**< the pixels lie here, from its first byte: see
                                      defrec_memory_import(). */
} defrec_image;

/** How the rows of a video's images follow each other in time. */
enum {
    DEFREC_SCAN_UNKNOWN      = 0, /**< not known: too little moves */
    DEFREC_SCAN_PROGRESSIVE  = 1, /**< all rows of an image are of one time */
    DEFREC_SCAN_TOP_FIRST    = 2, /**< interlaced: DEFREC_FIELD_TOP is half a frame period before
                                       DEFREC_FIELD_BOTTOM */
    DEFREC_SCAN_BOTTOM_FIRST = 3  /**< interlaced: DEFREC_FIELD_BOTTOM is the earlier one */
};
/** Tells from two consecutive images of one view, earlier and later, how its rows follow each other
 *  in time: scan, DEFREC_SCAN_*. A cut between them may deceive it, so ask about several pairs, and
 *  believe what most of those say that know.
 *  @errors DEFREC_ERROR_ARGUMENT: the images differ in size or format, or lie in a defrec_memory.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_detect_scan(
    const defrec_image *earlier, const defrec_image *later, uint32_t *scan);

/** One camera's pinhole and distortion, as OpenCV has them. Frozen. */
typedef struct defrec_intrinsics {
    double   fx, fy, cx, cy;   /**< focal lengths and centre, px */
    double   distortion[14];   /**< OpenCV's order: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tx ty */
    uint32_t distortion_count; /**< 0, 4, 5, 8, 12 or 14 */
    uint32_t reserved;         /**< 0 */
} defrec_intrinsics;

/** The calibration of two cameras. */
typedef struct defrec_rig_desc {
    uint32_t          struct_size;    /**< see DEFREC_INIT */
    uint32_t          flags;          /**< 0 */
    uint32_t          width, height;  /**< width and height of the raw images, px */
    defrec_intrinsics left, right;    /**< intrinsics of the raw cameras */
    double            rotation[9];    /**< x_right = rotation * x_left + translation; row-major */
    double            translation[3]; /**< mm; x < 0 for a right camera on the right */
} defrec_rig_desc;

/** The pinhole of the rectified images, which share all but the principal point's x: the right
 *  image's is cx + disparity_offset_px. Frozen. */
typedef struct defrec_camera {
    double fx, fy;      /**< focal lengths @range >0.. @unit px */
    double cx, cy;      /**< principal point @unit px */
    double baseline_mm; /**< distance of the two cameras @range >0.. @unit mm */
    /** Right view's cx less the left one's: 0 where the views look in parallel, above 0 where they
     *  converge. @range -4096..4096 @unit px */
    double disparity_offset_px;
} defrec_camera;

/** Checks the calibration in desc (finite, focal lengths > 0, a rotation, a horizontal baseline,
 *  monotone distortion) and computes the rectification (Bouguet's, as OpenCV's stereoRectify: half
 *  the rotation to each camera, then x along the baseline). Cameras that are rectified already (no
 *  distortion, rotation = I, same intrinsics, translation along x) are used as they are, without
 *  resampling. Where a distortion is monotone over at least half of the image, the pixels beyond
 *  are masked and a warning with their share is logged.
 *  @errors DEFREC_ERROR_ARGUMENT: the calibration is impossible, the error message names the field.
 *  DEFREC_ERROR_UNSUPPORTED: the baseline is more than 30 degrees from the x axis, or the cameras
 *  look in too different directions.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_rig_create(
    defrec_context context, const defrec_rig_desc *desc, defrec_rig *out);
/** Trackers made with the rig go on working.
 *  @threads any @since 1.0 */
DEFREC_API void DEFREC_CALL defrec_rig_destroy(defrec_rig rig);

/** What rectification made of a rig. */
typedef struct defrec_rig_info {
    uint32_t      struct_size;   /**< see DEFREC_INIT */
    uint32_t      identity;      /**< 1: frames are rectified already and not resampled */
    uint32_t      width, height; /**< width and height of the rectified images, px */
    defrec_camera camera;        /**< pinhole of the rectified images */
    double        rotation[9];   /**< x_rectified = rotation * x_left_raw; row-major */
} defrec_rig_info;
/** Describes the rectified camera.
 *  @errors none but those of every function.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_rig_get(defrec_rig rig, defrec_rig_info *out);
/** Maps count pixels (u, v) of the raw left image, raw_uv, to the rectified left image,
 *  rectified_uv; NaN where there is no answer. The two may be the same memory.
 *  @errors none but those of every function.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_rig_rectify_pixels(
    defrec_rig rig, const double *raw_uv, size_t count, double *rectified_uv);
/** The way back: count pixels of the rectified left image, rectified_uv, to the raw one, raw_uv;
 *  NaN where there is no answer. The two may be the same memory.
 *  @errors none but those of every function.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_rig_distort_pixels(
    defrec_rig rig, const double *rectified_uv, size_t count, double *raw_uv);

/** @} */
/** @defgroup stage Stages on their own
 *  Records are frozen and lie in arrays without padding; floats are IEEE single. docs/stages.md
 *  defines each stage, its buffers and their order.
 *  @{ */

/** Unit of disparities. */
enum { DEFREC_DISPARITY_ONE = 16 /**< disparities are int16 in 1/16 px */ };
/** The disparity of a pixel that has none. */
enum { DEFREC_DISPARITY_NONE = -32768 /**< no evidence at this pixel */ };
/** Unit of orientations. */
enum {
    DEFREC_ORB_ANGLE_BINS = 32 /**< orientation bin k is the angle k * 2 pi / 32 from x towards y */
};
/** Size of arrays. */
enum { DEFREC_BLEND_NODES = 4 /**< control points that move one surface point */ };

/** A corner with its descriptor, 48 bytes. */
typedef struct defrec_feature {
    int32_t  x, y;          /**< in the image, 1/16 px */
    uint16_t level;         /**< level of the pyramid */
    uint16_t angle;         /**< orientation bin */
    uint32_t score;         /**< corner score, larger is stronger */
    uint32_t descriptor[8]; /**< bit i is bit i % 32 of word i / 32 */
} defrec_feature;

/** A feature of the template, 48 bytes. */
typedef struct defrec_landmark {
    uint32_t descriptor[8]; /**< as a feature's */
    float    position[3];   /**< template frame, mm */
    uint32_t reserved;      /**< 0 */
} defrec_landmark;

/** What a landmark was matched to, 40 bytes, one for each landmark. */
typedef struct defrec_match {
    int32_t  feature;     /**< index of the live feature, -1: none */
    int32_t  distance;    /**< Hamming distance to it, 0..256 */
    int32_t  second;      /**< to the second best at another place, 0..256 */
    float    u, v;        /**< the live feature's pixel */
    float    position[3]; /**< the live feature in the rectified camera, mm; 0 0 0 where depth is
                               unknown */
    float    weight;      /**< 0..1 after preselection (stage ransac), before it 1 for a match with
                               depth */
    uint32_t reserved;    /**< 0 */
} defrec_match;

/** A point that control points move, 56 bytes. */
typedef struct defrec_surface_point {
    float   position[3];                /**< template frame, mm */
    float   normal[3];                  /**< unit length, towards the camera */
    int32_t node[DEFREC_BLEND_NODES];   /**< control points; unused entries repeat one, with weight
                                            0 */
    float   weight[DEFREC_BLEND_NODES]; /**< sum 1 */
} defrec_surface_point;

/** A piece of the template's image that is searched in each frame, 88 bytes. */
typedef struct defrec_patch {
    float    u, v;                       /**< its centre in the view it was taken from, px */
    int32_t  view;                       /**< which view */
    uint32_t reserved;                   /**< 0 */
    float    position[3];                /**< template frame, mm */
    float    tangent_u[3];               /**< how position moves, mm, for one pixel to the right in
                                             the view, along the surface */
    float    tangent_v[3];               /**< likewise for one pixel down */
    int32_t  node[DEFREC_BLEND_NODES];   /**< as a surface point's */
    float    weight[DEFREC_BLEND_NODES]; /**< as a surface point's */
    uint32_t reserved2;                  /**< 0 */
} defrec_patch;

/** How the weights of a patch change along its view, per px, 32 bytes; of a patch that its control
    points do not strain all are 0. */
typedef struct defrec_patch_slope {
    float weight_u[DEFREC_BLEND_NODES]; /**< for one pixel to the right; sum 0 @unit 1/px */
    float weight_v[DEFREC_BLEND_NODES]; /**< likewise for one pixel down @unit 1/px */
} defrec_patch_slope;

/** Where a patch is expected, 32 bytes. */
typedef struct defrec_patch_prediction {
    int32_t u, v;              /**< predicted centre in the live image, 1/256 px */
    int32_t view_from_live[4]; /**< 2x2 row-major, 1/65536: offset in the view = matrix * offset in
                                    the live image */
    int32_t valid;             /**< 1: inside the image, facing the camera, not stretched out of all
                                    proportion */
    int32_t reserved;          /**< 0 */
} defrec_patch_prediction;

/** Where a patch was found, 32 bytes. */
typedef struct defrec_patch_observation {
    int32_t  u, v;           /**< where it was found, 1/256 px */
    int32_t  score;          /**< ZNCC, 1/4096 */
    int32_t  valid;          /**< 1: found */
    float    information[3]; /**< uu, uv, vv: curvature of the score at the peak, per px^2; 0 along
                                  a direction without texture */
    uint32_t reserved;       /**< 0 */
} defrec_patch_observation;

/** A unit dual quaternion, a rigid motion x -> R x + t, 32 bytes. */
typedef struct defrec_motion {
    float real[4]; /**< w x y z */
    float dual[4]; /**< w x y z: 0.5 * t * real */
} defrec_motion;

/** A connection between control points a < b, 12 bytes. */
typedef struct defrec_edge {
    int32_t a, b;   /**< indices of control points */
    float   weight; /**< > 0 */
} defrec_edge;

/** What a frame says of a surface point. */
enum {
    DEFREC_OBSERVED     = 0, /**< the live surface lies where the point is */
    DEFREC_NO_DEPTH     = 1, /**< no disparity there */
    DEFREC_OCCLUDED     = 2, /**< the live surface lies in front of it */
    DEFREC_OUTSIDE      = 3, /**< outside the image, or behind the camera */
    DEFREC_INCONSISTENT = 4  /**< the live surface lies behind it, or it faces away */
};
/** A surface point now, 32 bytes. */
typedef struct defrec_surface_sample {
    float    position[3]; /**< rectified camera, mm */
    float    normal[3];   /**< unit length, towards the camera */
    float    residual;    /**< live depth minus the point's depth, mm; 0 without depth */
    uint32_t observation; /**< DEFREC_OBSERVED ... */
} defrec_surface_sample;

/** What stage ransac found, 64 bytes. */
typedef struct defrec_ransac_summary {
    int32_t valid_matches;  /**< matches with depth */
    int32_t references;     /**< accepted references */
    int32_t inliers;        /**< matches with weight > 0.5 after merging */
    int32_t best_support;   /**< matches within H of the best reference's rigid motion */
    float   rotation[9];    /**< rotation of the best reference's motion: x_live = rotation *
                                 x_template + translation; row-major */
    float   translation[3]; /**< mm */
} defrec_ransac_summary;

/** How stage lm ended, 64 bytes. */
typedef struct defrec_lm_summary {
    float    initial_cost, final_cost;     /**< mm^2, all terms, weighted */
    float    icp_cost, match_cost;         /**< costs of the final state, weighted */
    float    patch_cost, arap_cost;        /**< costs of the final state, weighted */
    int32_t  iterations;                   /**< taken */
    int32_t  icp_points, matches, patches; /**< residuals with weight > 0 in the final state */
    float    icp_rms, match_rms;           /**< weighted root mean squares, mm */
    float    patch_rms;                    /**< weighted root mean square, px */
    float    damping;                      /**< the last lambda */
    int32_t  failed;                       /**< 1: a system could not be solved and the motions are
                                                those given */
    uint32_t reserved;                     /**< 0 */
} defrec_lm_summary;

/** Parameters of stage rectify. As in all parameters, zero means default wherever a default is
 *  named; a plugin gets them with every default filled in and every range checked. */
typedef struct defrec_rectify_params {
    uint32_t struct_size;      /**< see DEFREC_INIT */
    uint32_t format;           /**< DEFREC_FORMAT_* of the source @range DEFREC_FORMAT_* */
    uint32_t source_width;     /**< width of the source @range 1..DEFREC_MAX_SIDE @unit px */
    uint32_t source_height;    /**< height of the source @range 1..DEFREC_MAX_SIDE @unit px */
    uint32_t source_stride;    /**< distance from row to row of the source
                                    @default source_width * bytes_per_pixel(format)
                                    @range source_width * bytes_per_pixel(format)..1048576
                                    @unit bytes */
    uint32_t width;            /**< width of the result @default source_width
                                    @range 1..DEFREC_MAX_SIDE @unit px */
    uint32_t height;           /**< height of the result @default source_height
                                    @range 1..DEFREC_MAX_SIDE @unit px */
    uint32_t stride;           /**< distance from row to row of the result @default width
                                    @range width..1048576 @unit bytes */
    uint32_t saturation;       /**< gray values from here on count as highlights and are masked;
                                    256: none @default 235 @range 1.. @unit gray levels */
    uint32_t highlight_radius; /**< (Chebyshev) that the mask grows round highlights @default 4
                                    @range 1..16 @unit px */
} defrec_rectify_params;

/** Parameters of stage stereo. */
typedef struct defrec_stereo_params {
    uint32_t struct_size;   /**< see DEFREC_INIT */
    uint32_t width, height; /**< width and height of gray images and masks @range 2..DEFREC_MAX_SIDE
                                 @unit px */
    uint32_t stride;        /**< distance from row to row of gray images and masks @default width
                                 @range width..1048576 @unit bytes */
    int32_t  min_disparity; /**< smallest disparity searched @range 0..1024 @unit px */
    uint32_t disparities;   /**< number of disparities searched @default 128 @range 1..510
                                 @unit px */
    uint32_t radius;        /**< radius of the search's correlation window @default 4 @range 2..6
                                 @unit px of half resolution */
    uint32_t refine_radius; /**< radius of the correlation window at full resolution @default 4
                                 @range 2..6 @unit px */
    uint32_t min_score;     /**< ZNCC of the search below this is no evidence @default 1600 (0.39)
                                 @range 1..4096 @unit 1/4096 */
    uint32_t refine_score;  /**< ZNCC at full resolution that a pixel needs which the search left
                                 open @default 2000 (0.49) @range 1..4096 @unit 1/4096 */
    uint32_t uniqueness;    /**< lead of the best score over any other that is not close to it
                                      @default 40 (0.01) @range 1..4096 @unit 1/4096 */
    uint32_t texture;       /**< min standard deviation of gray in the window @default 8
                                 @range 1..2048 @unit 1/16 gray level */
    uint32_t left_right;    /**< max difference between left and right winner, which is even
                                 @default 1 @range 1.. @unit px of half resolution */
    uint32_t edge;          /**< a range of disparities in a neighbourhood above this is a depth
                                 edge @default 24 @range 1..4096 @unit 1/16 px of half resolution */
    uint32_t support;       /**< how many of 25 neighbours, at every second pixel, must agree with a
                                 disparity, itself included @default 10 @range 1..25 */
    uint32_t fill_radius;   /**< holes up to about this radius, rounded up to an even number, are
                                 filled from their rim @default 6 @range 1..8 @unit px */
    uint32_t smooth_radius; /**< radius of the smoothing window, rounded up to an even number
                                 @default 3 @range 1..3 @unit px */
    uint32_t smooth_range;  /**< neighbours that differ by more are another surface @default 24
                                 @range 1..256 @unit 1/16 px */
    uint32_t smooth_passes; /**< passes of the smoothing @default 4 @range 1..8 */
} defrec_stereo_params;

/** Parameters of stage orb. */
typedef struct defrec_orb_params {
    uint32_t struct_size; /**< see DEFREC_INIT */
    uint32_t width;       /**< width of gray image and mask @range DEFREC_MIN_WIDTH..DEFREC_MAX_SIDE
                               @unit px */
    uint32_t height;      /**< height of gray image and mask
                               @range DEFREC_MIN_HEIGHT..DEFREC_MAX_SIDE @unit px */
    uint32_t stride;      /**< distance from row to row of gray image and mask @default width
                               @range width..1048576 @unit bytes */
    uint32_t levels;      /**< levels of the pyramid, each 4/5 of the one below @default 4
                               @range 1..8 */
    uint32_t cell;        /**< max one corner for each cell of this side @default 8 @range 4..16
                               @unit px of its level */
    uint32_t threshold;   /**< FAST's threshold @default 3 @range 1..254 @unit gray levels */
    uint32_t capacity;    /**< max number of features @default 2048 @range 1..65535 */
    uint32_t spacing;     /**< min distance between features of one level; grows until the features
                               fit the capacity @default 4 @range 1..63 @unit px of the level */
    uint32_t halvings;    /**< how often the image is halved before the pyramid @range 0..3 */
} defrec_orb_params;

/** Parameters of stage match. */
typedef struct defrec_match_params {
    uint32_t      struct_size;   /**< see DEFREC_INIT */
    uint32_t      landmarks;     /**< max number of landmarks @range 1..65535 */
    uint32_t      features;      /**< max number of live features @range 1..65535 */
    uint32_t      max_distance;  /**< max Hamming distance of a match @default 64 @range 1..256
                                      @unit bits */
    uint32_t      ratio;         /**< max of best / second best; 256: no ratio test
                                      @default 218 (0.85) @range 1..256 @unit 1/256 */
    uint32_t      width, height; /**< width and height of the disparity image
                                      @range 2..DEFREC_MAX_SIDE @unit px */
    uint32_t      stride;        /**< distance from row to row of the disparity image @default width
                                      @range width..1048576 @unit elements */
    defrec_camera camera;        /**< rectified */
} defrec_match_params;

/** Parameters of stage align. */
typedef struct defrec_align_params {
    uint32_t      struct_size;    /**< see DEFREC_INIT */
    uint32_t      patches;        /**< max number of patches @range 0..4194304 */
    uint32_t      nodes;          /**< exact count of control points @range 0..4194304 */
    uint32_t      views;          /**< images patches are taken from @default 1 @range 1..64 */
    uint32_t      width;          /**< width of the live image, the mask and each view
                                      @range DEFREC_MIN_WIDTH..DEFREC_MAX_SIDE @unit px */
    uint32_t      height;         /**< height of the live image, the mask and each view
                                      @range DEFREC_MIN_HEIGHT..DEFREC_MAX_SIDE @unit px */
    uint32_t      stride;         /**< distance from row to row of the live image, the mask and each
                                      view @default width @range width..1048576 @unit bytes */
    uint32_t      level;          /**< search on images halved this many times @range 0..3 */
    uint32_t      patch_radius;   /**< half the side of a patch @default 5 @range 1..7
                                      @unit px of that level */
    uint32_t      search_radius;  /**< found is what lies less far away than this @default 4
                                      @range 1..16 @unit px of that level */
    uint32_t      min_score;      /**< ZNCC below this is not found @default 2867 (0.7) @range 1..
                                      @unit 1/4096 */
    uint32_t      texture;        /**< min standard deviation of the patch @default 16 @range 1..
                                      @unit 1/16 gray level */
    defrec_camera camera;         /**< rectified */
    uint32_t      right_view;     /**< 1: live image, mask, predictions and observations are the
                                      right view's @range 0..1 */
    uint32_t      keep_predicted; /**< 1: a patch that is not found is compared where it is
                                       predicted, and kept there if its score suffices
                                       @range 0..1 */
} defrec_align_params;

/** Parameters of stage ransac. */
typedef struct defrec_ransac_params {
    uint32_t struct_size;  /**< see DEFREC_INIT */
    uint32_t landmarks;    /**< max number of landmarks @range 0..4194304 */
    uint32_t references;   /**< matches that are tried as reference @default 30 @range 1..1024 */
    uint32_t iterations;   /**< iterations of reweighting, for each reference @default 10
                                @range 1..100 */
    float    threshold_mm; /**< the paper's H @default "a tenth of the RMS radius of each frame's
                                live points, at least 1 mm" @range 0.. @unit mm */
    uint32_t min_support;  /**< matches within H that a reference needs, itself included; 1/32 of
                                all matches is added @default 6 @range 1.. */
    uint64_t seed;         /**< seed of the choice of references */
} defrec_ransac_params;

/** How stage lm solves for a step. */
enum {
    DEFREC_SOLVER_COUPLED     = 1, /**< conjugate gradients over all control points */
    DEFREC_SOLVER_INDEPENDENT = 2  /**< each control point for itself, as in the paper */
};
/** Parameters of stage lm. */
typedef struct defrec_lm_params {
    uint32_t      struct_size;          /**< see DEFREC_INIT */
    uint32_t      solver;               /**< DEFREC_SOLVER_*: how a step is solved
                                             @default DEFREC_SOLVER_COUPLED
                                             @range DEFREC_SOLVER_* */
    uint32_t      nodes, edges, points; /**< exact count, as given to prepare @range 0..4194304 */
    uint32_t      landmarks, patches;   /**< exact count, as given to prepare @range 0..4194304 */
    uint32_t      width, height;        /**< width and height of the disparity image
                                             @range 2..DEFREC_MAX_SIDE @unit px */
    uint32_t      stride;               /**< distance from row to row of the disparity image
                                             @default width @range width..1048576 @unit elements */
    defrec_camera camera;               /**< rectified */
    uint32_t      iterations;           /**< iterations of Levenberg-Marquardt @default 10
                                             @range 1..4194304 */
    uint32_t      cg_iterations;        /**< max conjugate gradient steps in one iteration
                                             @default 20 @range 1..4194304 */
    uint32_t      presolve;             /**< 1: first move everything rigidly onto the weighted
                                             matches */
    float         node_spacing_mm;      /**< typical; lengths in the ARAP term are divided by it
                                             @default 5 @range 0.. @unit mm */
    float         icp_weight;           /**< weight of the ICP term @default 1 @range 0.. */
    float         match_weight;         /**< weight of the match term @default 10 @range 0.. */
    float         patch_weight;         /**< weight of the patch term @default 10 @range 0.. */
    float         arap_weight;          /**< weight of the ARAP term @default 1 @range 0.. */
    float         length_weight;        /**< weight of lengths within the ARAP term @default 1
                                             @range 0.. */
    float         angle_weight;         /**< weight of angles within the ARAP term @default 20
                                             @range 0.. */
    float         rotation_weight;      /**< weight of rotations within the ARAP term @default 100
                                             @range 0.. */
    float         icp_tukey_mm;         /**< width of the ICP term's Tukey kernel @default 3
                                             @range 0.. @unit mm */
    float         match_tukey_mm;       /**< width of the match term's Tukey kernel @default 5
                                             @range 0.. @unit mm */
    float         patch_tukey_px;       /**< width of the patch term's Tukey kernel @default 4
                                             @range 0.. @unit px */
    float         association_mm;       /**< live surface farther than this along the ray is another
                                             surface @default 10 @range 0.. @unit mm */
    float         damping;              /**< first lambda @default 1e-3 @range 0.. */
    float         match_threshold_mm;   /**< H in the weight 1 - d / (5 H) of matches that
                                             preselection left at 0 @default 2 @range 0..
                                             @unit mm */
    uint32_t      trust_last_step;      /**< 1: the last iteration's step is taken without
                                             evaluating its cost @range 0..1 */
} defrec_lm_params;

/** Parameters of stage warp. */
typedef struct defrec_warp_params {
    uint32_t      struct_size;   /**< see DEFREC_INIT */
    uint32_t      nodes, points; /**< exact count, as given to prepare @range 0..4194304 */
    uint32_t      width, height; /**< width and height of the disparity image
                                      @range 2..DEFREC_MAX_SIDE @unit px */
    uint32_t      stride;        /**< distance from row to row of the disparity image @default width
                                      @range width..1048576 @unit elements */
    uint32_t      reserved;      /**< 0 */
    defrec_camera camera;        /**< rectified */
    float         tolerance_mm;  /**< live depth within this of the point's is an observation
                                      @default 2 @range 0.. @unit mm */
} defrec_warp_params;

/** Host memory that a stage writes. Frozen. */
typedef struct defrec_buffer {
    void    *data; /**< NULL: an optional buffer that is not given */
    uint64_t size; /**< bytes */
} defrec_buffer;
/** Host memory that a stage reads. Frozen. */
typedef struct defrec_const_buffer {
    const void *data; /**< NULL: an optional buffer that is not given */
    uint64_t    size; /**< bytes */
} defrec_const_buffer;

/** Creates one stage (DEFREC_STAGE_*) on one device. params: the stage's defrec_*_params. device_id
 *  NULL: the first device that offers the stage.
 *  @errors DEFREC_ERROR_ARGUMENT: no such stage or device, or a parameter is out of range.
 *  DEFREC_ERROR_UNSUPPORTED: no device offers the stage, or this one cannot do it with these
 *  parameters. DEFREC_ERROR_DEVICE_LOST. DEFREC_ERROR_PLUGIN.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_stage_create(
    defrec_context context, const char *device_id, uint32_t stage, const void *params,
    defrec_stage *out);
/** Ends a stage.
 *  @threads any @since 1.0 */
DEFREC_API void DEFREC_CALL defrec_stage_destroy(defrec_stage stage);
/** Gives a stage in_count inputs, in, that stay the same from run to run (a template); match,
 *  align, ransac, lm and warp need it before their first run.
 *  @errors DEFREC_ERROR_ARGUMENT: a buffer is missing, too small or holds what the definition
 *  excludes, or the stage has nothing to prepare. DEFREC_ERROR_BUSY. DEFREC_ERROR_DEVICE_LOST.
 *  DEFREC_ERROR_PLUGIN.
 *  @threads one @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_stage_prepare(
    defrec_stage stage, const defrec_const_buffer *in, size_t in_count);
/** Runs it on in_count inputs, in, and waits for its out_count outputs, out.
 *  @errors DEFREC_ERROR_ARGUMENT: a buffer is missing or too small, the error message names the
 *  size needed. DEFREC_ERROR_STATE: not prepared. DEFREC_ERROR_BUSY. DEFREC_ERROR_DEVICE_LOST.
 *  DEFREC_ERROR_PLUGIN.
 *  @threads one @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_stage_run(
    defrec_stage stage, const defrec_const_buffer *in, size_t in_count, const defrec_buffer *out,
    size_t out_count);

/** @} */
/** @defgroup tracking Tracking
 *  @{ */

/** What a tracker does with the calibration that it measures. */
enum {
    DEFREC_SELF_CALIBRATION_REPORT  = 0, /**< measured; given in results and reasons, and expected
                                              errors grow by what it causes */
    DEFREC_SELF_CALIBRATION_CORRECT = 1, /**< as reported; vertical offset, roll and ratio of focal
                                              lengths are also corrected in rectification */
    DEFREC_SELF_CALIBRATION_OFF     = 2  /**< not measured */
};

/** Whether a tracker computes the elastic body beneath its template. */
enum {
    DEFREC_BODY_ON  = 0, /**< on a thread of its own, from when there is a template */
    DEFREC_BODY_OFF = 1  /**< never: points beneath the surface move with the rigid motion of the
                              tissue that is seen */
};

/** Flags of defrec_tracker_desc. */
enum {
    DEFREC_TRACKER_FALLBACK = 1u << 0 /**< where the device is quarantined or cannot be opened, take
                                           the next one with every stage; results name it */
};
/** What a tracker is made with. device_id "BACKEND:*": its device with the fewest trackers. */
typedef struct defrec_tracker_desc {
    uint32_t    struct_size;       /**< see DEFREC_INIT */
    uint32_t    flags;             /**< DEFREC_TRACKER_* @range 0..DEFREC_TRACKER_FALLBACK */
    const char *device_id;         /**< id of the device; NULL: the first device with every stage */
    uint64_t    seed;              /**< seed of random choices: the same seed gives the same results
                                        on a repeatable device */
    uint32_t    format;            /**< DEFREC_FORMAT_* of the frames @default DEFREC_FORMAT_BGR8
                                        @range DEFREC_FORMAT_* */
    uint32_t    frames_in_flight;  /**< submitted and not yet released @default 2 @range 1..16 */
    uint32_t    disparities;       /**< number searched @default "found from the first frame"
                                        @range 1..510 @unit px */
    int32_t     min_disparity;     /**< smallest searched; used with disparities @range 0..1024
                                        @unit px */
    float       min_depth_mm;      /**< nearest surface expected @default 20 @range 0.1..100000
                                        @unit mm */
    float       node_spacing_px;   /**< between control points in the template's image
                                        @default "width / 32" @range 4..DEFREC_MAX_SIDE @unit px */
    float       vertex_spacing_px; /**< between template vertices in its image
                                        @default "width / 120, at least 4" @range 1..DEFREC_MAX_SIDE
                                        @unit px */
    uint32_t    max_features;      /**< found in a frame @default 768 @range 1..65535 */
    uint32_t    max_patches;       /**< patches of a template @default 1024 @range 1..65536 */
    float       arap_weight;       /**< weight of the smoothness term at the default spacing of
                                        control points: the tissue's stiffness, which is kept at
                                        others @default 0.55 @range 0..1e9 */
    uint32_t    keep_disparity;    /**< 1: results carry the disparity image; with grow they do */
    uint32_t    coarse_iterations; /**< iterations of Levenberg-Marquardt on patches that were
                                        searched in half-size images @default 1 @range 1..1000 */
    uint32_t    fine_iterations;   /**< iterations of Levenberg-Marquardt on patches that were
                                        searched in the images @default 2 @range 1..1000 */
    uint32_t    timed;             /**< 1: the host waits after each stage, so that the times of
                                        results are the device's; slower. Otherwise they are those
                                        of queueing where a device computes by itself */
    uint32_t    memory_stride;     /**< distance from row to row of left and right images in a
                                        defrec_memory @default "width * bytes per pixel, which is
                                        also the min" @range ..1048576 @unit bytes */
    uint32_t    self_calibration;  /**< DEFREC_SELF_CALIBRATION_*: what is done about a calibration
                                        that has drifted
                                        @default DEFREC_SELF_CALIBRATION_REPORT
                                        @range DEFREC_SELF_CALIBRATION_* */
    uint32_t    grow;              /**< 1: tissue that comes into view joins the template
                                        @range 0..1 */
    uint32_t    max_vertices;      /**< vertices of a template that grows; what would exceed it does
                                        not join @default 65536 @range 1..1000000 */
    uint32_t    body;              /**< DEFREC_BODY_*: what carries points beneath the surface
                                        @default DEFREC_BODY_ON @range DEFREC_BODY_* */
} defrec_tracker_desc;

/** Opens the device and allocates everything that a frame needs; afterwards no frame allocates, but
 *  those that capture a template and those that the template grows before.
 *  @errors DEFREC_ERROR_ARGUMENT: a field of desc is out of range, or no device has that id.
 *  DEFREC_ERROR_UNSUPPORTED: no device offers every stage, or this one cannot with images of this
 *  size. DEFREC_ERROR_DEVICE_LOST. DEFREC_ERROR_PLUGIN.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_tracker_create(
    defrec_context context, defrec_rig rig, const defrec_tracker_desc *desc, defrec_tracker *out);
/** Waits for the frame being computed; frames still queued end with DEFREC_ERROR_STATE. Jobs stay
 *  valid until released. A device that does not answer within plugin_deadline_ms is quarantined,
 *  and what it may still use is left behind: memory of the caller that was imported must stay.
 *  @threads any @since 1.0 */
DEFREC_API void DEFREC_CALL defrec_tracker_destroy(defrec_tracker tracker);

/** Memory of the caller. */
typedef struct defrec_memory_desc {
    uint32_t struct_size; /**< see DEFREC_INIT */
    uint32_t kind;        /**< DEFREC_MEMORY_* */
    void    *address;     /**< address of memory of that kind, a multiple of 16 */
    uint64_t size;        /**< bytes */
} defrec_memory_desc;

/** Lets this tracker's device work in the caller's memory, desc, without a copy. The memory stays
 *  the caller's, and must outlive the handle and every job that was given it. Host memory must be
 *  readable, and writable for samples; that is not checked. Import once what frames use in turn.
 *  @errors DEFREC_ERROR_ARGUMENT: no such kind, no multiple of 16, or not memory of that kind.
 *  DEFREC_ERROR_UNSUPPORTED: the device cannot reach it. DEFREC_ERROR_DEVICE_LOST.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_memory_import(
    defrec_tracker tracker, const defrec_memory_desc *desc, defrec_memory *out);
/** Frames that were submitted with it are computed all the same.
 *  @threads any @since 1.0 */
DEFREC_API void DEFREC_CALL defrec_memory_release(defrec_memory memory);

/** Flags of defrec_frame. */
enum {
    DEFREC_FRAME_CAPTURE_TEMPLATE = 1u << 0, /**< make this frame the template (the first usable
                                                 frame is, unless one was set) */
    DEFREC_FRAME_HELD_MOTION      = 1u << 1, /**< held_motion is given */
    DEFREC_FRAME_CAMERA_POSE      = 1u << 2  /**< camera_pose is given */
};

/** Fields of an interlaced image: the rows that are of one time. */
enum {
    DEFREC_FIELD_NONE   = 0, /**< the image is progressive: all its rows are of one time */
    DEFREC_FIELD_TOP    = 1, /**< the even rows, 0 the first */
    DEFREC_FIELD_BOTTOM = 2  /**< the odd rows */
};

/** Disparity of the rectified left image that the application has measured, by a learned stereo
 *  network or a depth camera say: it takes the place of stage stereo. docs/api/disparity.md is the
 *  guide. */
typedef struct defrec_disparity {
    uint32_t     struct_size;   /**< see DEFREC_INIT */
    uint32_t     flags;         /**< 0 */
    uint32_t     width, height; /**< width and height of the rectified image, see defrec_rig_info,
                                     px */
    uint64_t     stride;        /**< bytes from row to row of both arrays, a multiple of 4;
                                     0: width * 4 */
    const float *disparity;     /**< per pixel, px, 0..2000; 0: none there. It is rounded to
                                     1 / DEFREC_DISPARITY_ONE */
    const float *sigma;         /**< per pixel that has disparity: standard deviation of the error
                                     that it shares with the pixels around it, px, 0.001..100;
                                     NULL: sigma_px at all of them */
    float        sigma_px;      /**< likewise, of all pixels; 0 with sigma. Noise that differs from
                                     pixel to pixel is no part of it: the surface averages it, and
                                     what is left shows in the residuals @unit px */
    uint32_t     reserved;      /**< 0 */
} defrec_disparity;

/** A pair of images. */
typedef struct defrec_frame {
    uint32_t            struct_size;  /**< see DEFREC_INIT */
    uint32_t            flags;        /**< DEFREC_FRAME_* */
    int64_t             timestamp_ns; /**< strictly growing; of any clock */
    const defrec_image *left, *right; /**< the rig's size, the tracker's format */
    const defrec_image *ignore;       /**< GRAY8, the rig's size: nonzero pixels of the left image
                                           are not tissue; NULL: none */
    defrec_memory       samples;      /**< NULL, or where the device leaves a defrec_surface_sample
                                           per template vertex, those behind the result's vertices
                                           and normals; too small is how the job fails, so with grow
                                           it is made for max_vertices. */
    uint64_t            deadline_ns;  /**< when the job is to be done, from the call of
                                           defrec_tracker_submit; 0: no deadline. What is not
                                           expected to fit is left out: DEFREC_REASON_COARSE,
                                           DEFREC_REASON_UNCHECKED, in this order. A job that is
                                           late all the same says so: DEFREC_REASON_OVERDUE
                                           @unit ns */
    /** With DEFREC_FRAME_HELD_MOTION: rectified camera from template frame, 3x4 row-major, a
     *  rotation and mm, of what holds the body (a bone, the base of the tissue). It carries the
     *  depth beneath the surface, instead of what is estimated from the surface. */
    double held_motion[12];
    /** With DEFREC_FRAME_CAMERA_POSE: fixed frame (a navigation system's) from rectified camera,
     *  3x4 row-major, a rotation and mm, at the frame's time. Given with every frame from the
     *  template's on, it tells the motion of the tissue from that of the camera. */
    double camera_pose[12];
    /** DEFREC_FIELD_*: the rows of both images that are of this frame's time. The others are not
     *  read but interpolated, so rig, template and results are of whole images. An interlaced image
     *  is submitted twice, once for each field in the order of their times, half a frame period
     *  apart. */
    uint32_t                field;
    uint32_t                reserved;  /**< 0 */
    const defrec_disparity *disparity; /**< NULL: stage stereo measures it. Copied before
                                            defrec_tracker_submit() returns. It is compared with
                                            both images: DEFREC_REASON_DISPARITY */
} defrec_frame;

/** Queues a frame; jobs of one tracker run in order. Host pixels are copied before it returns.
 *  Pixels in a defrec_memory are complete when it is called and stay as they are until the job is
 *  done.
 *  @errors DEFREC_ERROR_BUSY: as many jobs as frames_in_flight are not released yet, or another
 *  thread is submitting. DEFREC_ERROR_ARGUMENT: the timestamp does not grow, or is more than a day
 *  after the last one (the frame after that is accepted: the clock may have been set), an image has
 *  another size or format than expected, there is no such field, or a disparity has another size
 *  than the rectified image or a value that none has (the error message names its pixel).
 *  DEFREC_ERROR_UNSUPPORTED: a field of an image in a defrec_memory, or a disparity together with
 *  an ignore in one. DEFREC_ERROR_DEVICE_LOST: the device did not answer a frame before. Such a
 *  frame counts as never submitted.
 *  @threads one @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_tracker_submit(
    defrec_tracker tracker, const defrec_frame *frame, defrec_job *out);

/** Waits at most timeout_ns for the job to be done; 0 only asks, UINT64_MAX waits without limit.
 *  However long, it ends when the device has not answered for plugin_deadline_ms. DEFREC_OK: it
 *  is. DEFREC_TIMEOUT: not yet. Negative: how the job failed.
 *  @errors DEFREC_ERROR_DEVICE_LOST: of this job and all later ones of the tracker.
 *  DEFREC_ERROR_OUT_OF_MEMORY: making room for a template. DEFREC_ERROR_ARGUMENT: the frame's
 *  samples are too small, or its ignore hides the template's tissue. DEFREC_ERROR_STATE: the
 *  tracker was destroyed before. DEFREC_ERROR_UNSUPPORTED: the device cannot with this template.
 *  DEFREC_ERROR_PLUGIN. @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_job_wait(defrec_job job, uint64_t timeout_ns);
/** Gives the job's place in the queue back; waits until it is done, and for other threads' calls on
 *  it.
 *  @threads any @since 1.0 */
DEFREC_API void DEFREC_CALL defrec_job_release(defrec_job job);

/** State of a frame. */
enum {
    DEFREC_INITIALISING = 0, /**< no template yet */
    DEFREC_TRACKING     = 1, /**< followed */
    DEFREC_DEGRADED     = 2, /**< followed, with less evidence than usual: see reasons */
    DEFREC_LOST         = 3, /**< geometry is the last known and not to be trusted */
    DEFREC_RELOCALISED  = 4  /**< found again in this frame; a new epoch */
};
/** Reasons for a state, a mask; also with a frame that is tracked. */
enum {
    DEFREC_REASON_DARK           = 1u << 0,  /**< left or right image is black
                                                  @effect the right one alone: degraded, followed
                                                  by the left one; else lost
                                                  @remedy check light, shutter and cable */
    DEFREC_REASON_SATURATED      = 1u << 1,  /**< left or right image is mostly white
                                                  @effect the right one alone: degraded, followed
                                                  by the left one; else lost
                                                  @remedy check exposure and distance */
    DEFREC_REASON_NO_TEXTURE     = 1u << 2,  /**< both images have hardly any contrast
                                                  @remedy look whether the lens is covered or no
                                                  tissue is in view */
    DEFREC_REASON_FEW_MATCHES    = 1u << 3,  /**< few features agree with the template's
                                                  landmarks; no harm while patches are found
                                                  @remedy nothing while tracked; after a long
                                                  time a new template */
    DEFREC_REASON_OCCLUDED       = 1u << 4,  /**< something lies in front of a quarter of the
                                                  surface
                                                  @effect degraded
                                                  @remedy move the instrument; give ignore of
                                                  defrec_frame where it is known */
    DEFREC_REASON_LARGE_RESIDUAL = 1u << 5,  /**< measured depth and the surface lie more than
                                                  1 mm apart on average, or tissue left its place
                                                  on 5 % of the surface @effect degraded
                                                  @remedy tissue was cut or is covered: a new
                                                  template if it lasts */
    DEFREC_REASON_FAST_MOTION    = 1u << 6,  /**< half of the surface moved more than 5 mm since
                                                  the frame before
                                                  @remedy nothing; if frames are dropped, drop
                                                  fewer */
    DEFREC_REASON_OUT_OF_VIEW    = 1u << 7,  /**< half of the surface lies outside the image
                                                  @effect degraded
                                                  @remedy move the camera back */
    DEFREC_REASON_NO_DEPTH       = 1u << 8,  /**< no disparity on half of the surface, or too
                                                  little for a template
                                                  @effect degraded, or no template
                                                  @remedy check focus and distance to the tissue:
                                                  min_depth_mm of defrec_tracker_desc */
    DEFREC_REASON_ONE_VIEW       = 1u << 9,  /**< one image is black, white or without contrast and
                                                  the other is not
                                                  @effect the right one: degraded, followed by the
                                                  left one, no depth is observed and no template
                                                  taken; the left one: lost
                                                  @remedy check lens, cable and video input of that
                                                  view */
    DEFREC_REASON_FROZEN         = 1u << 10, /**< the same pixels as the frame before, in all of
                                                  the picture, or in a part of it while the rest
                                                  moves
                                                  @effect a part: degraded, nothing is observed
                                                  there
                                                  @remedy check the video source */
    DEFREC_REASON_GAP            = 1u << 11, /**< time since the last frame is more than twice
                                                  the usual
                                                  @remedy look for frames that are missing
                                                  upstream */
    DEFREC_REASON_VIEWS_SWAPPED  = 1u << 12, /**< left and right seem to be exchanged: there is
                                                  no depth for a template, or the surface is lost
                                                  without depth, and exchanged images would give
                                                  it
                                                  @effect no template, or lost
                                                  @remedy exchange left and right */
    DEFREC_REASON_LOW_CONTRAST   = 1u << 13, /**< few of the patches that are expected are found:
                                                  smoke, blur, a wet lens
                                                  @effect degraded
                                                  @remedy clean the lens, wait for the smoke to
                                                  clear */
    DEFREC_REASON_VIEW_LATE      = 1u << 14, /**< left and right view were taken at different
                                                  times: view_lag_frames
                                                  @effect degraded, expected errors grow; depth is
                                                  not used where the lag spoils it. The lag is 0
                                                  where one view stands still, which faulty_views
                                                  names: then no template, or lost where nothing
                                                  is tracked
                                                  @remedy synchronise the grabber; pair the views
                                                  by their times; check the video input of a view
                                                  that stands still */
    DEFREC_REASON_CALIBRATION    = 1u << 15, /**< left and right rows do not agree
                                                  (vertical_offset_px, roll_deg, focal_ratio), or
                                                  the right view slipped sideways: the
                                                  calibration is not that of the cameras
                                                  @effect degraded, expected errors grow
                                                  @remedy calibrate anew; until then
                                                  self_calibration can correct it */
    DEFREC_REASON_TEMPLATE_GREW  = 1u << 16, /**< from this frame on the template has more
                                                  vertices: tissue joined
                                                  @remedy take the triangles again:
                                                  defrec_job_get_template() */
    DEFREC_REASON_TEMPLATE_FULL  = 1u << 17, /**< the template has reached its limit and grows no
                                                  more
                                                  @remedy set max_vertices higher, or capture a
                                                  new template */
    DEFREC_REASON_COARSE         = 1u << 18, /**< for want of time the surface was not refined in
                                                  the images' full size, or not searched widely
                                                  @effect degraded
                                                  @remedy a faster device, smaller images, a
                                                  later deadline */
    DEFREC_REASON_UNCHECKED      = 1u << 19, /**< for want of time the surface was not compared
                                                  with the image: no vertex counts as observed
                                                  @effect degraded, all vertices are unknown
                                                  @remedy as for DEFREC_REASON_COARSE */
    DEFREC_REASON_OVERDUE        = 1u << 20, /**< done after its deadline
                                                  @remedy as for DEFREC_REASON_COARSE */
    DEFREC_REASON_CUT            = 1u << 21, /**< from this frame on the template is parted along
                                                  a line where tissue came apart or slides: see
                                                  cut_points of defrec_template_info
                                                  @effect vertices beside the line that the image
                                                  does not show are unknown
                                                  @remedy take the triangles again:
                                                  defrec_job_get_template() */
    DEFREC_REASON_PIECE_LOST     = 1u << 22, /**< a piece of the surface is not found where it is
                                                  expected in the image, others are: see pieces
                                                  of defrec_result
                                                  @effect vertices of the piece are unknown
                                                  @remedy show which part is lost; go on with the
                                                  others */
    DEFREC_REASON_INTERLACED     = 1u << 23, /**< an image's rows alternate between two times, as
                                                  those of video that was not deinterlaced
                                                  @effect degraded, no vertex counts as observed;
                                                  no template, or lost where nothing is tracked
                                                  @remedy submit each field as a frame: see field
                                                  of defrec_frame */
    DEFREC_REASON_CONTRADICTED   = 1u << 24, /**< depth agrees on more than a twentieth of the
                                                  surface in the image where the left image shows
                                                  something else: tissue slid, left or changed, or
                                                  something lies on it
                                                  @effect expected errors are larger there
                                                  @remedy show which part is not observed; where it
                                                  lasts, capture another template */
    DEFREC_REASON_DISPARITY      = 1u << 25  /**< the disparity that the application gave is not
                                                  where left and right image show the same tissue
                                                  @effect degraded, expected errors grow, depth
                                                  evidence is withheld where they are large; no
                                                  template is captured
                                                  @remedy check that it is of this frame, of the
                                                  rectified left image and in px */
};
/** The views of which DEFREC_REASON_DARK, DEFREC_REASON_SATURATED, DEFREC_REASON_NO_TEXTURE,
 *  DEFREC_REASON_ONE_VIEW and DEFREC_REASON_FROZEN speak, a mask: with DEFREC_REASON_ONE_VIEW the
 *  one alone that shows nothing; DEFREC_REASON_FROZEN beside it is then of the other one. Without
 *  these, with DEFREC_REASON_VIEW_LATE: the one view that stands still, where one does. Else 0. */
enum {
    DEFREC_VIEW_LEFT  = 1, /**< the left view */
    DEFREC_VIEW_RIGHT = 2  /**< the right view */
};
/** Status of a vertex or point. */
enum {
    DEFREC_POINT_OBSERVED     = 0, /**< observed in both directions: DEFREC_EVIDENCE_DEPTH and
                                        DEFREC_EVIDENCE_PHOTOMETRIC */
    DEFREC_POINT_EXTRAPOLATED = 1, /**< from its neighbourhood: occluded, outside, without depth,
                                        not recognised in the image, beside another piece at
                                        another depth, or where depth contradicted the surface in
                                        the frames before */
    DEFREC_POINT_UNKNOWN      = 2  /**< not to be trusted: the frame is lost, or nothing near it was
                                        seen */
};
/** What was observed of a vertex, a mask. */
enum {
    DEFREC_EVIDENCE_DEPTH       = 1, /**< live depth was measured there and agrees */
    DEFREC_EVIDENCE_PHOTOMETRIC = 2  /**< the live image shows there what the template shows: the
                                      vertex has not slid along the surface */
};
/** Size of an array. */
enum { DEFREC_MAX_TIMED_STAGES = 16 /**< entries of defrec_result's times */ };
/** How long one step of a frame took. Frozen. */
typedef struct defrec_stage_time {
    const char *name;         /**< name of the step; static storage */
    double      milliseconds; /**< see timed of defrec_tracker_desc */
} defrec_stage_time;

/** A piece of the surface in one frame: tissue that nothing joins to the other pieces, which is
 *  found, lost and relocalised by itself, 24 bytes. */
typedef struct defrec_piece {
    uint32_t state;           /**< DEFREC_INITIALISING ..., as a frame's, but never that */
    uint32_t age;             /**< frames since it was last found */
    uint32_t vertices_inside; /**< its vertices in the image where it is expected */
    uint32_t patches;         /**< its patches found by guided search */
    float    observed_share;  /**< 0..1 of vertices_inside */
    uint32_t reserved;        /**< 0 */
} defrec_piece;

/** What carries points beneath the surface of a frame. */
enum {
    DEFREC_BODY_STATE_NONE    = 0, /**< no template, or no body can be made of it, or
                                        DEFREC_BODY_OFF */
    DEFREC_BODY_STATE_PENDING = 1, /**< it is being computed: until then such points move with the
                                        rigid motion of the tissue that is seen, or with the body
                                        before the template grew or was cut */
    DEFREC_BODY_STATE_READY   = 2  /**< the elastic body */
};

/** A frame's result. Pointers live until the job is released; without a template they are NULL and
 *  counts 0. */
typedef struct defrec_result {
    uint32_t struct_size;    /**< see DEFREC_INIT */
    uint32_t state;          /**< DEFREC_INITIALISING ...: what became of the frame */
    uint32_t reasons;        /**< DEFREC_REASON_*: why it is not better */
    uint32_t epoch;          /**< counts templates and relocalisations; 0 without a template */
    int64_t  timestamp_ns;   /**< time of the frame, as submitted */
    uint64_t frame;          /**< counts submitted frames from 0 */
    uint32_t age;            /**< frames since the geometry was last supported by evidence */
    uint32_t features;       /**< features found in the left image */
    uint32_t matches;        /**< features matched to landmarks, with depth */
    uint32_t inliers;        /**< matches that preselection kept */
    uint32_t patches;        /**< patches found by guided search */
    float    observed_share; /**< 0..1 of the vertices inside the image */
    /** Mean |depth residual| of the vertices whose depth agrees. */
    float mean_residual_mm;
    /** RMS distance between found and deformed patches */
    float patch_residual_px;
    /** Rectified camera from template frame, row-major: best rigid fit of all vertices.
     *  @components 3x4 */
    double               rigid_motion[12];
    const defrec_motion *motions;        /**< per control point, rectified camera from template
                                              frame @count node_count */
    const float         *node_positions; /**< xyz per control point, now, rectified camera, mm
                                              @count node_count @components 3 */
    uint64_t             node_count;     /**< control points */
    const float         *vertices;       /**< xyz per template vertex, rectified camera, mm
                                              @count vertex_count @components 3 */
    const float         *normals;        /**< xyz per template vertex, unit length, towards the
                                              camera @count vertex_count @components 3 */
    const uint8_t       *vertex_status;  /**< DEFREC_POINT_* per template vertex: how far to trust
                                              it @count vertex_count */
    /** Root mean square of the 3D error to be expected, per template vertex: the root of the trace
     *  of vertex_covariance. Over a sequence, at least 55 % of all vertices of a status have an
     *  error within it, 93 % within twice and 98.5 % within three times it, unless reasons say
     *  otherwise. @count vertex_count */
    const float                    *expected_error_mm;
    uint64_t                        vertex_count;       /**< template vertices */
    const defrec_landmark          *landmarks;          /**< landmarks of the template
                                                             @count landmark_count */
    const defrec_match             *landmark_matches;   /**< one per landmark; weight 0: outlier
                                                             @count landmark_count */
    uint64_t                        landmark_count;     /**< landmarks and their matches */
    const defrec_patch_observation *patch_observations; /**< one per template patch
                                                             @count patch_count */
    uint64_t                        patch_count;        /**< template patches */
    const int16_t                  *disparity;          /**< one per pixel of the rectified image,
                                                             row by row, 1/16 px; NULL without
                                                             keep_disparity and grow
                                                             @count pixels */
    /** In order of execution. @count time_count */
    defrec_stage_time times[DEFREC_MAX_TIMED_STAGES];
    uint32_t          time_count;        /**< number of times */
    uint32_t          reserved;          /**< 0 */
    const float      *vertex_covariance; /**< xx, xy, xz, yy, yz, zz per template vertex:
                                              covariance of the position's error, rectified camera,
                                              mm^2 @count vertex_count @components 6 */
    const uint8_t    *vertex_evidence;   /**< DEFREC_EVIDENCE_* per template vertex: what was
                                              observed of it @count vertex_count */
    /** By how many frames the right view is late in this frame, negative: early; 0 where that
     *  cannot be measured. */
    float view_lag_frames;
    /** Vertical offset of the right view against the left at the image centre, down is positive;
     *  mean of the last seconds, 0 where not measured. */
    float vertical_offset_px;
    /** Roll of the right view against the left about the image centre, clockwise is positive; mean
     *  of the last seconds, 0 where not measured. */
    float roll_deg;
    /** Right focal length to left; mean of the last seconds, 1 where not measured. */
    float    focal_ratio;
    uint32_t rig_matches;    /**< matches between left and right view, behind the last three; 0
                                  where not measured */
    uint32_t template_epoch; /**< counts the tracker's templates, and how often tissue joined them;
                                  0 without a template */
    /** Id of the device that computed the frame. */
    const char         *device_id;
    const defrec_piece *pieces;       /**< pieces of the surface, see vertex_pieces of
                                          defrec_template_info
                                          @count piece_count */
    uint64_t            piece_count;  /**< pieces; 1 for most templates */
    uint32_t            body;         /**< DEFREC_BODY_STATE_*: what carries points beneath the
                                          surface, now */
    uint32_t            faulty_views; /**< DEFREC_VIEW_*: the views that reasons speak of */
} defrec_result;
/** The result of a job that is done: after defrec_job_wait() gave DEFREC_OK.
 *  @errors DEFREC_ERROR_STATE: not done yet. A failed job gives the error that it failed with.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_job_result(defrec_job job, defrec_result *out);

/** The template of the job's frame, with as many vertices as its result: the tracker's present one
 *  may have grown since.
 *  @errors DEFREC_ERROR_STATE: not done yet, or there is no template. A failed job gives the error
 *  that it failed with.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_job_get_template(
    defrec_job job, defrec_template *out);

/** What was found under a pixel. */
enum {
    DEFREC_FOUND_NONE    = 0, /**< nothing that can be followed */
    DEFREC_FOUND_SURFACE = 1, /**< the surface */
    DEFREC_FOUND_BESIDE  = 2  /**< tissue beside the surface, which may grow there */
};

/** Finds the points under count pixels uv of the rectified left image of the job's frame: xyz, mm,
 *  template frame, from where defrec_job_warp_points() follows them. found (DEFREC_FOUND_*) per
 *  pixel: where it is DEFREC_FOUND_NONE, in a lost frame everywhere, xyz is 0. DEFREC_FOUND_BESIDE
 *  needs a tracker with grow, depth at the pixel and the surface at most 40 mm away; such a point
 *  moves with the tissue next to it, extrapolated, until the surface reaches it. To have it lie on
 *  the surface from then on, lift it again where defrec_job_warp_points() has it in a later frame.
 *  @errors DEFREC_ERROR_STATE: not done yet, or there is no template. A failed job gives the error
 *  that it failed with.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_job_lift_points(
    defrec_job job, const double *uv, size_t count, double *xyz, uint8_t *found);

/** Moves count points template_xyz, mm, given in the template frame (a preoperative model, say) to
 *  the frame of this job, xyz. Points on the surface move with it; points beneath it are carried by
 *  the elastic body, see docs/api/beneath.md, and their status is never DEFREC_POINT_OBSERVED;
 *  points in front of it move with the surface behind them. For each point status (DEFREC_POINT_*)
 *  and expected_error_mm (as in defrec_result) say how far to trust it; both may be NULL. A point
 *  that is not finite comes out as NaN and DEFREC_POINT_UNKNOWN. template_xyz and xyz may be the
 *  same memory.
 *  @errors DEFREC_ERROR_STATE: not done yet, or there is no template. A failed job gives the error
 *  that it failed with.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_job_warp_points(
    defrec_job job, const double *template_xyz, size_t count, double *xyz, uint8_t *status,
    double *expected_error_mm);

/** How far off the positions may be that defrec_job_warp_points() gives for count points
 *  template_xyz, mm, on the surface or off it. covariance: of each the error's xx, xy, xz, yy, yz,
 *  zz, rectified camera, mm^2; the root of the trace is the expected error; NaN for a point that is
 *  not finite. evidence: DEFREC_EVIDENCE_* of the vertex whose status the point has; may be NULL.
 *  @errors DEFREC_ERROR_STATE: not done yet, or there is no template. A failed job gives the error
 *  that it failed with.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_job_point_covariances(
    defrec_job job, const double *template_xyz, size_t count, double *covariance,
    uint8_t *evidence);

/** Moves prepared targets to the frame of this job, as defrec_job_warp_points() and
 *  defrec_job_point_covariances() do, faster: xyz, covariance (six values each, may be NULL),
 *  status and expected_error_mm (both may be NULL) per target. count is that of
 *  defrec_targets_count(). The first call of a frame, for any of its points, computes the body's
 *  motion.
 *  @errors DEFREC_ERROR_STATE: not done yet, or there is no template. DEFREC_ERROR_ARGUMENT:
 *  another count, or the frame's template is neither that of the targets nor one that it became by
 *  growing or by a cut. A failed job gives the error that it failed with.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_job_move_targets(
    defrec_job job, defrec_targets targets, size_t count, double *xyz, double *covariance,
    uint8_t *status, double *expected_error_mm);

/** @} */
/** @defgroup template Templates
 *  @{ */

/** The tracker's present template, or the one that was set and awaits its first frame.
 *  @errors DEFREC_ERROR_STATE: there is none yet.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_tracker_get_template(
    defrec_tracker tracker, defrec_template *out);
/** Tracks the template surface from the next submitted frame on; the rig must have the same
 *  rectified camera and size.
 *  @errors DEFREC_ERROR_ARGUMENT: it has not. DEFREC_ERROR_BUSY: another thread is inside the
 *  tracker.
 *  @threads one @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_tracker_set_template(
    defrec_tracker tracker, defrec_template surface);
/** Ends the use of the template surface; trackers that follow it go on.
 *  @threads any @since 1.0 */
DEFREC_API void DEFREC_CALL defrec_template_release(defrec_template surface);

/** A point of a line along which tissue came apart, 16 bytes. */
typedef struct defrec_cut_point {
    float    position[3]; /**< on the surface at rest, template frame, mm */
    uint32_t cut;         /**< which line, from 0; a line's points follow one another, those of
                               earlier lines come first */
} defrec_cut_point;

/** What a template consists of. The pointers live as long as the handle. */
typedef struct defrec_template_info {
    uint32_t                    struct_size;     /**< see DEFREC_INIT */
    uint32_t                    width, height;   /**< width and height of the rectified image it was
                                                      taken from, px */
    uint32_t                    reserved;        /**< 0 */
    defrec_camera               camera;          /**< rectified; the template frame is its */
    const defrec_surface_point *vertices;        /**< vertices of the surface */
    uint64_t                    vertex_count;    /**< vertices */
    const uint32_t             *triangles;       /**< three vertex indices each, counter-clockwise
                                                     seen from the camera; three times the same
                                                     where a cut crosses the triangle */
    uint64_t                    triangle_count;  /**< triangles */
    const float                *nodes;           /**< xyz per control point, template frame */
    uint64_t                    node_count;      /**< control points */
    const defrec_edge          *edges;           /**< connections between control points */
    uint64_t                    edge_count;      /**< edges */
    const defrec_landmark      *landmarks;       /**< features with a surface under them */
    uint64_t                    landmark_count;  /**< landmarks */
    const defrec_patch         *patches;         /**< what guided search looks for */
    uint64_t                    patch_count;     /**< patches */
    const uint8_t              *image;           /**< width * height gray values of the rectified
                                                     left image */
    const defrec_cut_point     *cut_points;      /**< points of the lines along which tissue came
                                                      apart, or slides */
    uint64_t                    cut_point_count; /**< cut points */
    const uint8_t              *vertex_pieces;   /**< piece of the surface per vertex, from 0: no
                                                     triangle and no edge leads from one to
                                                     another */
    uint64_t                    piece_count;     /**< pieces, at most 8 */
} defrec_template_info;
/** Describes the template surface.
 *  @errors none but those of every function.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_template_get(
    defrec_template surface, defrec_template_info *out);

/** Finds the points of the template surface under count pixels uv of the rectified left image that
 *  gave it: xyz, mm, template frame. found (1 or 0) per pixel: 0 where the template has no surface,
 *  xyz is then 0.
 *  @errors none but those of every function.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_template_lift(
    defrec_template surface, const double *uv, size_t count, double *xyz, uint8_t *found);

/** Which piece of the template surface each of count points template_xyz, mm, template frame,
 *  belongs to, on the surface or off it: pieces (0 .. piece_count - 1 of defrec_template_info) says
 *  with which vertices defrec_job_warp_points() moves it. 255 for a point that is not finite.
 *  @errors none but those of every function.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_template_point_pieces(
    defrec_template surface, const double *template_xyz, size_t count, uint8_t *pieces);

/** A triangle mesh in the template frame. Frozen. */
typedef struct defrec_mesh {
    const float    *vertices;       /**< xyz each, mm */
    uint64_t        vertex_count;   /**< number of vertices @range 0..1000000 */
    const uint32_t *triangles;      /**< three vertex indices each, counter-clockwise seen from
                                         outside */
    uint64_t        triangle_count; /**< number of triangles @range 0..1000000 */
} defrec_mesh;

/** Flags of defrec_body_region. */
enum {
    DEFREC_REGION_HELD = 1u << 0 /**< what lies in it is held: it moves with held_motion of
                                      defrec_frame, or with the deep tissue where that is not
                                      given */
};
/** A part of a body that is stiffer or softer than the rest, or held. Frozen. */
typedef struct defrec_body_region {
    defrec_mesh mesh;      /**< closed; what lies in it */
    float       stiffness; /**< Young's modulus relative to the rest of the body @default 1
                                @range 0.01..1000 */
    uint32_t    flags;     /**< DEFREC_REGION_* @range 0..DEFREC_REGION_HELD */
} defrec_body_region;

/** The elastic body that a template surface belongs to. */
typedef struct defrec_body_desc {
    uint32_t                  struct_size;   /**< see DEFREC_INIT */
    uint32_t                  flags;         /**< 0 */
    defrec_mesh               mesh;          /**< closed; the whole body's. Without vertices: the
                                                  tissue beneath the surface, whose extent is not
                                                  known */
    const defrec_body_region *regions;       /**< where regions overlap the last one counts */
    uint64_t                  region_count;  /**< number of regions @range 0..64 */
    float                     poisson_ratio; /**< Poisson's ratio of the tissue @default 0.43
                                                  @range 0.01..0.495 */
    float                     cut_depth_mm;  /**< how deep a cut parts the body @default 10
                                                  @range 0.1..1000 @unit mm */
} defrec_body_desc;

/** Sets the body that the template surface belongs to, from then on and in all trackers that follow
 *  it or what it becomes by growing or by a cut; NULL: the tissue beneath the surface. What desc
 *  points to is copied. A body that is being computed is given up, and that before is used until
 *  the new one is ready. Saved with the template.
 *  @errors DEFREC_ERROR_ARGUMENT: a field is out of range, or a mesh is not closed, is inside out,
 *  intersects itself, has a size that is not one in mm, or does not meet the surface; the error
 *  message says where.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_template_set_body(
    defrec_template surface, const defrec_body_desc *desc);
/** Waits at most timeout_ns for the body beneath the template surface to be ready; starts computing
 *  it where nobody has. What then is asked of a frame's points depends on the frames alone and not
 *  on time. DEFREC_OK: it is. DEFREC_TIMEOUT: not yet.
 *  @errors DEFREC_ERROR_UNSUPPORTED: no body can be made of it. DEFREC_ERROR_OUT_OF_MEMORY.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_template_wait_body(
    defrec_template surface, uint64_t timeout_ns);

/** Prepares count points template_xyz, mm, template frame, to be moved in many frames:
 *  defrec_job_move_targets(). They follow the template surface and what it becomes by growing or by
 *  a cut. Points that are not finite are unknown in every frame.
 *  @errors DEFREC_ERROR_ARGUMENT: count is above 1,000,000.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_targets_create(
    defrec_template surface, const double *template_xyz, size_t count, defrec_targets *out);
/** The number of targets. 0 for a bad handle.
 *  @threads any @since 1.0 */
DEFREC_API size_t DEFREC_CALL defrec_targets_count(defrec_targets targets);
/** Ends the use of the targets.
 *  @threads any @since 1.0 */
DEFREC_API void DEFREC_CALL defrec_targets_destroy(defrec_targets targets);

/** Writes the template surface to the file path. Nobody meets half a file: an older one is replaced
 *  when the new one is complete.
 *  @errors DEFREC_ERROR_IO: it cannot be written.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_template_save(
    defrec_template surface, const char *path);
/** Reads a template from the file path. Its layout is versioned and checked.
 *  @errors DEFREC_ERROR_IO: it cannot be read, or is damaged. DEFREC_ERROR_VERSION: its layout is
 *  another version's.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_template_load(
    defrec_context context, const char *path, defrec_template *out);

/** @} */
/** @defgroup registration Registration of a preoperative model
 *  Model frame: that of the model, such as a scan's, mm. Seen frame: that of what was seen,
 *  normally the template frame. docs/program/register.md says how it is computed, and cites.
 *  @{ */

/** Whether a registration or a hand-eye calibration may be used. */
enum {
    DEFREC_VERDICT_FAILED       = 0, /**< nothing fits the data */
    DEFREC_VERDICT_UNDETERMINED = 1, /**< the data leave a motion open: see free motions */
    DEFREC_VERDICT_AMBIGUOUS    = 2, /**< another pose fits as well: see alternatives */
    DEFREC_VERDICT_ACCEPTED     = 3  /**< one solution fits, and the data hold all its motions */
};
/** Kinds of motions that data do not tell from rest. */
enum {
    DEFREC_FREE_TURN  = 1, /**< a turn about an axis, with a shift along it */
    DEFREC_FREE_SHIFT = 2  /**< a shift alone */
};
/** A motion that the data of a registration or a hand-eye calibration do not tell from rest. */
typedef struct defrec_free_motion {
    uint32_t    struct_size;      /**< see DEFREC_INIT */
    uint32_t    kind;             /**< DEFREC_FREE_* */
    double      axis[3];          /**< unit length, seen frame; of a hand-eye calibration the
                                       marker's frame */
    double      point[3];         /**< on the axis of a turn, seen frame; of a hand-eye calibration
                                       the camera's place @unit mm */
    double      pitch_mm_per_rad; /**< shift along the axis for each rad of a turn @unit mm/rad */
    double      expected_mm;      /**< standard deviation of the shift, or of what a turn moves, at
                                       the typical distance of the data; 0: see expected_rad
                                       @unit mm */
    double      expected_rad;     /**< standard deviation of a hand-eye calibration's turn, else 0
                                       @unit rad */
    const char *text;             /**< for people: "turn about the axis (0 0 1) through (0 0 60)
                                       mm". Lives as long as the handle */
} defrec_free_motion;

/** Pairs of places of a model, and where they are seen. */
typedef struct defrec_registration_pairs {
    uint32_t      struct_size;      /**< see DEFREC_INIT */
    uint32_t      flags;            /**< 0 @range 0..0 */
    const double *model_xyz;        /**< xyz each, model frame, mm */
    const double *seen_xyz;         /**< xyz each, seen frame, mm */
    const double *model_covariance; /**< xx, xy, xz, yy, yz, zz of each place's error, model frame,
                                         mm^2; NULL: 0 */
    const double *seen_covariance;  /**< likewise of the seen place, seen frame. Both NULL or all
                                         0: errors are not known, and alike */
    uint64_t      count;            /**< number of pairs, at least 3 @range 0..1000000 */
    double        max_residual_mm;  /**< where the root mean square of the residuals is larger, the
                                         registration has failed @default 5 @range 0.001..100
                                         @unit mm */
    double        max_error_mm;     /**< a motion with a larger standard deviation is undetermined
                                         @default 2 @range 0.001..100 @unit mm */
} defrec_registration_pairs;

/** Flags of defrec_registration_desc. */
enum {
    DEFREC_REGISTRATION_NO_CAMERA = 1u << 0, /**< the surface was not seen from viewer: triangles
                                                  that turn away from it are compared as well */
    DEFREC_REGISTRATION_ELASTIC   = 1u << 1  /**< after the rigid motion the model is deformed as
                                                  an elastic body, where what was seen says how;
                                                  its surface must be closed */
};
/** Whether a registration deformed its model. */
enum {
    DEFREC_DEFORMATION_NOT_ASKED = 0, /**< without DEFREC_REGISTRATION_ELASTIC: a rigid motion */
    DEFREC_DEFORMATION_APPLIED   = 1, /**< the model was deformed */
    DEFREC_DEFORMATION_REFUSED   = 2  /**< the rigid motion is the result: what was seen supports
                                           no deformation. Errors that are told hold what it may
                                           hide */
};
/** A model's surface, what was seen of it, and where it lies about. */
typedef struct defrec_registration_desc {
    uint32_t        struct_size;          /**< see DEFREC_INIT */
    uint32_t        flags;                /**< DEFREC_REGISTRATION_* @range 0..3 */
    const float    *model_vertices;       /**< xyz each, model frame, mm */
    uint64_t        model_vertex_count;   /**< number of vertices @range 3..6000000 */
    const uint32_t *model_triangles;      /**< three vertex indices each, counter-clockwise seen
                                               from outside; a closed mesh that is inside out is
                                               turned */
    uint64_t        model_triangle_count; /**< number of triangles @range 1..2000000 */
    const float    *seen_vertices;        /**< xyz each, seen frame, mm */
    const float    *seen_normals;         /**< xyz each, towards the camera; 0 0 0: not known;
                                               NULL: none is known */
    const float    *seen_covariances;     /**< xx, xy, xz, yy, yz, zz of each point's error, seen
                                               frame, mm^2; NULL: see point_error_mm */
    const uint8_t  *seen_status;          /**< DEFREC_POINT_* each: those that are not
                                               DEFREC_POINT_OBSERVED are passed over; NULL: all
                                               count */
    uint64_t        seen_count;           /**< number of points, at least 50 that count
                                               @range 0..16777216 */
    double          start[12];            /**< about where the model lies: seen frame from model
                                               frame, 3x4 row-major, a rotation and mm; all 0: the
                                               identity */
    double          viewer[3];            /**< where the camera stood, seen frame: what turns away
                                               from there was not seen @unit mm */
    double          max_turn_rad;         /**< how far the start may be turned, about the middle of
                                               the points @default 0.5236 (30 degrees)
                                               @range 0..3.1416 @unit rad */
    double          max_shift_mm;         /**< how far it may be shifted @default 30 @range 0..500
                                               @unit mm */
    double          point_error_mm;       /**< standard deviation along each axis of points without
                                               a covariance @default 0.5 @range 0.001..100
                                               @unit mm */
    double          model_error_mm;       /**< standard deviation of the model's surface along its
                                               normal @default 0.2 @range 0..100 @unit mm */
    double          max_residual_mm;      /**< where the robust standard deviation of the residuals
                                               is larger, the registration has failed @default 3
                                               @range 0.001..100 @unit mm */
    double          min_inlier_share;     /**< where a smaller share of the points lies on the
                                               model, it has failed @default 0.4 @range 0..1 */
    double          max_error_mm;         /**< a motion with a larger standard deviation, root mean
                                               square over the points, is undetermined @default 2
                                               @range 0.001..100 @unit mm */
    uint32_t        starts;               /**< poses within max_turn_rad and max_shift_mm from
                                               which the search begins, the start included
                                               @default 20 @range 1..10000 */
    uint32_t        reserved;             /**< 0 */
    double          deformation_mm;       /**< how far the model's surface may be displaced against
                                               its rigid motion, root mean square: the prior's
                                               standard deviation; a larger deformation is refused.
                                               With DEFREC_REGISTRATION_ELASTIC @default 10
                                               @range 0.1..100 @unit mm */
} defrec_registration_desc;

/** Registers a model by the pairs in desc: Horn's closed form (J. Opt. Soc. Am. A 4, 1987), then
 *  least squares weighted by the covariances. What desc points to is copied. Pairs that contradict
 *  each other or lie in a line give a handle, whose verdict says so.
 *  @errors DEFREC_ERROR_ARGUMENT: a field is out of range, a coordinate is not finite, a covariance
 *  is none, or errors are stated of some pairs alone.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_registration_from_pairs(
    const defrec_registration_pairs *desc, defrec_registration *out);
/** Registers the model's surface in desc to the points that were seen of it: point to plane,
 *  robust, from several starts (docs/program/register.md), with the context's threads. The result
 *  does not depend on how many there are. What desc points to is copied. A surface that fits
 *  nowhere, in several places or leaves a motion open gives a handle, whose verdict says so; so
 *  does a deformation that was asked for and refused.
 *  @errors DEFREC_ERROR_ARGUMENT: a field is out of range, an array is NULL, a number is not
 *  finite, a covariance is none, there are fewer than 50 points, or the model has no surface or a
 *  size that is not one in mm, or, with DEFREC_REGISTRATION_ELASTIC, is no closed surface of a
 *  body; the error message begins with "the model" where the model is at fault.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_registration_from_surface(
    defrec_context context, const defrec_registration_desc *desc, defrec_registration *out);
/** Likewise, to the vertices of the template surface whose depth was measured, with the errors that
 *  stereo leaves at their depth, or point_error_mm where desc gives it; with the context's threads.
 *  desc names no seen points: its seen_count is 0. The seen frame is the template frame.
 *  @errors as defrec_registration_from_surface(); DEFREC_ERROR_ARGUMENT: desc names seen points.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_registration_from_template(
    defrec_context context, defrec_template surface, const defrec_registration_desc *desc,
    defrec_registration *out);
/** Ends the use of the registration.
 *  @threads any @since 1.0 */
DEFREC_API void DEFREC_CALL defrec_registration_destroy(defrec_registration registration);

/** Where a model lies. The pointers live as long as the handle. */
typedef struct defrec_registration_info {
    uint32_t        struct_size;       /**< see DEFREC_INIT */
    uint32_t        verdict;           /**< DEFREC_VERDICT_*: use nothing else but
                                               DEFREC_VERDICT_ACCEPTED without a person's look */
    const char     *reason;            /**< the verdict's, one sentence for people */
    double          transform[12];     /**< seen frame from model frame, 3x4 row-major, a
                                               rotation and mm; of a failed one the best pose that
                                               was found; of a deformed model the rigid part of its
                                               motion: defrec_registration_move_points() has all of
                                               it */
    double          covariance[36];    /**< 6x6 row-major, of the motion that the true transform
                                               has after this one: a turn about x, y, z of the seen
                                               frame and about its origin, rad, then a shift, mm;
                                               along free motions at least (1000 mm)^2 */
    double          rms_mm;            /**< root mean square of the inliers' residuals @unit mm */
    double          robust_mm;         /**< robust standard deviation of all residuals
                                               @unit mm */
    double          error_ratio;       /**< that of the residuals in units of their expected
                                               errors */
    double          inlier_share;      /**< 0..1 of what was compared */
    double          correlated;        /**< so many neighbours share an error */
    uint64_t        used;              /**< points or pairs that were compared */
    const float    *residuals;         /**< per point or pair given: along the model's outside
                                               normal, of a pair its length, mm; NaN where it was
                                               not compared @count point_count */
    const uint8_t  *inliers;           /**< per point or pair given: 1 where it fits
                                               @count point_count */
    uint64_t        point_count;       /**< points or pairs that were given; of a template its
                                               vertices */
    const uint32_t *triangles;         /**< three vertex indices each: those of the model that
                                               have an area, turned outwards @count triangle_count
                                               @components 3 */
    uint64_t        triangle_count;    /**< triangles; 0 of a registration by pairs */
    uint64_t        dropped_triangles; /**< triangles of the model without an area */
    uint64_t        open_edges;        /**< edges of one triangle: the model is not closed */
    uint64_t        odd_edges;         /**< edges of more than two triangles, or of two that turn
                                               differently */
    uint32_t        model_turned;      /**< 1: the model was inside out */
    uint32_t        model_has_outside; /**< 1: it tells its outside, so that its back is not
                                               taken for its front */
    uint64_t        free_motion_count; /**< see defrec_registration_get_free_motion() */
    uint64_t        alternative_count; /**< see defrec_registration_get_alternative() */
    uint32_t        deformation;       /**< DEFREC_DEFORMATION_* */
    uint32_t        reserved;          /**< 0 */
    const char     *deformation_text;  /**< why, one sentence for people; "" where none was asked
                                               for */
    double          deformed_rms_mm;   /**< root mean square displacement of the model's vertices
                                               against the transform; this and the next two 0 where
                                               the model was not deformed @unit mm */
    double          deformed_max_mm;   /**< the largest displacement @unit mm */
    double          largest_strain;    /**< the largest share by which the body is stretched or
                                               compressed along a direction */
    double          rigid_rms_mm;      /**< rms_mm before the deformation, of the rigid motion
                                               @unit mm */
    double          rigid_robust_mm;   /**< likewise robust_mm @unit mm */
} defrec_registration_info;
/** Describes the registration.
 *  @errors none but those of every function.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_registration_get(
    defrec_registration registration, defrec_registration_info *out);
/** Motion number index, from 0, that the data of the registration leave open.
 *  @errors DEFREC_ERROR_ARGUMENT: there is none of that index.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_registration_get_free_motion(
    defrec_registration registration, size_t index, defrec_free_motion *out);

/** Another pose that fits about as well. */
typedef struct defrec_registration_alternative {
    uint32_t struct_size;   /**< see DEFREC_INIT */
    uint32_t reserved;      /**< 0 */
    double   transform[12]; /**< as in defrec_registration_info */
    double   distance_mm;   /**< root mean square by which it moves the points against the transform
                                 that was chosen @unit mm */
    double   rms_mm;        /**< as in defrec_registration_info @unit mm */
    double   inlier_share;  /**< as in defrec_registration_info */
} defrec_registration_alternative;
/** Other pose number index, from 0, of the registration, the one that fits best first.
 *  @errors DEFREC_ERROR_ARGUMENT: there is none of that index.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_registration_get_alternative(
    defrec_registration registration, size_t index, defrec_registration_alternative *out);

/** Moves count points model_xyz, mm, of the model frame by the registration to the seen frame, xyz:
 *  by the transform, or with the model's body where it was deformed. covariance: of each the
 *  error's xx, xy, xz, yy, yz, zz, seen frame, mm^2, J C J^T with J = [-[x] 1] at xyz x and the
 *  covariance C of defrec_registration_info, of a deformed model with what is not known of its
 *  shape as well; expected_error_mm, the target registration error: the root of its trace; both may
 *  be NULL. A point that is not finite comes out as NaN. model_xyz and xyz may be the same memory.
 *  @errors none but those of every function.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_registration_move_points(
    defrec_registration registration, const double *model_xyz, size_t count, double *xyz,
    double *covariance, double *expected_error_mm);

/** @} */
/** @defgroup plan Plans
 *  A preoperative model and targets, registered to a template once, kept in a file and followed in
 *  each frame. docs/api/plan.md is the guide.
 *  @{ */

/** Flags of defrec_plan_desc. */
enum {
    DEFREC_PLAN_LOOKED_AT = 1u << 0 /**< a person has looked at the registration: its verdict may
                                         be another than DEFREC_VERDICT_ACCEPTED, but for
                                         DEFREC_VERDICT_FAILED */
};
/** A named part of a plan's model: a tumour, a vessel. Frozen. */
typedef struct defrec_plan_part {
    const char *name;           /**< UTF-8, 1 to 255 bytes */
    uint64_t    first_triangle; /**< index of its first triangle */
    uint64_t    triangle_count; /**< its triangles follow one another */
} defrec_plan_part;

/** What a plan consists of; model frame, mm. Vertices and targets together are at most 1,000,000
 *  points. */
typedef struct defrec_plan_desc {
    uint32_t                struct_size;    /**< see DEFREC_INIT */
    uint32_t                flags;          /**< DEFREC_PLAN_* @range 0..DEFREC_PLAN_LOOKED_AT */
    const float            *vertices;       /**< xyz each */
    uint64_t                vertex_count;   /**< number of vertices @range 0..1000000 */
    const uint32_t         *triangles;      /**< three vertex indices each */
    uint64_t                triangle_count; /**< number of triangles @range 0..2000000 */
    const defrec_plan_part *parts;          /**< may share triangles */
    uint64_t                part_count;     /**< number of parts @range 0..1000 */
    const double           *targets;        /**< xyz each */
    uint64_t                target_count;   /**< number of targets @range 0..1000000 */
    const char *const      *target_names;   /**< name of each, UTF-8, at most 255 bytes; "" for
                                                 one without, else no two alike. NULL: none has
                                                 one */
} defrec_plan_desc;

/** Makes a plan of what desc describes and where the registration says that it lies; its seen frame
 *  is the template frame of surface. What desc points to is copied, and the registration may be
 *  destroyed. The plan follows the template surface and what it becomes by growing or by a cut.
 *  @errors DEFREC_ERROR_ARGUMENT: the verdict of the registration is not one that flags allow, a
 *  field is out of range, a number is not finite, an index is out of range, a part has no name, or
 *  two targets have the same one.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_plan_create(
    defrec_template surface, defrec_registration registration, const defrec_plan_desc *desc,
    defrec_plan *out);
/** Writes the plan to the file path, with a fingerprint of its template's first view. Nobody meets
 *  half a file: an older one is replaced when the new one is complete.
 *  @errors DEFREC_ERROR_IO: it cannot be written.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_plan_save(defrec_plan plan, const char *path);
/** Reads a plan from the file path, for the template surface that it was made for: the same object,
 *  what it became, one that was saved and loaded, or one of the same first view. Its layout is
 *  versioned and checked.
 *  @errors DEFREC_ERROR_IO: it cannot be read, or is damaged. DEFREC_ERROR_VERSION: its layout is
 *  another version's. DEFREC_ERROR_ARGUMENT: it was made for another template.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_plan_load(
    defrec_template surface, const char *path, defrec_plan *out);
/** Ends the use of the plan.
 *  @threads any @since 1.0 */
DEFREC_API void DEFREC_CALL defrec_plan_destroy(defrec_plan plan);

/** A plan, at rest. Points are its vertices, then its targets. The pointers live as long as the
 *  handle. */
typedef struct defrec_plan_info {
    uint32_t                struct_size;           /**< see DEFREC_INIT */
    uint32_t                verdict;               /**< DEFREC_VERDICT_*, of the registration */
    double                  transform[12];         /**< as in defrec_registration_info */
    double                  covariance[36];        /**< as in defrec_registration_info */
    const float            *vertices;              /**< xyz each, model frame, mm
                                                        @count vertex_count @components 3 */
    uint64_t                vertex_count;          /**< vertices */
    const uint32_t         *triangles;             /**< three vertex indices each
                                                        @count triangle_count @components 3 */
    uint64_t                triangle_count;        /**< triangles */
    const defrec_plan_part *parts;                 /**< named parts */
    uint64_t                part_count;            /**< parts */
    const double           *targets;               /**< xyz each, model frame, mm
                                                        @count target_count @components 3 */
    uint64_t                target_count;          /**< targets */
    const double           *template_xyz;          /**< xyz of each point, template frame, mm
                                                        @count point_count @components 3 */
    const double           *registration_error_mm; /**< target registration error of each
                                                        point, mm @count point_count */
    uint64_t                point_count;           /**< vertices and targets */
    uint32_t                deformed;              /**< 1: the registration deformed the model:
                                                        template_xyz is not what transform makes of
                                                        it */
    uint32_t                reserved;              /**< 0 */
    const char *const      *target_names;          /**< name of each target; "" for one without
                                                        @count target_count */
} defrec_plan_info;
/** Describes the plan.
 *  @errors none but those of every function.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_plan_get(defrec_plan plan, defrec_plan_info *out);

/** Moves the points of the plan to the frame of this job, as defrec_job_move_targets() does, with
 *  the error of the registration added to that of tracking: xyz, covariance (six values each: that
 *  of tracking and R P R^T, with P as defrec_registration_move_points() gives it and R the
 *  tissue's rotation since the template; may be NULL), status and expected_error_mm (the root of
 *  the trace; both may be NULL) per point. count is point_count of defrec_plan_info.
 *  @errors DEFREC_ERROR_STATE: not done yet, or there is no template. DEFREC_ERROR_ARGUMENT:
 *  another count, or the frame's template is neither that of the plan nor one that it became by
 *  growing or by a cut. A failed job gives the error that it failed with.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_job_move_plan(
    defrec_job job, defrec_plan plan, size_t count, double *xyz, double *covariance,
    uint8_t *status, double *expected_error_mm);

/** Carries count points camera_xyz, mm, from the rectified camera of the job's frame, as vertices
 *  of its result and the functions above give them, to the fixed frame of the frame's camera_pose:
 *  xyz, mm; the two may be the same memory. camera_covariance: of each the error's xx, xy, xz, yy,
 *  yz, zz, as given by those functions, mm^2; NULL: none. pose_covariance: 6x6 row-major, of the
 *  motion that the true camera_pose has after the one that was given: a turn about x, y, z of the
 *  fixed frame and about the camera's place, rad, then a shift, mm, see
 *  defrec_hand_eye_pose_covariance(); NULL: the pose is exact. covariance: six values each of the
 *  sum, R C R^T + J P J^T, in the fixed frame, mm^2, the root of whose trace is the expected
 *  error; may be NULL. The pose's share is common to all points of a frame. A point that is not
 *  finite comes out as NaN. The job need not be done.
 *  @errors DEFREC_ERROR_STATE: the frame was submitted without DEFREC_FRAME_CAMERA_POSE.
 *  DEFREC_ERROR_ARGUMENT: pose_covariance is no covariance.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_job_to_fixed_frame(
    defrec_job job, const double *pose_covariance, size_t count, const double *camera_xyz,
    const double *camera_covariance, double *xyz, double *covariance);

/** @} */
/** @defgroup hand_eye Hand-eye calibration
 *  Marker: what a navigation system sees on the camera. World: where the camera's own poses are,
 *  such as a board, fixed to the navigation system. docs/program/handeye.md says how it is
 *  computed, and cites.
 *  @{ */

/** Flags of defrec_hand_eye_desc. */
enum {
    DEFREC_HAND_EYE_PAIRED       = 1u << 0, /**< pose i of both belong together, whatever their
                                                 times */
    DEFREC_HAND_EYE_KNOWN_OFFSET = 1u << 1  /**< offset_s is given: it is not estimated */
};
/** Poses of a camera and of the marker on it, as many as there are of each, or two streams with
 *  times. */
typedef struct defrec_hand_eye_desc {
    uint32_t      struct_size;        /**< see DEFREC_INIT */
    uint32_t      flags;              /**< DEFREC_HAND_EYE_* @range 0..3 */
    const double *camera_poses;       /**< world from camera, 3x4 row-major each, a rotation and
                                           mm */
    const double *camera_times_s;     /**< time of each, growing; may be NULL with
                                           DEFREC_HAND_EYE_PAIRED @unit s */
    uint64_t      camera_count;       /**< number of the camera's poses @range 1..4194304 */
    const double *tracker_poses;      /**< navigation system from marker, 3x4 row-major each, a
                                           rotation and mm */
    const double *tracker_times_s;    /**< likewise, by the navigation system's clock @unit s */
    uint64_t      tracker_count;      /**< number of the marker's poses @range 1..4194304 */
    double        camera_error_mm;    /**< standard deviation along each axis of the camera's
                                           places. All four errors or none: then the residuals say
                                           how large they are @range 0..100 @unit mm */
    double        camera_error_rad;   /**< likewise of its rotations @range 0..1 @unit rad */
    double        tracker_error_mm;   /**< likewise of the marker's places @range 0..100 @unit mm */
    double        tracker_error_rad;  /**< likewise of its rotations @range 0..1 @unit rad */
    double        offset_s;           /**< with DEFREC_HAND_EYE_KNOWN_OFFSET: the navigation
                                           system's time is the camera's plus it @unit s */
    double        max_offset_s;       /**< how far the offset is searched @default 2
                                           @range 0..3600 @unit s */
    double        max_residual_mm;    /**< where the root mean square of the residuals of places is
                                           larger, the calibration has failed @default 3
                                           @range 0.001..1000 @unit mm */
    double        max_residual_rad;   /**< likewise of rotations @default 0.0349 (2 degrees)
                                           @range 0.00001..3.1416 @unit rad */
    double        max_error_mm;       /**< a motion with a larger standard deviation, 100 mm from
                                           the camera, is undetermined @default 1
                                           @range 0.001..1000 @unit mm */
    double        max_offset_error_s; /**< likewise the offset @default 0.01 @range 0.000001..10
                                           @unit s */
} defrec_hand_eye_desc;

/** Finds where the camera is on its marker from the poses in desc, A X = Z B: Park and Martin's
 *  closed form (IEEE Trans. Robotics and Automation 10, 1994), then least squares
 *  (docs/program/handeye.md). What desc points to is copied. Poses that fit nothing, or do not
 *  determine it, give a handle, whose verdict says so.
 *  @errors DEFREC_ERROR_ARGUMENT: a field is out of range, an array is NULL, a pose is no rotation
 *  and translation, times are not finite or do not grow, some of the four errors are given but not
 *  all, or counts differ with DEFREC_HAND_EYE_PAIRED.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_hand_eye_create(
    const defrec_hand_eye_desc *desc, defrec_hand_eye *out);
/** Ends the use of the hand_eye calibration.
 *  @threads any @since 1.0 */
DEFREC_API void DEFREC_CALL defrec_hand_eye_destroy(defrec_hand_eye hand_eye);

/** Where a camera is on its marker. The pointers live as long as the handle. */
typedef struct defrec_hand_eye_info {
    uint32_t       struct_size;            /**< see DEFREC_INIT */
    uint32_t       verdict;                /**< DEFREC_VERDICT_*: never DEFREC_VERDICT_AMBIGUOUS */
    const char    *reason;                 /**< the verdict's, one sentence for people */
    const char    *notes;                  /**< remarks for people, a line each; "" without */
    double         marker_from_camera[12]; /**< 3x4 row-major, a rotation and mm */
    double         tracker_from_world[12]; /**< the camera's world in the navigation system, 3x4
                                                row-major, a rotation and mm */
    double         covariance[36];         /**< 6x6 row-major, of the motion that the true
                                                marker_from_camera has after this one: a turn about
                                                x, y, z of the marker's frame and about its origin,
                                                rad, then a shift, mm; along free motions
                                                (1000 mm)^2 is added. NaN: nothing was solved */
    uint32_t       is_solved;              /**< 1: transforms, covariance and residuals are those of
                                                the best solution; 0: it was refused before, and
                                                they are the identity, NaN and NULL */
    uint32_t       offset_estimated;       /**< 1: the offset was estimated */
    double         offset_s;               /**< the navigation system's time is the camera's plus
                                                it @unit s */
    double         offset_sigma_s;         /**< its standard deviation @unit s */
    double         offset_correlation;     /**< correlation of both speeds of rotation, -1..1 */
    double         rms_mm, rms_rad;        /**< root mean squares of the residuals at the camera, of
                                                the poses that fit, mm and rad */
    double         error_ratio;            /**< residuals in units of the errors */
    double         camera_error_mm;        /**< the errors as stated or estimated @unit mm */
    double         camera_error_rad;       /**< likewise @unit rad */
    double         tracker_error_mm;       /**< likewise @unit mm */
    double         tracker_error_rad;      /**< likewise @unit rad */
    double         correlated;             /**< so many neighbours share an error */
    double         turn_rad;               /**< root mean square of the rotations against their
                                                mean @unit rad */
    double         cross_turn_rad;         /**< that of their parts across the main axis
                                                @unit rad */
    double         length_factor;          /**< what lengths of the camera's world are to be
                                                multiplied by to be the navigation system's; not
                                                applied */
    double         length_factor_sigma;    /**< its standard deviation */
    uint64_t       used;                   /**< poses of the camera that were used */
    uint64_t       inlier_count;           /**< those of them that fit */
    const double  *residuals_mm;           /**< per pose of the camera: how far off it is; NaN
                                                where it was not used @count residual_count */
    const double  *residuals_rad;          /**< likewise its rotation @count residual_count */
    const uint8_t *inliers;                /**< per pose of the camera: 1 where it fits
                                                @count residual_count */
    uint64_t       residual_count;         /**< poses of the camera that were given; 0 where nothing
                                                was solved */
    uint64_t       free_motion_count;      /**< see defrec_hand_eye_get_free_motion() */
} defrec_hand_eye_info;
/** Describes the hand_eye calibration.
 *  @errors none but those of every function.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_hand_eye_get(
    defrec_hand_eye hand_eye, defrec_hand_eye_info *out);
/** Motion number index, from 0, of the transform that the poses of the hand_eye calibration leave
 *  open.
 *  @errors DEFREC_ERROR_ARGUMENT: there is none of that index.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_hand_eye_get_free_motion(
    defrec_hand_eye hand_eye, size_t index, defrec_free_motion *out);

/** How far off the camera's pose may be that defrec_hand_eye_camera_pose() gives, by the hand_eye
 *  calibration, for each of count poses of its marker: marker_pose is navigation system from
 *  marker, 3x4 row-major each; pose_covariance is 6x6 row-major each, what
 *  defrec_job_to_fixed_frame() takes. It adds to the covariance of the calibration that of the
 *  marker's pose itself, by tracker_error_mm and tracker_error_rad of defrec_hand_eye_info.
 *  @errors DEFREC_ERROR_STATE: the verdict is not DEFREC_VERDICT_ACCEPTED. DEFREC_ERROR_ARGUMENT: a
 *  pose is no rotation and translation.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_hand_eye_pose_covariance(
    defrec_hand_eye hand_eye, const double *marker_pose, size_t count, double *pose_covariance);

/** Where the camera is, by the hand_eye calibration, for each of count poses of its marker:
 *  marker_pose is navigation system from marker, 3x4 row-major each, a rotation and mm; camera_pose
 *  is navigation system from camera likewise, what camera_pose of defrec_frame takes where the
 *  calibration is of the rectified camera. The two may be the same memory.
 *  @errors DEFREC_ERROR_STATE: the verdict is not DEFREC_VERDICT_ACCEPTED. DEFREC_ERROR_ARGUMENT: a
 *  pose is no rotation and translation.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_hand_eye_camera_pose(
    defrec_hand_eye hand_eye, const double *marker_pose, size_t count, double *camera_pose);

/** @} */
/** @defgroup predictor Points at the time of display
 *  A frame is shown later than it was taken. A predictor says where points are then, from how they
 *  moved in the frames until it. docs/api/display.md says how it is computed, cites, and says what
 *  the expected error means.
 *  @{ */

/** How far after the last frame a predictor says where points are. */
enum { DEFREC_MAX_PREDICTION_MS = 100 /**< milliseconds */ };
/** Basis of a point's prediction. */
enum {
    DEFREC_PREDICTED_LAST     = 0, /**< its position in the last frame: it was not followed long
                                        enough, jumped, or nothing predicted better lately */
    DEFREC_PREDICTED_VELOCITY = 1, /**< likewise its velocity, damped */
    DEFREC_PREDICTED_LEARNED  = 2  /**< its motion of the last 24 steps of about 1/30 s, by
                                        coefficients that were learned from the motion of all
                                        points: beat and breath */
};

/** Description of a predictor. */
typedef struct defrec_predictor_desc {
    uint32_t struct_size; /**< see DEFREC_INIT */
    uint32_t flags;       /**< 0 @range 0..0 */
    uint64_t point_count; /**< number of points, the same ones in all frames @range 1..1000000 */
} defrec_predictor_desc;

/** Makes a predictor of points as desc has them. It takes about 1 KB a point at 30 frames/s, more
 *  at a higher rate, up to 8 KB.
 *  @errors DEFREC_ERROR_ARGUMENT: a field is out of range.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_predictor_create(
    const defrec_predictor_desc *desc, defrec_predictor *out);
/** Ends the use of the predictor.
 *  @threads any @since 1.0 */
DEFREC_API void DEFREC_CALL defrec_predictor_destroy(defrec_predictor predictor);

/** Places of the points in a frame: what defrec_job_warp_points(), defrec_job_move_targets() or
 *  defrec_job_move_plan() gave, or the same in another frame of reference that does not move. */
typedef struct defrec_predictor_frame {
    uint32_t       struct_size;       /**< see DEFREC_INIT */
    uint32_t       state;             /**< DEFREC_INITIALISING ...: state of defrec_result. In a
                                           frame that is lost or has no template all points are
                                           unknown, whatever status says */
    uint32_t       epoch;             /**< epoch of defrec_result */
    uint32_t       reserved;          /**< 0 @range 0..0 */
    int64_t        timestamp_ns;      /**< time of the frame, after that of the frame before
                                           @unit ns */
    const double  *xyz;               /**< xyz each, mm; numbers up to 1e6 but for unknown points.
                                           NULL in a frame that is lost or has no template: not
                                           given */
    const uint8_t *status;            /**< DEFREC_POINT_* each; NULL likewise */
    const double  *expected_error_mm; /**< expected error of each; finite and not negative but for
                                           unknown points; NULL: 0 */
    uint64_t       count;             /**< number of points: point_count of
                                           defrec_predictor_desc */
} defrec_predictor_frame;

/** Tells the predictor where the points were in a frame. Each frame of a sequence, in the order of
 *  time, also those that are lost. What frame points to is copied. Motion before a frame that is
 *  lost, has no template or another epoch, or comes after a gap of more than 3.5 frames and 0.1 s,
 *  is forgotten; so is that of a point before it was unknown, or jumped.
 *  @errors DEFREC_ERROR_ARGUMENT: another count than the predictor's, the time does not grow, an
 *  array is NULL where it may not be, there is no such status, or a number is not finite, a place
 *  too far or an error negative; the predictor stays as it was.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_predictor_add_frame(
    defrec_predictor predictor, const defrec_predictor_frame *frame);

/** Places of the points of the predictor at the time timestamp_ns, that of the last frame to
 *  DEFREC_MAX_PREDICTION_MS after it, of the same clock. count is that of the predictor. Per point:
 *  xyz, mm; status (DEFREC_POINT_*), that of the last frame; expected_error_mm, the root mean
 *  square of the error to be expected, that of the last frame and never less later; basis
 *  (DEFREC_PREDICTED_*), what the prediction rests on. All but xyz may be NULL. A point that is
 *  unknown in the last frame stays so, with the position and error that were given there, or NaN.
 *  @errors DEFREC_ERROR_STATE: no frame was added yet. DEFREC_ERROR_ARGUMENT: another count, or the
 *  time is before the last frame or more than DEFREC_MAX_PREDICTION_MS after it: show that the
 *  points are not known.
 *  @threads any @since 1.0 */
DEFREC_API defrec_status DEFREC_CALL defrec_predictor_predict(
    defrec_predictor predictor, int64_t timestamp_ns, size_t count, double *xyz, uint8_t *status,
    double *expected_error_mm, uint8_t *basis);

/** @} */

#ifdef __cplusplus
}
#endif
#endif
