/* A plugin in C99 for the tests of the loader: one device whose stage ransac copies input 0 to
 * output 0. STUB_* turns one thing of it wrong; CMakeLists.txt builds a plugin for each. STUB_LATE
 * has every stage, none of which does anything, and a device that is lost at the first wait but
 * goes on copying until its queue is destroyed. */
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "include/defrec_plugin.h"

#ifndef STUB_NAME
#error "STUB_NAME: the plugin's name"
#endif

struct defrec_pdevice_ {
    int unused;
};
struct defrec_pbuffer_ {
    uint64_t size;
    unsigned char* data;
    int imported;
};
struct transfer {
    void* to;
    const void* from;
    uint64_t size;
};
enum { MOST_TRANSFERS = 64 };
struct defrec_pqueue_ {
    uint64_t signalled;
    int transfer_count;
    struct transfer transfers[MOST_TRANSFERS]; /* asked for, not done yet */
    defrec_pqueue* next;
};
struct defrec_pstage_ {
    int unused;
};

static const defrec_host* host_table;

static defrec_status failed(defrec_status status, const char* text) {
    host_table->error(host_table->self, text);
    return status;
}

static size_t device_count(void* self) {
    (void)self;
#ifdef STUB_DUPLICATE_IDS
    return 2;
#elif defined(STUB_MANY_DEVICES)
    return (size_t)-1;
#elif defined(STUB_BROKEN_DEVICE) || defined(STUB_BROKEN_DEVICES)
    return 3;
#else
    return 1;
#endif
}

static defrec_status device_info(void* self, size_t index, defrec_device_info* out) {
    defrec_device_info info;
    (void)self;
    (void)index;
#ifdef STUB_BROKEN_DEVICE
    if (index == 1) return failed(DEFREC_ERROR_DEVICE_LOST, "the stub fell off the bus");
#elif defined(STUB_BROKEN_DEVICES)
    if (index == 0) return failed(DEFREC_ERROR_OUT_OF_MEMORY, "the stub is full");
    return DEFREC_ERROR_DEVICE_LOST;
#endif
    memset(&info, 0, sizeof info);
    info.struct_size = out->struct_size;
    info.kind = DEFREC_DEVICE_CPU;
#ifdef STUB_NO_ID
    info.id = NULL;
#elif defined(STUB_BROKEN_DEVICE)
    info.id = index == 0 ? "stub:0" : "stub:2";
#else
    info.id = "stub";
#endif
    info.name = "Stub";
    info.driver = "";
    info.stages = 1u << DEFREC_STAGE_RANSAC;
#ifdef STUB_CLAIMS_STAGE
    info.stages |= 1u << DEFREC_STAGE_LM;
#elif defined(STUB_LATE)
    info.stages = (1u << DEFREC_STAGE_COUNT_V1) - 1;
#endif
    memcpy(out, &info, out->struct_size < sizeof info ? out->struct_size : sizeof info);
    return DEFREC_OK;
}

static defrec_status device_open(void* self, size_t index, defrec_pdevice** out) {
    (void)self;
    (void)index;
#ifdef STUB_NO_DEVICE
    (void)out;
    return DEFREC_OK;
#elif defined(STUB_BROKEN_DEVICE)
    if (index == 0) return failed(DEFREC_ERROR_DEVICE_LOST, "device 0 was opened");
    *out = malloc(sizeof **out);
    return *out == NULL ? DEFREC_ERROR_OUT_OF_MEMORY : DEFREC_OK;
#else
    *out = malloc(sizeof **out);
    return *out == NULL ? DEFREC_ERROR_OUT_OF_MEMORY : DEFREC_OK;
#endif
}
static void device_close(defrec_pdevice* device) { free(device); }

static defrec_pqueue*
    queues; /* of the variants whose queues put things off, which are used by one thread */
#if defined(STUB_LATE) || defined(STUB_HOST_MEMORY)
static void list_queue(defrec_pqueue* queue) {
    queue->next = queues;
    queues = queue;
}
static void unlist_queue(defrec_pqueue* queue) {
    defrec_pqueue** place = &queues;
    while (*place != queue) place = &(*place)->next;
    *place = queue->next;
}
#else
static void list_queue(defrec_pqueue* queue) { (void)queue; }
static void unlist_queue(defrec_pqueue* queue) { (void)queue; }
#endif

static void transfer_all(defrec_pqueue* queue) {
    int i;
    for (i = 0; i < queue->transfer_count; ++i)
        memcpy(queue->transfers[i].to, queue->transfers[i].from, (size_t)queue->transfers[i].size);
    queue->transfer_count = 0;
}
static void transfer_later(defrec_pqueue* queue, void* to, const void* from, uint64_t size) {
    struct transfer* transfer = &queue->transfers[queue->transfer_count++];
    transfer->to = to;
    transfer->from = from;
    transfer->size = size;
}
static void catch_up(defrec_pqueue* queue) {
#ifdef STUB_LATE
    if (queue->transfer_count < MOST_TRANSFERS / 2) return;
#endif
    transfer_all(queue);
}

/* Says so where memory goes that a queue is still to copy from or to. */
static void expect_unused(const unsigned char* memory, uint64_t size) {
    const defrec_pqueue* queue;
    int i;
    for (queue = queues; queue != NULL; queue = queue->next)
        for (i = 0; i < queue->transfer_count; ++i) {
            const unsigned char *to = queue->transfers[i].to, *from = queue->transfers[i].from;
            if ((to >= memory && to < memory + size) || (from >= memory && from < memory + size))
                host_table->log(host_table->self, DEFREC_LOG_ERROR,
                                "memory went that a queue still uses");
        }
}

static defrec_status buffer_create(defrec_pdevice* device, uint64_t size, defrec_pbuffer** out) {
    defrec_pbuffer* buffer = malloc(sizeof *buffer);
    (void)device;
    if (buffer == NULL) return DEFREC_ERROR_OUT_OF_MEMORY;
    buffer->size = size;
    buffer->imported = 0;
    buffer->data = calloc(1, (size_t)size);
    if (buffer->data == NULL) {
        free(buffer);
        return failed(DEFREC_ERROR_OUT_OF_MEMORY, "no memory for a buffer");
    }
    *out = buffer;
    return DEFREC_OK;
}
static void buffer_destroy(defrec_pbuffer* buffer) {
    defrec_pqueue* queue;
    for (queue = queues; queue != NULL; queue = queue->next)
        transfer_all(queue); /* destroying waits for the work */
    if (!buffer->imported) free(buffer->data);
    free(buffer);
}

static defrec_status queue_create(defrec_pdevice* device, defrec_pqueue** out) {
    defrec_pqueue* queue = calloc(1, sizeof *queue);
    (void)device;
    if (queue == NULL) return DEFREC_ERROR_OUT_OF_MEMORY;
    list_queue(queue);
    *out = queue;
    return DEFREC_OK;
}
static void queue_destroy(defrec_pqueue* queue) {
    transfer_all(queue);
    unlist_queue(queue);
    free(queue);
}
static defrec_status write_buffer(defrec_pqueue* queue, defrec_pbuffer* buffer, uint64_t offset,
                                  const void* src, uint64_t size) {
    catch_up(queue);
    memcpy(buffer->data + offset, src, (size_t)size);
    return DEFREC_OK;
}
#ifndef STUB_NULL_ENTRY
static defrec_status read_buffer(defrec_pqueue* queue, defrec_pbuffer* buffer, uint64_t offset,
                                 void* dst, uint64_t size) {
    catch_up(queue);
    transfer_later(queue, dst, buffer->data + offset, size);
    catch_up(queue);
    return DEFREC_OK;
}
#endif
static defrec_status signal_queue(defrec_pqueue* queue, uint64_t* out_value) {
    catch_up(queue);
    *out_value = ++queue->signalled;
    return DEFREC_OK;
}
static defrec_status wait_queue(defrec_pqueue* queue, uint64_t value, uint64_t timeout_ns) {
    (void)timeout_ns;
#ifdef STUB_LATE
    (void)queue;
    (void)value;
    return failed(DEFREC_ERROR_DEVICE_LOST, "the stub was unplugged");
#elif defined(STUB_NEVER_DONE)
    (void)queue;
    (void)value;
    return DEFREC_TIMEOUT;
#else
    return value <= queue->signalled ? DEFREC_OK : DEFREC_TIMEOUT;
#endif
}

/* ---- memory, where the stub has functions for it ---- */

static defrec_status host_alloc(defrec_pdevice* device, uint64_t size, void** out) {
    unsigned char *whole = calloc(1, (size_t)size + 128), *memory;
    (void)device;
    if (whole == NULL) return failed(DEFREC_ERROR_OUT_OF_MEMORY, "no page-locked memory");
    memory = whole + 128 - (uintptr_t)whole % 64;
    ((void**)memory)[-1] = whole;
    ((uint64_t*)memory)[-2] = size;
    *out = memory;
    return DEFREC_OK;
}
static void host_free(defrec_pdevice* device, void* memory) {
    (void)device;
    expect_unused(memory, ((uint64_t*)memory)[-2]);
    free(((void**)memory)[-1]);
}
static defrec_status write_in_place(defrec_pqueue* queue, defrec_pbuffer* buffer, uint64_t offset,
                                    const void* src, uint64_t size) {
    catch_up(queue);
    transfer_later(queue, buffer->data + offset, src, size);
    return DEFREC_OK;
}
static defrec_status buffer_import(defrec_pdevice* device, uint32_t kind, void* memory,
                                   uint64_t size, defrec_pbuffer** out) {
    defrec_pbuffer* buffer;
    (void)device;
    if (kind != DEFREC_MEMORY_HOST)
        return failed(DEFREC_ERROR_UNSUPPORTED, "the stub reaches memory of the host alone");
    buffer = malloc(sizeof *buffer);
    if (buffer == NULL) return DEFREC_ERROR_OUT_OF_MEMORY;
    buffer->size = size;
    buffer->data = memory;
    buffer->imported = 1;
    *out = buffer;
    return DEFREC_OK;
}

/* ---- stages ---- */

static defrec_status supports(defrec_pdevice* device, const void* params) {
    (void)device;
#ifdef STUB_LATE
    (void)params;
    return DEFREC_OK;
#endif
    if (((const defrec_ransac_params*)params)->landmarks > 1000)
        return failed(DEFREC_ERROR_UNSUPPORTED, "at most 1000 landmarks");
    return DEFREC_OK;
}
static defrec_status stage_create(defrec_pdevice* device, const void* params, defrec_pstage** out) {
    (void)device;
    (void)params;
    *out = malloc(sizeof **out);
    return *out == NULL ? DEFREC_ERROR_OUT_OF_MEMORY : DEFREC_OK;
}
static void stage_destroy(defrec_pstage* stage) { free(stage); }
static defrec_status stage_prepare(defrec_pstage* stage, defrec_pqueue* queue,
                                   defrec_pbuffer* const* in, size_t in_count) {
    (void)stage;
    (void)queue;
    (void)in;
    (void)in_count;
    return DEFREC_OK;
}
#ifndef STUB_NULL_STAGE_ENTRY
static defrec_status stage_enqueue(defrec_pstage* stage, defrec_pqueue* queue,
                                   defrec_pbuffer* const* in, size_t in_count,
                                   defrec_pbuffer* const* out, size_t out_count) {
    (void)stage;
    catch_up(queue);
#ifdef STUB_LOSES_DEVICE
    return failed(DEFREC_ERROR_DEVICE_LOST, "the stub was unplugged");
#elif defined(STUB_LATE)
    (void)in;
    (void)in_count;
    (void)out;
    (void)out_count;
    return DEFREC_OK;
#endif
    if (in_count < 1 || out_count < 1 || in[0]->size != out[0]->size)
        return failed(DEFREC_ERROR_ARGUMENT, "one input and one output of the same size expected");
    memcpy(out[0]->data, in[0]->data, (size_t)in[0]->size);
    return DEFREC_OK;
}
#endif

static const defrec_stage_table* stage(void* self, uint32_t number) {
#ifdef STUB_LATE
    static defrec_stage_table tables[DEFREC_STAGE_COUNT_V1];
#endif
    static const defrec_stage_table table = {sizeof(defrec_stage_table),
                                             DEFREC_STAGE_RANSAC,
#ifdef STUB_OTHER_STAGE_VERSION
                                             2,
#else
                                             1,
#endif
                                             0,
                                             supports,
                                             stage_create,
                                             stage_destroy,
                                             stage_prepare,
#ifdef STUB_NULL_STAGE_ENTRY
                                             NULL
#else
                                             stage_enqueue
#endif
    };
    (void)self;
#ifdef STUB_LATE
    tables[number] = table;
    tables[number].stage = number;
    return &tables[number];
#endif
    return number == DEFREC_STAGE_RANSAC ? &table : NULL;
}

static void shut_down(void* self) { (void)self; }

static const defrec_plugin plugin_table = {
#ifdef STUB_SHORT_TABLE
    offsetof(defrec_plugin, buffer_import),
#else
    sizeof(defrec_plugin),
#endif
    DEFREC_PLUGIN_ABI_MINOR,
    STUB_NAME,
    "1.2.3",
    "tests",
    NULL,
    device_count,
    device_info,
    device_open,
    device_close,
    buffer_create,
    buffer_destroy,
    queue_create,
    queue_destroy,
    write_buffer,
#ifdef STUB_NULL_ENTRY
    NULL,
#else
    read_buffer,
#endif
    signal_queue,
    wait_queue,
    stage,
    shut_down,
#if defined(STUB_HOST_MEMORY) || defined(STUB_LATE)
    host_alloc,
    host_free,
    write_in_place,
    buffer_import
#elif defined(STUB_HOST_ALLOC_ALONE)
    host_alloc,
    NULL,
    NULL,
    NULL
#else
    NULL,
    NULL,
    NULL,
    NULL
#endif
};

#ifdef STUB_UNDEFINED_SYMBOL
extern void stub_symbol_that_nobody_defines(void);
#endif

#ifdef STUB_MISSING_SYMBOL
#define ENTRY defrec_plugin_entry_v0
#else
#define ENTRY defrec_plugin_entry_v1
#endif

DEFREC_PLUGIN_EXPORT defrec_status DEFREC_CALL ENTRY(const defrec_host* host,
                                                     const defrec_plugin** out);

DEFREC_PLUGIN_EXPORT defrec_status DEFREC_CALL ENTRY(const defrec_host* host,
                                                     const defrec_plugin** out) {
    host_table = host;
#ifdef STUB_UNDEFINED_SYMBOL
    stub_symbol_that_nobody_defines();
#endif
#ifdef STUB_ENTRY_FAILS
    return failed(DEFREC_ERROR_UNSUPPORTED, "the stub's driver is too old");
#elif defined(STUB_ENTRY_OUT_OF_MEMORY)
    return failed(DEFREC_ERROR_OUT_OF_MEMORY, "the stub's card is full");
#endif
#ifdef STUB_NO_TABLE
    (void)plugin_table;
    (void)out;
#elif defined(STUB_LATER_MINOR)
    static struct {
        defrec_plugin table;
        void (*appended[2])(void);
    } longer;
    longer.table = plugin_table;
    longer.table.struct_size = sizeof longer;
    longer.table.abi_minor = DEFREC_PLUGIN_ABI_MINOR + 1;
    *out = &longer.table;
#else
    *out = &plugin_table;
#endif
    return DEFREC_OK;
}
