/** @file
 *  What a backend plugin implements.
 *
 *  A plugin exports one symbol, defrec_plugin_entry_v1. The 1 is the ABI's major version: an
 *  incompatible ABI gets another symbol, so a plugin of another major version is refused before any
 *  of its code is called. Minor versions only add members at the end of a table; a table's
 *  struct_size says which members exist (DEFREC_HAS).
 *
 *  Every function: may be called from any thread unless marked "one per queue", never throws, and
 *  leaves its outputs alone when it fails. What a table creates, the same table destroys; no memory
 *  crosses the border to be freed on the other side. Parameters arrive checked and with every
 *  default filled in; records and parameters are those of defrec_c.h, and docs/stages.md defines
 *  each stage, its buffers and their order. docs/backends/plugins.md tells how to write a plugin.
 */
#ifndef DEFREC_PLUGIN_H
#define DEFREC_PLUGIN_H
#include "defrec_c.h"
#ifdef __cplusplus
extern "C" {
#endif

/** @defgroup plugin The plugin ABI
 *  @{ */

#define DEFREC_PLUGIN_ABI_MAJOR 1 /**< the entry's number */
#define DEFREC_PLUGIN_ABI_MINOR 0 /**< this header's */

/** 1 if a table of the other side's size has the member and it is not NULL. */
#define DEFREC_HAS(table, member)                                     \
  ((size_t)((const char *)&(table)->member - (const char *)(table)) + \
           sizeof(table)->member <=                                   \
       (table)->struct_size &&                                        \
   (table)->member != NULL)

/** What the host offers. Lives until shutdown has returned. */
typedef struct defrec_host {
    uint32_t struct_size; /**< size of the host's table, bytes */
    uint32_t abi_minor;   /**< the host's DEFREC_PLUGIN_ABI_MINOR */
    void    *self;        /**< goes first into each of its functions */
    /** Level: DEFREC_LOG_*. */
    void(DEFREC_CALL *log)(void *self, int32_t level, const char *text);
    /** The error message behind a negative status, this thread. */
    void(DEFREC_CALL *error)(void *self, const char *text);
    /** NULL when out of memory */
    void *(DEFREC_CALL *alloc)(void *self, size_t size, size_t alignment);
    void(DEFREC_CALL *free)(void *self, void *ptr); /**< takes back what alloc gave */
    /** Calls body(arg, 0..count-1), each once, on any threads, and returns when all have returned.
     *  Not re-entrant. */
    void(DEFREC_CALL *parallel_for)(
        void *self, size_t count, void(DEFREC_CALL *body)(void *arg, size_t index), void *arg);
    uint32_t(DEFREC_CALL *concurrency)(void *self); /**< threads parallel_for uses, at least 1 */
} defrec_host;

typedef struct defrec_pdevice_ defrec_pdevice; /**< an opened device */
typedef struct defrec_pqueue_  defrec_pqueue;  /**< in-order work on a device */
typedef struct defrec_pbuffer_ defrec_pbuffer; /**< memory the device can use */
typedef struct defrec_pstage_  defrec_pstage;  /**< a stage made for one size and one set of
                                                    parameters */

/** One stage of a plugin. What it makes is used by one queue at a time: calls for another queue
 *  follow only when its work in the one before has been waited for. */
typedef struct defrec_stage_table {
    uint32_t struct_size;   /**< size of the plugin's table, bytes */
    uint32_t stage;         /**< DEFREC_STAGE_* */
    uint32_t stage_version; /**< version of the stage's definition in docs/stages.md */
    uint32_t reserved;      /**< 0 */
    /** DEFREC_OK, or DEFREC_ERROR_UNSUPPORTED with the limit in the error text. */
    defrec_status(DEFREC_CALL *supports)(defrec_pdevice *device, const void *params);
    /** Allocates everything that prepare and enqueue need for the counts and sizes in params. */
    defrec_status(DEFREC_CALL *create)(
        defrec_pdevice *device, const void *params, defrec_pstage **out);
    void(DEFREC_CALL *destroy)(defrec_pstage *stage); /**< waits for its work */
    /** Queues reading the inputs that stay the same from run to run; may allocate. NULL where the
     *  stage has none.
     *  @threads one per queue */
    defrec_status(DEFREC_CALL *prepare)(
        defrec_pstage *stage, defrec_pqueue *queue, defrec_pbuffer *const *in, size_t in_count);
    /** Queues the stage's work and returns; never allocates. The order of the buffers is the
     *  stage's definition; optional ones may be NULL. Buffers are at least as large as the
     *  definition says.
     *  @threads one per queue */
    defrec_status(DEFREC_CALL *enqueue)(
        defrec_pstage *stage, defrec_pqueue *queue, defrec_pbuffer *const *in, size_t in_count,
        defrec_pbuffer *const *out, size_t out_count);
} defrec_stage_table;

/** What the plugin offers. */
typedef struct defrec_plugin {
    uint32_t    struct_size;                       /**< size of the plugin's table, bytes */
    uint32_t    abi_minor;                         /**< the plugin's DEFREC_PLUGIN_ABI_MINOR; the
                                                        manifest says the same */
    const char *name;                              /**< the manifest's */
    const char *version;                           /**< the plugin's own */
    const char *vendor;                            /**< for people */
    void       *self;                              /**< goes first into the functions that have no
                                                        device or queue */
    size_t(DEFREC_CALL *device_count)(void *self); /**< 0 without a driver */
    /** Describes device number index; its strings live until shutdown. Failing leaves it out. */
    defrec_status(DEFREC_CALL *device_info)(void *self, size_t index, defrec_device_info *out);
    /** Each time another handle. */
    defrec_status(DEFREC_CALL *device_open)(void *self, size_t index, defrec_pdevice **out);
    /** After all that was made of it is gone. */
    void(DEFREC_CALL *device_close)(defrec_pdevice *device);
    /** Contents: zero. */
    defrec_status(DEFREC_CALL *buffer_create)(
        defrec_pdevice *device, uint64_t size, defrec_pbuffer **out);
    /** Waits for work that uses it. */
    void(DEFREC_CALL *buffer_destroy)(defrec_pbuffer *buffer);
    /** Without work. */
    defrec_status(DEFREC_CALL *queue_create)(defrec_pdevice *device, defrec_pqueue **out);
    /** Waits for its work. */
    void(DEFREC_CALL *queue_destroy)(defrec_pqueue *queue);
    /** Queues a copy from src, which is read before write returns.
     *  @threads one per queue */
    defrec_status(DEFREC_CALL *write)(
        defrec_pqueue *queue, defrec_pbuffer *buffer, uint64_t offset, const void *src,
        uint64_t size);
    /** Queues a copy to dst, which is complete once a later signal has been waited for.
     *  @threads one per queue */
    defrec_status(DEFREC_CALL *read)(
        defrec_pqueue *queue, defrec_pbuffer *buffer, uint64_t offset, void *dst, uint64_t size);
    /** Gives a point after all work so far; each is larger than the one before.
     *  @threads one per queue */
    defrec_status(DEFREC_CALL *signal)(defrec_pqueue *queue, uint64_t *out_value);
    /** Waits for a point that signal gave; DEFREC_TIMEOUT: not yet.
     *  @threads any */
    defrec_status(DEFREC_CALL *wait)(defrec_pqueue *queue, uint64_t value, uint64_t timeout_ns);
    /** NULL: not offered */
    const defrec_stage_table *(DEFREC_CALL *stage)(void *self, uint32_t stage);
    void(DEFREC_CALL *shutdown)(void *self); /**< last call; joins every thread */

    /** Memory of the host that the device's copies reach without a detour (page-locked, say),
     *  64-byte aligned, zero. As src of write_in_place and dst of read nothing is copied in
     *  between: such a dst may be written as soon as the device gets there. May be NULL. */
    defrec_status(DEFREC_CALL *host_alloc)(defrec_pdevice *device, uint64_t size, void **out);
    /** No work of a queue uses it any more. NULL where host_alloc is. */
    void(DEFREC_CALL *host_free)(defrec_pdevice *device, void *memory);
    /** As write, but src must stay as it is until a later signal has been waited for. May be NULL.
     *  @threads one per queue */
    defrec_status(DEFREC_CALL *write_in_place)(
        defrec_pqueue *queue, defrec_pbuffer *buffer, uint64_t offset, const void *src,
        uint64_t size);
    /** The caller's memory as a buffer, without a copy; contents stay. kind: DEFREC_MEMORY_*. The
     *  memory begins at a multiple of 16 and must outlive the buffer. DEFREC_ERROR_UNSUPPORTED for
     *  a kind that the device cannot reach, DEFREC_ERROR_ARGUMENT for memory that is not of that
     *  kind. May be NULL. */
    defrec_status(DEFREC_CALL *buffer_import)(
        defrec_pdevice *device, uint32_t kind, void *memory, uint64_t size, defrec_pbuffer **out);
} defrec_plugin;

/** @def DEFREC_PLUGIN_EXPORT
 *  Exports the entry. */
#if defined(_WIN32)
#  define DEFREC_PLUGIN_EXPORT __declspec(dllexport)
#else
#  define DEFREC_PLUGIN_EXPORT __attribute__((visibility("default")))
#endif

/** The entry, called once for each context: gives an independent instance, whose table lives until
 *  its shutdown has returned.
 *
 *      DEFREC_PLUGIN_EXPORT defrec_status DEFREC_CALL defrec_plugin_entry_v1(
 *          const defrec_host *host, const defrec_plugin **out);
 */
typedef defrec_status(DEFREC_CALL *defrec_plugin_entry_fn)(
    const defrec_host *host, const defrec_plugin **out);

/** @} */

#ifdef __cplusplus
}
#endif
#endif
