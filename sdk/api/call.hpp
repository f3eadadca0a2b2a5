// What every exported function goes through: no call from a callback, no exception past this point,
// no cancellation within, the application's floating point mode as it was.
#pragma once
#include <new>
#include <type_traits>

#include "sdk/api/handles.hpp"
#include "sdk/base/os/callback.hpp"
#include "sdk/base/os/platform.hpp"
#include "sdk/base/util/error.hpp"
#include "sdk/base/util/status.hpp"

namespace defrec {

inline defrec_status report(defrec_status status, std::string_view text) noexcept {
    set_last_error(text);
    return status;
}

// body returns nothing (success) or a status. A negative status that is returned, not thrown, has
// set the last error.
template <class Body>
defrec_status api_call(Body&& body) noexcept {
    if (CallbackScope::inside())
        return report(DEFREC_ERROR_STATE, "a callback may not call defrec");
    const platform::NoCancellation whole;
    try {
        const platform::DefaultFloatingPoint mode;
        if constexpr (std::is_void_v<decltype(body())>) {
            body();
            return DEFREC_OK;
        } else {
            return body();
        }
    } catch (const Error& error) {
        return report(error.status(), error.what());
    } catch (const std::bad_alloc&) {
        return report(DEFREC_ERROR_OUT_OF_MEMORY, "out of memory");
    } catch (const std::exception& error) {
        return report(DEFREC_ERROR_INTERNAL, error.what());
    } catch (...) {
        return report(DEFREC_ERROR_INTERNAL, "an exception of unknown type");
    }
}

}  // namespace defrec
