// The exported functions for trackers, jobs and templates: check, catch, forward.
#include <array>

#include "sdk/api/destroy.hpp"
#include "sdk/api/job_use.hpp"
#include "sdk/api/read.hpp"
#include "sdk/base/util/image.hpp"
#include "sdk/tracking/frame_result.hpp"
#include "sdk/tracking/scan_order.hpp"

using namespace defrec;

namespace {

defrec_memory_desc read_desc(const defrec_memory_desc* given) {
    const auto desc = read_struct<defrec_memory_desc>("desc", given);
    if (desc.kind != DEFREC_MEMORY_HOST && desc.kind != DEFREC_MEMORY_CUDA)
        fail(DEFREC_ERROR_ARGUMENT, "desc.kind is ", desc.kind, "; HOST (1) and CUDA (2) exist");
    const auto address = reinterpret_cast<uintptr_t>(desc.address);
    if (desc.address == nullptr) fail(DEFREC_ERROR_ARGUMENT, "desc.address is NULL");
    if (address % 16 != 0)
        fail(DEFREC_ERROR_ARGUMENT, "desc.address is ", address % 16,
             " bytes past a multiple of 16, where memory begins");
    if (desc.size == 0 || desc.size > UINTPTR_MAX - address)
        fail(DEFREC_ERROR_ARGUMENT, "desc.size is ", desc.size,
             ", at least 1 and no more than the address space expected");
    return desc;
}

std::shared_ptr<const DeviceBuffer> read_memory(const char* what, defrec_memory given,
                                                const Tracker& tracker) {
    std::shared_ptr<const DeviceBuffer> memory = find_handle(given)->buffer;
    if (!tracker.can_use(*memory))
        fail(DEFREC_ERROR_ARGUMENT, what, ": the memory was imported for another tracker");
    return memory;
}

void expect_pixels(const char* what, const defrec_image& image) {
    if (image.pixels == nullptr)
        fail(DEFREC_ERROR_ARGUMENT, what, ": the image lies in a defrec_memory, pixels expected");
}

// memory_stride: what an image in memory has from row to row.
FrameImage read_frame_image(const char* what, const defrec_image* given, uint32_t format,
                            uint64_t memory_stride, const Tracker& tracker) {
    defrec_image image = read_image(what, given);
    expect_image(what, image, tracker.rig().width(), tracker.rig().height(), format);
    if (image.memory == nullptr)
        return {static_cast<const uint8_t*>(image.pixels), image.stride, nullptr};
    if (image.stride != 0 && image.stride != memory_stride)
        fail(DEFREC_ERROR_ARGUMENT, what, ": stride is ", image.stride,
             " bytes, this tracker takes ", memory_stride, " in memory");
    image.stride = memory_stride;
    FrameImage read{nullptr, memory_stride, read_memory(what, image.memory, tracker)};
    if (read.memory->size() < image_bytes(image))
        fail(DEFREC_ERROR_ARGUMENT, what, ": the memory has ", read.memory->size(), " bytes, ",
             image_bytes(image), " are needed");
    return read;
}

void expect_field(uint32_t field, const std::array<FrameImage, 2>& views) {
    if (field > DEFREC_FIELD_BOTTOM)
        fail(DEFREC_ERROR_ARGUMENT, "frame.field is ", field,
             "; NONE (0), TOP (1) and BOTTOM (2) exist");
    if (field == DEFREC_FIELD_NONE) return;
    for (const FrameImage& view : views)
        if (view.memory != nullptr)
            fail(DEFREC_ERROR_UNSUPPORTED, "frame.field is ", field,
                 " for an image in a defrec_memory; fields are taken of host pixels alone");
}

GivenDisparity read_disparity(const defrec_disparity* given, const Rig& rig,
                              const FrameImage& ignore) {
    const auto disparity = read_struct<defrec_disparity>("disparity", given);
    if (disparity.flags != 0)
        fail(DEFREC_ERROR_ARGUMENT, "disparity.flags is ", disparity.flags, ", 0 expected");
    if (disparity.reserved != 0)
        fail(DEFREC_ERROR_ARGUMENT, "disparity.reserved is ", disparity.reserved, ", 0 expected");
    if (disparity.width != rig.width() || disparity.height != rig.height())
        fail(DEFREC_ERROR_ARGUMENT, "disparity: ", disparity.width, " x ", disparity.height,
             " pixels given, the rectified image has ", rig.width(), " x ", rig.height());
    expect_given("disparity.disparity", disparity.disparity);
    constexpr uint64_t kMaxStride = 1 << 20;
    const uint64_t row = uint64_t{disparity.width} * sizeof(float),
                   stride = disparity.stride != 0 ? disparity.stride : row;
    if (stride < row || stride > kMaxStride || stride % sizeof(float) != 0)
        fail(DEFREC_ERROR_ARGUMENT, "disparity.stride is ", disparity.stride,
             " bytes, a multiple of 4 from ", row, " to ", kMaxStride, " expected");
    for (const float* array : {disparity.disparity, disparity.sigma}) {
        const auto address = reinterpret_cast<uintptr_t>(array);
        if (address % alignof(float) != 0 || address > UINTPTR_MAX - stride * disparity.height)
            fail(DEFREC_ERROR_ARGUMENT, "disparity: no array of floats can lie at its address");
    }
    const GivenDisparity read{disparity.disparity, disparity.sigma, stride, disparity.sigma_px};
    if (const std::string fault = fault_of(read, rig.width(), rig.height()); !fault.empty())
        fail(DEFREC_ERROR_ARGUMENT, "disparity: ", fault);
    if (ignore.memory != nullptr)
        fail(DEFREC_ERROR_UNSUPPORTED,
             "frame.disparity is given with an ignore in a defrec_memory; with one of host pixels "
             "alone it is taken");
    return read;
}

// begin: of the call that the time counts from.
FrameInput::Clock::time_point read_deadline(uint64_t deadline_ns,
                                            FrameInput::Clock::time_point begin) {
    const std::chrono::nanoseconds most = FrameInput::Clock::time_point::max() - begin;
    if (deadline_ns == 0 || deadline_ns >= static_cast<uint64_t>(most.count()))
        return FrameInput::Clock::time_point::max();
    return begin + std::chrono::nanoseconds(deadline_ns);
}

// values: 3x4 row-major.
Eigen::Isometry3d read_motion(const char* name, const double* values) {
    constexpr double kTolerance = 1e-3, kMaxMm = 1e6;
    const Eigen::Isometry3d motion = affine_of(values);
    const Eigen::Matrix3d rotation = motion.linear();
    const double off = (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm();
    if (!(off < kTolerance) || !(rotation.determinant() > 0))
        fail(DEFREC_ERROR_ARGUMENT, "frame.", name, ": its first three columns are no rotation");
    if (!(motion.translation().norm() < kMaxMm))
        fail(DEFREC_ERROR_ARGUMENT, "frame.", name, ": its translation is ",
             motion.translation().norm(), " mm, less than ", kMaxMm, " expected");
    return motion;
}

FrameInput read_frame(const defrec_frame* given, const Tracker& tracker) {
    const FrameInput::Clock::time_point begin = FrameInput::Clock::now();
    const auto frame = read_struct<defrec_frame>("frame", given);
    constexpr uint32_t kKnown =
        DEFREC_FRAME_CAPTURE_TEMPLATE | DEFREC_FRAME_HELD_MOTION | DEFREC_FRAME_CAMERA_POSE;
    if ((frame.flags & ~kKnown) != 0)
        fail(DEFREC_ERROR_ARGUMENT, "frame.flags has unknown bits: ", frame.flags);
    if (frame.reserved != 0)
        fail(DEFREC_ERROR_ARGUMENT, "frame.reserved is ", frame.reserved, ", 0 expected");
    FrameInput input;
    input.timestamp_ns = frame.timestamp_ns;
    input.flags = frame.flags;
    input.field = frame.field;
    input.deadline = read_deadline(frame.deadline_ns, begin);
    input.views[0] =
        read_frame_image("left", frame.left, tracker.format(), tracker.memory_stride(), tracker);
    input.views[1] =
        read_frame_image("right", frame.right, tracker.format(), tracker.memory_stride(), tracker);
    expect_field(frame.field, input.views);
    if (frame.ignore != nullptr)
        input.ignore = read_frame_image("ignore", frame.ignore, DEFREC_FORMAT_GRAY8,
                                        tracker.rig().width(), tracker);
    if (frame.disparity != nullptr)
        input.given_disparity = read_disparity(frame.disparity, tracker.rig(), input.ignore);
    if ((frame.flags & DEFREC_FRAME_HELD_MOTION) != 0)
        input.held_motion = read_motion("held_motion", frame.held_motion);
    if ((frame.flags & DEFREC_FRAME_CAMERA_POSE) != 0)
        input.camera_pose = read_motion("camera_pose", frame.camera_pose);
    if (frame.samples != nullptr) input.samples = read_memory("samples", frame.samples, tracker);
    return input;
}

}  // namespace

extern "C" {

defrec_status defrec_detect_scan(const defrec_image* earlier, const defrec_image* later,
                                 uint32_t* scan) {
    return api_call([&] {
        expect_given("scan", scan);
        const defrec_image before = read_image("earlier", earlier),
                           after = read_image("later", later);
        expect_pixels("earlier", before);
        expect_pixels("later", after);
        if (after.width != before.width || after.height != before.height ||
            after.format != before.format)
            fail(DEFREC_ERROR_ARGUMENT, "later: ", after.width, " x ", after.height,
                 " pixels of format ", after.format, " given, earlier has ", before.width, " x ",
                 before.height, " of format ", before.format);
        *scan = scan_order(before, after);
    });
}

defrec_status defrec_tracker_create(defrec_context context, defrec_rig rig,
                                    const defrec_tracker_desc* desc, defrec_tracker* out) {
    return api_call([&] {
        expect_given("out", out);
        auto object = std::make_shared<TrackerObject>();
        object->context = find_handle(context);
        const auto cameras = find_handle(rig);
        object->tracker = std::make_unique<Tracker>(*object->context, cameras->rig,
                                                    read_struct<defrec_tracker_desc>("desc", desc));
        *out = add_handle<defrec_tracker>(std::move(object));
    });
}

void defrec_tracker_destroy(defrec_tracker tracker) {
    if (tracker == nullptr) return;
    api_call([&] {
        auto object = remove_handle(tracker);
        // However long the frame takes, as long as the device answers.
        if (object.use_count() == 1) object->tracker.reset();
        let_go(std::move(object));
    });
}

defrec_status defrec_memory_import(defrec_tracker tracker, const defrec_memory_desc* desc,
                                   defrec_memory* out) {
    return api_call([&] {
        expect_given("out", out);
        const auto owner = find_handle(tracker);
        const defrec_memory_desc given = read_desc(desc);
        auto object = std::make_shared<MemoryObject>();
        object->context = owner->context;
        object->buffer = owner->tracker->import_memory(given.kind, given.address, given.size);
        *out = add_handle<defrec_memory>(std::move(object));
    });
}

void defrec_memory_release(defrec_memory memory) { destroy_handle(memory); }

defrec_status defrec_tracker_submit(defrec_tracker tracker, const defrec_frame* frame,
                                    defrec_job* out) {
    return api_call([&] {
        expect_given("out", out);
        const auto object = find_handle(tracker);
        const OneThread one(object->inside);
        FrameInput input = read_frame(frame, *object->tracker);
        // The handle first: once the frame is queued nothing may fail any more.
        const auto job = make_object<defrec_job>();
        job->camera_pose = input.camera_pose;
        // Who guesses the handle waits until there is something behind it.
        const std::unique_lock filling(job->in_use);
        const defrec_job handle = add_handle<defrec_job>(job);
        try {
            job->job = object->tracker->submit(std::move(input));
        } catch (...) {
            job->released = true;
            try {
                remove_handle(handle);
            } catch (const Error&) {
                // Who guessed it has released it.
            }
            throw;
        }
        *out = handle;
    });
}

defrec_status defrec_job_wait(defrec_job job, uint64_t timeout_ns) {
    return api_call([&] {
        const JobUse use(job);
        const defrec_status status = use->wait(timeout_ns);
        return status < 0 ? report(status, use->error_text()) : status;
    });
}

void defrec_job_release(defrec_job job) {
    if (job == nullptr) return;
    api_call([&] {
        const auto object = remove_handle(job);
        const std::unique_lock lock(object->in_use);
        if (object->released) return;  // it was never submitted
        object->released = true;
        object->job->release();
        // Without its tracker it holds the last of the device's memory.
        if (object->job->leave(object->job)) return;
        const std::shared_ptr<const Services> services = object->job->services();
        let_go(std::move(object->job), services, {});
    });
}

defrec_status defrec_job_result(defrec_job job, defrec_result* out) {
    return api_call([&] {
        const JobUse use(job);
        checked_struct_size("out", out);
        defrec_result result{};
        result.struct_size = sizeof result;
        use->describe(result);
        write_struct(out, result);
    });
}

defrec_status defrec_job_warp_points(defrec_job job, const double* template_xyz, size_t count,
                                     double* xyz, uint8_t* status, double* expected_error_mm) {
    return api_call([&] {
        const JobUse use(job);
        check_count(count);
        if (count != 0) {
            expect_given("template_xyz", template_xyz);
            expect_given("xyz", xyz);
        }
        use->warp_points(template_xyz, count, xyz, status, expected_error_mm);
    });
}

defrec_status defrec_job_point_covariances(defrec_job job, const double* template_xyz, size_t count,
                                           double* covariance, uint8_t* evidence) {
    return api_call([&] {
        const JobUse use(job);
        check_count(count);
        if (count != 0) {
            expect_given("template_xyz", template_xyz);
            expect_given("covariance", covariance);
        }
        use->point_covariances(template_xyz, count, covariance, evidence);
    });
}

defrec_status defrec_job_move_targets(defrec_job job, defrec_targets targets, size_t count,
                                      double* xyz, double* covariance, uint8_t* status,
                                      double* expected_error_mm) {
    return api_call([&] {
        const JobUse use(job);
        const auto prepared = find_handle(targets);
        if (count != prepared->count())
            fail(DEFREC_ERROR_ARGUMENT, "count is ", count, ", there are ", prepared->count(),
                 " targets");
        if (count != 0) expect_given("xyz", xyz);
        use->move_targets(*prepared, xyz, covariance, status, expected_error_mm);
    });
}

defrec_status defrec_job_move_plan(defrec_job job, defrec_plan plan, size_t count, double* xyz,
                                   double* covariance, uint8_t* status, double* expected_error_mm) {
    return api_call([&] {
        const JobUse use(job);
        const auto object = find_handle(plan);
        if (const size_t points = object->plan->point_count(); count != points)
            fail(DEFREC_ERROR_ARGUMENT, "count is ", count, ", the plan has ", points, " points");
        if (count != 0) expect_given("xyz", xyz);
        object->plan->move(*use, {xyz, covariance, status, expected_error_mm});
    });
}

defrec_status defrec_job_get_template(defrec_job job, defrec_template* out) {
    return api_call([&] {
        const JobUse use(job);
        expect_given("out", out);
        *out = add_handle<defrec_template>(
            std::make_shared<TemplateObject>(use->surface_result().surface));
    });
}

defrec_status defrec_job_lift_points(defrec_job job, const double* uv, size_t count, double* xyz,
                                     uint8_t* found) {
    return api_call([&] {
        const JobUse use(job);
        check_count(count);
        if (count != 0) {
            expect_given("uv", uv);
            expect_given("xyz", xyz);
            expect_given("found", found);
        }
        use->lift_points(uv, count, xyz, found);
    });
}

// ---- templates --------------------------------------------------------------

defrec_status defrec_tracker_get_template(defrec_tracker tracker, defrec_template* out) {
    return api_call([&] {
        expect_given("out", out);
        const auto object = find_handle(tracker);
        *out = add_handle<defrec_template>(
            std::make_shared<TemplateObject>(object->tracker->current_template()));
    });
}

defrec_status defrec_tracker_set_template(defrec_tracker tracker, defrec_template surface) {
    return api_call([&] {
        const auto object = find_handle(tracker);
        const OneThread one(object->inside);
        object->tracker->set_template(find_handle(surface)->surface);
    });
}

void defrec_template_release(defrec_template surface) {
    if (surface != nullptr) api_call([&] { remove_handle(surface); });
}

defrec_status defrec_template_get(defrec_template surface, defrec_template_info* out) {
    return api_call([&] {
        const auto object = find_handle(surface);
        checked_struct_size("out", out);
        defrec_template_info info{};
        info.struct_size = sizeof info;
        object->surface->info(info);
        write_struct(out, info);
    });
}

defrec_status defrec_template_lift(defrec_template surface, const double* uv, size_t count,
                                   double* xyz, uint8_t* found) {
    return api_call([&] {
        const auto object = find_handle(surface);
        check_count(count);
        if (count != 0) {
            expect_given("uv", uv);
            expect_given("xyz", xyz);
            expect_given("found", found);
        }
        object->surface->lift(uv, count, xyz, found);
    });
}

defrec_status defrec_template_point_pieces(defrec_template surface, const double* template_xyz,
                                           size_t count, uint8_t* pieces) {
    return api_call([&] {
        const auto object = find_handle(surface);
        check_count(count);
        if (count != 0) {
            expect_given("template_xyz", template_xyz);
            expect_given("pieces", pieces);
        }
        object->surface->point_pieces(template_xyz, count, pieces);
    });
}

defrec_status defrec_template_set_body(defrec_template surface, const defrec_body_desc* desc) {
    return api_call([&] {
        const auto object = find_handle(surface);
        if (desc == nullptr) return object->surface->set_body(nullptr);
        const auto given = read_struct<defrec_body_desc>("desc", desc);
        object->surface->set_body(&given);
    });
}

defrec_status defrec_template_wait_body(defrec_template surface, uint64_t timeout_ns) {
    return api_call([&] { return find_handle(surface)->surface->wait_body(timeout_ns); });
}

defrec_status defrec_targets_create(defrec_template surface, const double* template_xyz,
                                    size_t count, defrec_targets* out) {
    return api_call([&] {
        expect_given("out", out);
        const auto object = find_handle(surface);
        if (count != 0) expect_given("template_xyz", template_xyz);
        *out = add_handle<defrec_targets>(
            std::make_shared<PreparedTargets>(object->surface, template_xyz, count));
    });
}

size_t defrec_targets_count(defrec_targets targets) {
    size_t count = 0;
    api_call([&] { count = find_handle(targets)->count(); });
    return count;
}

void defrec_targets_destroy(defrec_targets targets) {
    if (targets != nullptr) api_call([&] { remove_handle(targets); });
}

defrec_status defrec_template_save(defrec_template surface, const char* path) {
    return api_call([&] {
        const auto object = find_handle(surface);
        expect_given("path", path);
        object->surface->save(path);
    });
}

defrec_status defrec_template_load(defrec_context context, const char* path, defrec_template* out) {
    return api_call([&] {
        expect_given("out", out);
        expect_given("path", path);
        const auto owner = find_handle(context);
        *out = add_handle<defrec_template>(
            std::make_shared<TemplateObject>(Template::load(*owner, path)));
    });
}

}  // extern "C"
