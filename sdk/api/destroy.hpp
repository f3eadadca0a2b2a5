// How handles end: the last owner of what a plugin made ends it, and a plugin may not return.
#pragma once
#include "sdk/api/call.hpp"
#include "sdk/api/objects.hpp"
#include "sdk/base/os/run_within.hpp"

namespace defrec {

inline std::shared_ptr<Context> context_of(const std::shared_ptr<Context>& object) {
    return object;
}
template <class Object>
std::shared_ptr<Context> context_of(const std::shared_ptr<Object>& object) {
    return object->context;
}

// Lets go of an object and waits no longer for that than the plugin's deadline. context: whose
// callbacks it uses until nobody else has it.
template <class Object>
void let_go(std::shared_ptr<Object> object, const std::shared_ptr<const Services>& services,
            const std::weak_ptr<Context>& context) {
    const std::chrono::milliseconds limit = services->plugin_deadline();
    try {
        if (run_within(limit, [held = std::move(object)]() mutable { held.reset(); })) return;
    } catch (const std::exception&) {
        return;  // there was no memory for a thread: it went on this one
    }
    services->leave_behind();
    services->log(
        DEFREC_LOG_ERROR, "sdk",
        concat("a plugin did not end within ", limit.count(), " ms; it is left behind").c_str());
    if (context.expired()) services->end_callbacks();
}

template <class Object>
void let_go(std::shared_ptr<Object> object) {
    std::shared_ptr<Context> context = context_of(object);
    if (!context->has_plugins()) return;
    const std::weak_ptr<Context> watched = context;
    const std::shared_ptr<const Services> services = context->allocator();
    context.reset();
    let_go(std::move(object), services, watched);
}

// A destroy function: NULL is fine, anything that is not a live handle is left alone and sets the
// last error.
template <class Handle>
void destroy_handle(Handle handle) noexcept {
    if (handle != nullptr) api_call([&] { let_go(remove_handle(handle)); });
}

}  // namespace defrec
