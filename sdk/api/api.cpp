// The exported functions for contexts, rigs and stages: check, catch, forward. tracking.cpp has
// the rest.
#include "sdk/api/destroy.hpp"
#include "sdk/api/read.hpp"
#include "sdk/base/util/check_ranges.hpp"
#include "sdk/base/util/struct_size.hpp"

using namespace defrec;

namespace {

defrec_context_desc read_desc(const defrec_context_desc* given) {
    if (given == nullptr) return {};
    const auto desc = read_struct<defrec_context_desc>("desc", given);
    constexpr uint32_t kKnown = DEFREC_CONTEXT_ONLY_GIVEN_PLUGINS | DEFREC_CONTEXT_USE_ENVIRONMENT;
    if ((desc.flags & ~kKnown) != 0)
        fail(DEFREC_ERROR_ARGUMENT, "desc.flags has unknown bits: ", desc.flags & ~kKnown);
    check_ranges(desc);
    if (desc.plugin_paths == nullptr && desc.plugin_path_count != 0)
        fail(DEFREC_ERROR_ARGUMENT, "desc.plugin_paths is NULL with a count of ",
             desc.plugin_path_count);
    for (size_t i = 0; i < desc.plugin_path_count; ++i)
        if (desc.plugin_paths[i] == nullptr)
            fail(DEFREC_ERROR_ARGUMENT, "desc.plugin_paths[", i, "] is NULL");
    return desc;
}

void check_pixels(const char* name, const double* in, size_t count, const double* out) {
    if (count == 0) return;
    if (in == nullptr || out == nullptr)
        fail(DEFREC_ERROR_ARGUMENT, name, " or the output is NULL with a count of ", count);
    check_count(count);
}

}  // namespace

extern "C" {

// ---- library ----------------------------------------------------------------

uint32_t defrec_version(void) { return DEFREC_API_MAJOR * 1000 + DEFREC_API_MINOR; }
const char* defrec_version_string(void) { return DEFREC_RELEASE; }
const char* defrec_status_name(defrec_status status) { return status_name(status); }
const char* defrec_last_error(void) { return last_error(); }

// ---- context ----------------------------------------------------------------

defrec_status defrec_context_create(const defrec_context_desc* desc, defrec_context* out) {
    return api_call([&] {
        expect_given("out", out);
        *out = add_handle<defrec_context>(Context::create(read_desc(desc)));
    });
}

void defrec_context_destroy(defrec_context context) { destroy_handle(context); }

size_t defrec_plugin_count(defrec_context context) {
    size_t count = 0;
    api_call([&] { count = find_handle(context)->candidates().size(); });
    return count;
}

defrec_status defrec_plugin_get(defrec_context context, size_t index, defrec_plugin_info* out) {
    return api_call([&] {
        const auto object = find_handle(context);  // may be destroyed meanwhile
        const auto& candidates = object->candidates();
        check_index(index, candidates.size(), "plugins");
        const PluginCandidate& plugin = candidates[index];
        write_struct(out, defrec_plugin_info{sizeof(defrec_plugin_info), plugin.verdict,
                                             plugin.name.c_str(), plugin.path.c_str(),
                                             plugin.version.c_str(), plugin.reason.c_str()});
    });
}

size_t defrec_device_count(defrec_context context) {
    size_t count = 0;
    api_call([&] { count = find_handle(context)->device_count(); });
    return count;
}

defrec_status defrec_device_get(defrec_context context, size_t index, defrec_device_info* out) {
    return api_call([&] {
        const auto object = find_handle(context);
        check_index(index, object->device_count(), "devices");
        write_struct(out, object->device_info(index));
    });
}

// ---- rigs -------------------------------------------------------------------

defrec_status defrec_rig_create(defrec_context context, const defrec_rig_desc* desc,
                                defrec_rig* out) {
    return api_call([&] {
        expect_given("out", out);
        auto object = std::make_shared<RigObject>();
        object->context = find_handle(context);
        object->rig = std::make_shared<const Rig>(object->context->allocator(),
                                                  read_struct<defrec_rig_desc>("desc", desc));
        *out = add_handle<defrec_rig>(std::move(object));
    });
}

void defrec_rig_destroy(defrec_rig rig) { destroy_handle(rig); }

defrec_status defrec_rig_get(defrec_rig rig, defrec_rig_info* out) {
    return api_call([&] { write_struct(out, find_handle(rig)->rig->info()); });
}

defrec_status defrec_rig_rectify_pixels(defrec_rig rig, const double* raw_uv, size_t count,
                                        double* rectified_uv) {
    return api_call([&] {
        const auto object = find_handle(rig);
        check_pixels("raw_uv", raw_uv, count, rectified_uv);
        object->rig->rectify_pixels(0, raw_uv, count, rectified_uv);
    });
}

defrec_status defrec_rig_distort_pixels(defrec_rig rig, const double* rectified_uv, size_t count,
                                        double* raw_uv) {
    return api_call([&] {
        const auto object = find_handle(rig);
        check_pixels("rectified_uv", rectified_uv, count, raw_uv);
        object->rig->distort_pixels(0, rectified_uv, count, raw_uv);
    });
}

// ---- stages on their own ----------------------------------------------------

defrec_status defrec_stage_create(defrec_context context, const char* device_id, uint32_t stage,
                                  const void* params, defrec_stage* out) {
    return api_call([&] {
        expect_given("out", out);
        const auto owner = find_handle(context);
        const StageParams complete(stage, params);
        *out = add_handle<defrec_stage>(std::make_shared<StageObject>(
            owner, owner->choose_device(device_id, 1u << stage).devices.front(), complete));
    });
}

void defrec_stage_destroy(defrec_stage stage) { destroy_handle(stage); }

defrec_status defrec_stage_prepare(defrec_stage stage, const defrec_const_buffer* in,
                                   size_t in_count) {
    return api_call([&] {
        const auto object = find_handle(stage);
        const OneThread one(object->inside);
        object->runner.prepare(in, in_count);
    });
}

defrec_status defrec_stage_run(defrec_stage stage, const defrec_const_buffer* in, size_t in_count,
                               const defrec_buffer* out, size_t out_count) {
    return api_call([&] {
        const auto object = find_handle(stage);
        const OneThread one(object->inside);
        object->runner.run(in, in_count, out, out_count);
    });
}

}  // extern "C"
