// Frames through the tracker, by the C API alone.
#pragma once
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "conformance/cases/sequence/rendered_sequence.hpp"
#include "include/defrec_c.h"

namespace defrec::conformance {

// Destroys a handle of the C API.
template <class T, void(DEFREC_CALL* destroy)(T)>
class Handle {
  public:
    Handle() = default;
    explicit Handle(T handle) : handle_(handle) {}
    Handle(Handle&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
    Handle& operator=(Handle&& other) noexcept {
        std::swap(handle_, other.handle_);
        return *this;
    }
    ~Handle() { reset(); }

    T get() const { return handle_; }
    T* out() { return &handle_; }
    void reset() { destroy(std::exchange(handle_, nullptr)); }

  private:
    T handle_ = nullptr;
};
using ContextHandle = Handle<defrec_context, defrec_context_destroy>;
using RigHandle = Handle<defrec_rig, defrec_rig_destroy>;
using TrackerHandle = Handle<defrec_tracker, defrec_tracker_destroy>;
using JobHandle = Handle<defrec_job, defrec_job_release>;
using TemplateHandle = Handle<defrec_template, defrec_template_release>;

// Throws CaseFailure with the call and the library's error message unless status is 0 or more.
void check_api(const char* call, defrec_status status);

// A device to track on: a plugin's manifest, and the device's id.
struct TrackingDevice {
    std::string manifest, device_id;

    auto operator<=>(const TrackingDevice&) const = default;
};

// A context with this plugin alone. desc: what else is wanted; its paths are set here.
ContextHandle open_context(const std::string& manifest, defrec_context_desc desc);
ContextHandle open_context(const std::string& manifest);
TrackerHandle open_tracker(defrec_context context, defrec_rig rig, const std::string& device_id,
                           bool grows = false);
defrec_image image_of(const RenderedSequence& sequence, const std::vector<uint8_t>& pixels);
JobHandle submit(defrec_tracker tracker, const RenderedSequence& sequence, size_t frame);

struct TrackedFrame {
    uint32_t state = 0, reasons = 0, epoch = 0, age = 0;
    uint32_t template_epoch = 0;
    std::vector<float> vertices;         // xyz
    std::vector<uint8_t> vertex_status;  // DEFREC_POINT_*
    std::vector<float> expected_error;   // of each vertex, mm
    std::vector<double> points;          // the sequence's points now: xyz, rectified camera, mm
    std::vector<uint8_t> point_status;

    bool has_surface() const {
        return state == DEFREC_TRACKING || state == DEFREC_DEGRADED || state == DEFREC_RELOCALISED;
    }
};

struct Track {
    std::array<double, 9> rectification{};  // x_rectified = rectification * x_left
    defrec_camera camera{};
    uint64_t template_digest = 0;  // of everything that the template consists of
    std::vector<uint8_t>
        on_surface;  // of each of the sequence's points: the template has a surface there
    std::vector<TrackedFrame> frames;
};

// The result of a job that has been waited for. points: template frame, as lifted.
TrackedFrame result_of(defrec_job job, const std::vector<double>& points);
// Captures the template from the first frame and follows the rest, in a context of its own or a
// given one. Throws CaseFailure.
Track track(const TrackingDevice& device, const RenderedSequence& sequence);
Track track_in(defrec_context context, const std::string& device_id,
               const RenderedSequence& sequence);
// The same, computed once in a process for each device and sequence: for the reference, which is
// slow.
const Track& kept_track(const TrackingDevice& device, const RenderedSequence& sequence);

}  // namespace defrec::conformance
