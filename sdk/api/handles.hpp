// Handles are tagged serial numbers, never addresses and never used twice, so that a destroyed,
// random or foreign one is recognised without touching memory. The table behind them is the
// library's one piece of process-wide state.
#pragma once
#include <cstdint>
#include <memory>
#include <memory_resource>

namespace defrec {

enum class HandleKind : uint8_t {
    kContext = 1,
    kRig,
    kTracker,
    kTemplate,
    kJob,
    kStage,
    kMemory,
    kTargets,
    kRegistration,
    kHandEye,
    kPlan,
    kPredictor
};

namespace detail {
// Keeps what is given back for the next: handles and what stands behind them come and go with every
// frame.
std::pmr::memory_resource* handle_memory();
void* add_handle(HandleKind kind, std::shared_ptr<void> object);
std::shared_ptr<void> find_handle(HandleKind kind, const void* handle);
std::shared_ptr<void> remove_handle(HandleKind kind, const void* handle);
}  // namespace detail

// Which type stands behind a C handle: specialised in objects.hpp with `kind` and `Object`.
template <class Handle>
struct HandleTraits;

template <class Handle>
Handle add_handle(std::shared_ptr<typename HandleTraits<Handle>::Object> object) {
    return static_cast<Handle>(detail::add_handle(HandleTraits<Handle>::kind, std::move(object)));
}

// An object to stand behind a handle of this kind.
template <class Handle>
std::shared_ptr<typename HandleTraits<Handle>::Object> make_object() {
    return std::allocate_shared<typename HandleTraits<Handle>::Object>(
        std::pmr::polymorphic_allocator<>(detail::handle_memory()));
}

// The object, kept alive by the result. Throws Error(DEFREC_ERROR_ARGUMENT) for NULL,
// Error(DEFREC_ERROR_HANDLE) for what is not a live handle of this kind, Error(DEFREC_ERROR_STATE)
// for one made before a fork.
template <class Handle>
std::shared_ptr<typename HandleTraits<Handle>::Object> find_handle(Handle handle) {
    return std::static_pointer_cast<typename HandleTraits<Handle>::Object>(
        detail::find_handle(HandleTraits<Handle>::kind, handle));
}

// Likewise, and the handle is dead afterwards.
template <class Handle>
std::shared_ptr<typename HandleTraits<Handle>::Object> remove_handle(Handle handle) {
    return std::static_pointer_cast<typename HandleTraits<Handle>::Object>(
        detail::remove_handle(HandleTraits<Handle>::kind, handle));
}

}  // namespace defrec
