// See handles.hpp.
#include "sdk/api/handles.hpp"

#include <atomic>
#include <memory_resource>
#include <mutex>
#include <unordered_map>

#include "sdk/base/os/platform.hpp"
#include "sdk/base/util/error.hpp"

namespace defrec::detail {
namespace {

// A handle: 0xDF and the kind in the highest two bytes, which no address has, then the serial
// number.
constexpr uint64_t kMark = 0xDF;
constexpr uint64_t kSerialMask = (uint64_t{1} << 48) - 1;
static_assert(sizeof(void*) == 8, "handles need 64 bits");

const char* kind_name(HandleKind kind) {
    switch (kind) {
        case HandleKind::kContext:
            return "context";
        case HandleKind::kRig:
            return "rig";
        case HandleKind::kTracker:
            return "tracker";
        case HandleKind::kTemplate:
            return "template";
        case HandleKind::kJob:
            return "job";
        case HandleKind::kStage:
            return "stage";
        case HandleKind::kMemory:
            return "memory";
        case HandleKind::kTargets:
            return "targets";
        case HandleKind::kRegistration:
            return "registration";
        case HandleKind::kHandEye:
            return "hand-eye calibration";
        case HandleKind::kPlan:
            return "plan";
        case HandleKind::kPredictor:
            return "predictor";
    }
    return "unknown";
}

struct Table {
    explicit Table(uint64_t first)
        : process(platform::process_id()), first_serial(first), next_serial(first) {}
    const uint64_t process;
    const uint64_t first_serial;
    std::atomic<uint64_t> next_serial;
    std::pmr::synchronized_pool_resource memory;
    std::mutex mutex;
    std::pmr::unordered_map<uint64_t, std::shared_ptr<void>> objects{&memory};
};

// This process's table. A child after fork gets a new one: the parent's mutex may be locked for
// ever there, and its objects have lost their threads. Tables are never freed, so that handles
// outlive static destructors.
Table& table() {
    static std::atomic<Table*> current{new Table(1)};
    Table* mine = current.load(std::memory_order_acquire);
    while (mine->process != platform::process_id()) {
        auto fresh = std::make_unique<Table>(mine->next_serial.load());
        if (current.compare_exchange_strong(mine, fresh.get())) return *fresh.release();
    }
    return *mine;
}

uint64_t bits_of(const void* handle) { return reinterpret_cast<uintptr_t>(handle); }

// Throws unless the bits look like a handle of this kind and process.
void check_bits(const Table& own, HandleKind kind, const void* handle) {
    if (handle == nullptr) fail(DEFREC_ERROR_ARGUMENT, "the ", kind_name(kind), " handle is NULL");
    const uint64_t bits = bits_of(handle), found = bits >> 48 & 0xFF;
    if (bits >> 56 != kMark || found < 1 || found > static_cast<uint64_t>(HandleKind::kPredictor))
        fail(DEFREC_ERROR_HANDLE, "not a handle of defrec, a ", kind_name(kind), " is expected");
    if (found != static_cast<uint64_t>(kind))
        fail(DEFREC_ERROR_HANDLE, "a ", kind_name(static_cast<HandleKind>(found)),
             " handle was given, a ", kind_name(kind), " is expected");
    if ((bits & kSerialMask) < own.first_serial)
        fail(DEFREC_ERROR_STATE, "this ", kind_name(kind),
             " was made before the process forked and cannot be used in the child");
}

[[noreturn]] void refuse_dead(HandleKind kind) {
    fail(DEFREC_ERROR_HANDLE, "this ", kind_name(kind),
         " handle was destroyed already, or never existed");
}

}  // namespace

std::pmr::memory_resource* handle_memory() { return &table().memory; }

void* add_handle(HandleKind kind, std::shared_ptr<void> object) {
    Table& own = table();
    const uint64_t bits = kMark << 56 | static_cast<uint64_t>(kind) << 48 | own.next_serial++;
    const std::lock_guard lock(own.mutex);
    own.objects.emplace(bits, std::move(object));
    return reinterpret_cast<void*>(static_cast<uintptr_t>(bits));
}

std::shared_ptr<void> find_handle(HandleKind kind, const void* handle) {
    Table& own = table();
    check_bits(own, kind, handle);
    const std::lock_guard lock(own.mutex);
    const auto found = own.objects.find(bits_of(handle));
    if (found == own.objects.end()) refuse_dead(kind);
    return found->second;
}

std::shared_ptr<void> remove_handle(HandleKind kind, const void* handle) {
    Table& own = table();
    check_bits(own, kind, handle);
    const std::lock_guard lock(own.mutex);
    const auto found = own.objects.find(bits_of(handle));
    if (found == own.objects.end()) refuse_dead(kind);
    std::shared_ptr<void> object = std::move(found->second);
    own.objects.erase(found);
    return object;
}

}  // namespace defrec::detail
