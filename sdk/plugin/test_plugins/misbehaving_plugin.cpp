// Backend cpu that misbehaves in one place, as a test asks for by defrec_misbehave: throws, hangs,
// or gives what a stage never gives. What is asked for holds in every context. MISBEHAVES_AT_START:
// the arguments of a first call of it, in a plugin that no context takes.
#ifndef _WIN32
#include <pthread.h>
#endif

#include <cfenv>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <list>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "plugins/cpu/makers.hpp"

namespace {
using namespace defrec;

const HostPluginDescription kDescription{
    PLUGIN_NAME,
    DEFREC_RELEASE,
    "Misbehaves",
    cpu::kMakers,
};

// Both are set by the first entry, and then only read: a thread that hangs in one context may be
// in them while another enters. The functions are the same whatever the context.
defrec_plugin inner;  // as it should be; self is not its own
defrec_stage_table stages[DEFREC_STAGE_COUNT_V1];
const defrec_stage_table* inner_stages[DEFREC_STAGE_COUNT_V1];

std::mutex mutex;
std::condition_variable changed;
// One of each entry; what hung may use it while the program ends. Under the mutex, as all that
// follow.
std::list<defrec_plugin>& outers = *new std::list<defrec_plugin>;
std::string how, where;
bool held = false;
int inside = 0;  // calls that hang

// What is done at a place before the right thing; where something is destroyed, after it: what
// throws there would leak.
void at(const char* place) {
    std::unique_lock lock(mutex);
    if (where != place) return;
    if (how == "throw") throw 5;
#ifndef _WIN32
    if (how == "exit") pthread_exit(nullptr);
    if (how == "cancel") {
        pthread_cancel(pthread_self());
        pthread_testcancel();
    }
#endif
    if (how != "hang") return;
    ++inside;
    changed.notify_all();
    changed.wait(lock, [] { return !held; });
    --inside;
    changed.notify_all();
}
// The same, and behind the right thing another floating point mode.
class At {
  public:
    explicit At(const char* place) : place_(place) { at(place); }
    ~At() {
        const std::lock_guard lock(mutex);
        if (where != place_) return;
        if (how == "round") std::fesetround(FE_UPWARD);
#ifdef __GLIBC__
        if (how == "trap") feenableexcept(FE_DIVBYZERO | FE_INEXACT | FE_INVALID);
#endif
    }
    At(const At&) = delete;
    At& operator=(const At&) = delete;

  private:
    const char* place_;
};
// Whether this is the call of kind "memory" that fails: the one after so many as the place ends
// with ("buffer_create 7").
bool is_out_of_memory(const std::string& place) {
    const std::lock_guard lock(mutex);
    if (how != "memory" || !where.starts_with(place + " ")) return false;
    const long left = std::stol(where.substr(place.size() + 1));
    where = left > 0 ? place + " " + std::to_string(left - 1) : "";
    return left == 0;
}
bool asked_for(const char* kind, const char* place) {
    const std::lock_guard lock(mutex);
    return how == kind && where == place;
}

// A value that a stage never gives, behind what it gave.
struct Lie {
    const char* name;
    uint32_t stage;
    size_t output;
    size_t offset;
    uint32_t bits;
};
constexpr uint32_t kNaN = 0x7fc00000u;
constexpr Lie kLies[] = {
    {"count of features", DEFREC_STAGE_ORB, 0, 0, UINT32_MAX},
    {"place of a feature", DEFREC_STAGE_ORB, 1, offsetof(defrec_feature, x), 0x7fffffffu},
    {"level of a feature", DEFREC_STAGE_ORB, 1, offsetof(defrec_feature, level), 0xffffffffu},
    {"disparity", DEFREC_STAGE_STEREO, 0, 320 * 120 * 2, 0x7fff7fffu},
    {"feature of a match", DEFREC_STAGE_RANSAC, 0, offsetof(defrec_match, feature), 2000000000u},
    {"weight of a match", DEFREC_STAGE_RANSAC, 0, offsetof(defrec_match, weight), kNaN},
    {"inliers", DEFREC_STAGE_RANSAC, 1, offsetof(defrec_ransac_summary, inliers), 0x80000000u},
    {"validity of a patch", DEFREC_STAGE_ALIGN, 0, offsetof(defrec_patch_observation, valid), 7},
    {"information of a patch", DEFREC_STAGE_ALIGN, 0,
     offsetof(defrec_patch_observation, information), kNaN},
    {"validity of a prediction", DEFREC_STAGE_ALIGN, 1, offsetof(defrec_patch_prediction, valid),
     7},
    {"motion", DEFREC_STAGE_LM, 0, offsetof(defrec_motion, dual), kNaN},
    {"motion of no length", DEFREC_STAGE_LM, 0, offsetof(defrec_motion, real), 0x7f000000u},
    {"position", DEFREC_STAGE_WARP, 0, offsetof(defrec_surface_sample, position), kNaN},
    {"residual", DEFREC_STAGE_WARP, 0, offsetof(defrec_surface_sample, residual), 0x7f800000u},
    {"observation", DEFREC_STAGE_WARP, 0, offsetof(defrec_surface_sample, observation), 77},
};

template <size_t kStage>
defrec_status enqueue(defrec_pstage* stage, defrec_pqueue* queue, defrec_pbuffer* const* in,
                      size_t in_count, defrec_pbuffer* const* out, size_t out_count) {
    const At here("enqueue");
    const defrec_status status =
        inner_stages[kStage]->enqueue(stage, queue, in, in_count, out, out_count);
    for (const Lie& lie : kLies)
        if (lie.stage == kStage && asked_for("lie", lie.name) && lie.output < out_count &&
            out[lie.output] != nullptr)
            inner.write(queue, out[lie.output], lie.offset, &lie.bits, sizeof lie.bits);
    return status;
}
template <size_t kStage>
defrec_status create(defrec_pdevice* device, const void* params, defrec_pstage** out) {
    const At here("create");
    if (is_out_of_memory("create")) return DEFREC_ERROR_OUT_OF_MEMORY;
    return inner_stages[kStage]->create(device, params, out);
}
template <size_t... kStages>
void wrap_stages(void* self, std::index_sequence<kStages...>) {
    ((inner_stages[kStages] = inner.stage(self, kStages), stages[kStages] = *inner_stages[kStages],
      stages[kStages].create = create<kStages>, stages[kStages].enqueue = enqueue<kStages>),
     ...);
    for (defrec_stage_table& stage : stages)
        stage.destroy = [](defrec_pstage* object) {
            inner_stages[DEFREC_STAGE_RECTIFY]->destroy(object);
            at("stage destroy");
        };
}

void wrap_devices(defrec_plugin& outer) {
    outer.device_count = [](void* self) {
        at("device_count");
        return inner.device_count(self);
    };
    outer.device_info = [](void* self, size_t index, defrec_device_info* out) {
        at("device_info");
        const defrec_status status = inner.device_info(self, index, out);
        out->id = PLUGIN_NAME;
        return status;
    };
    outer.device_open = [](void* self, size_t index, defrec_pdevice** out) {
        const At here("device_open");
        return inner.device_open(self, index, out);
    };
    outer.device_close = [](defrec_pdevice* device) {
        inner.device_close(device);
        at("device_close");
    };
}

void wrap_buffers(defrec_plugin& outer) {
    outer.buffer_create = [](defrec_pdevice* device, uint64_t size,
                             defrec_pbuffer** out) -> defrec_status {
        const At here("buffer_create");
        if (is_out_of_memory("buffer_create")) return DEFREC_ERROR_OUT_OF_MEMORY;
        return inner.buffer_create(device, size, out);
    };
    outer.buffer_destroy = [](defrec_pbuffer* buffer) {
        inner.buffer_destroy(buffer);
        at("buffer_destroy");
    };
    outer.buffer_import = [](defrec_pdevice* device, uint32_t kind, void* memory, uint64_t size,
                             defrec_pbuffer** out) {
        at("buffer_import");
        return inner.buffer_import(device, kind, memory, size, out);
    };
}

void wrap_queues(defrec_plugin& outer) {
    outer.queue_destroy = [](defrec_pqueue* queue) {
        inner.queue_destroy(queue);
        at("queue_destroy");
    };
    outer.write = [](defrec_pqueue* queue, defrec_pbuffer* buffer, uint64_t offset, const void* src,
                     uint64_t size) {
        const At here("write");
        return inner.write(queue, buffer, offset, src, size);
    };
    outer.read = [](defrec_pqueue* queue, defrec_pbuffer* buffer, uint64_t offset, void* dst,
                    uint64_t size) {
        const At here("read");
        return inner.read(queue, buffer, offset, dst, size);
    };
    outer.signal = [](defrec_pqueue* queue, uint64_t* out_value) {
        const At here("signal");
        return inner.signal(queue, out_value);
    };
    outer.wait = [](defrec_pqueue* queue, uint64_t value, uint64_t timeout_ns) -> defrec_status {
        const At here("wait");
        if (asked_for("early", "wait")) return DEFREC_TIMEOUT;
        if (!asked_for("never", "wait")) return inner.wait(queue, value, timeout_ns);
        std::this_thread::sleep_for(std::chrono::nanoseconds(timeout_ns));
        return DEFREC_TIMEOUT;
    };
}

defrec_plugin wrapped(const defrec_plugin& plugin) {
    defrec_plugin outer = plugin;
    wrap_devices(outer);
    wrap_buffers(outer);
    wrap_queues(outer);
    outer.stage = [](void*, uint32_t stage) -> const defrec_stage_table* {
        at("stage");
        return stage < DEFREC_STAGE_COUNT_V1 ? &stages[stage] : nullptr;
    };
    outer.shutdown = [](void* self) {
        inner.shutdown(self);
        at("shutdown");
    };
    return outer;
}

}  // namespace

// From now on: kind "throw", "exit", "cancel" (the thread), "round" (upwards), "trap" (floating
// point exceptions), "hang", "lie", "never", "early" or "memory" at this place; "" nowhere.
// What hangs goes on when this is called again. "memory" happens once, and then the place is "".
extern "C" DEFREC_PLUGIN_EXPORT void defrec_misbehave(const char* kind, const char* place) {
    std::unique_lock lock(mutex);
    held = false;
    changed.notify_all();
    changed.wait(lock, [] { return inside == 0; });
    how = kind;
    where = place;
    held = true;
}

// Whether what was asked for last is still to come.
extern "C" DEFREC_PLUGIN_EXPORT bool defrec_is_yet_to_misbehave() {
    const std::lock_guard lock(mutex);
    return !where.empty();
}

// Waits until a call hangs.
extern "C" DEFREC_PLUGIN_EXPORT void defrec_await_hang() {
    std::unique_lock lock(mutex);
    changed.wait(lock, [] { return inside > 0; });
}

extern "C" DEFREC_PLUGIN_EXPORT defrec_status DEFREC_CALL
defrec_plugin_entry_v1(const defrec_host* host, const defrec_plugin** out) {
#ifdef MISBEHAVES_AT_START
    defrec_misbehave(MISBEHAVES_AT_START);
#endif
    at("entry");
    const defrec_plugin* plugin = nullptr;
    const defrec_status status = enter_host_plugin(kDescription, host, &plugin);
    if (status != DEFREC_OK) return status;
    const std::lock_guard lock(mutex);
    if (outers.empty()) {
        inner = *plugin;
        wrap_stages(plugin->self, std::make_index_sequence<DEFREC_STAGE_COUNT_V1>());
    }
    *out = &outers.emplace_back(wrapped(*plugin));
    return DEFREC_OK;
}
