// What every plugin in C++ needs at the border of the plugin ABI: the barrier that no exception
// crosses, and the filling of tables.
#pragma once
#include "backends/shared/stage.hpp"

namespace defrec {

// Runs body and returns DEFREC_OK, or the status of what it threw after telling the host the text.
template <class Body>
defrec_status guarded(const defrec_host& host, Body&& body) noexcept {
    try {
        body();
        return DEFREC_OK;
    } catch (const StageError& error) {
        host.error(host.self, error.what());
        return error.status();
    } catch (const std::bad_alloc&) {
        host.error(host.self, "out of memory");
        return DEFREC_ERROR_OUT_OF_MEMORY;
    } catch (const std::exception& error) {
        host.error(host.self, error.what());
        return DEFREC_ERROR_INTERNAL;
    } catch (...) {
        host.error(host.self, "an exception of unknown type");
        return DEFREC_ERROR_INTERNAL;
    }
}

// For refusing what the caller gave.
[[noreturn]] inline void reject(const char* text) { throw StageError(DEFREC_ERROR_ARGUMENT, text); }

// Whether the host offers everything that a plugin of this version calls.
inline bool complete_host(const defrec_host* host) {
    return DEFREC_HAS(host, concurrency) && host->log != nullptr && host->error != nullptr &&
           host->alloc != nullptr && host->free != nullptr && host->parallel_for != nullptr;
}

constexpr uint32_t kStageVersion = 1;  // of every definition in docs/stages
constexpr bool has_prepare(uint32_t stage) {
    return stage != DEFREC_STAGE_RECTIFY && stage != DEFREC_STAGE_STEREO &&
           stage != DEFREC_STAGE_ORB;
}

// A stage's table; prepare is left out where the stage has none.
constexpr defrec_stage_table fill_stage_table(uint32_t stage,
                                              decltype(defrec_stage_table::supports) supports,
                                              decltype(defrec_stage_table::create) create,
                                              decltype(defrec_stage_table::destroy) destroy,
                                              decltype(defrec_stage_table::prepare) prepare,
                                              decltype(defrec_stage_table::enqueue) enqueue) {
    defrec_stage_table table{};
    table.struct_size = sizeof table;
    table.stage = stage;
    table.stage_version = kStageVersion;
    table.supports = supports;
    table.create = create;
    table.destroy = destroy;
    table.prepare = has_prepare(stage) ? prepare : nullptr;
    table.enqueue = enqueue;
    return table;
}

}  // namespace defrec
