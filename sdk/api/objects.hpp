// What stands behind each C handle.
#pragma once
#include <Eigen/Geometry>
#include <memory>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <string>
#include <vector>

#include "sdk/api/handles.hpp"
#include "sdk/base/util/error.hpp"
#include "sdk/device/context.hpp"
#include "sdk/device/stage_runner.hpp"
#include "sdk/hand_eye/hand_eye.hpp"
#include "sdk/plan/plan.hpp"
#include "sdk/predictor/predictor.hpp"
#include "sdk/registration/model_surface.hpp"
#include "sdk/registration/registration.hpp"
#include "sdk/rig/rig.hpp"
#include "sdk/template/template.hpp"
#include "sdk/tracking/points/prepared_targets.hpp"
#include "sdk/tracking/tracker.hpp"

namespace defrec {

// Held by the one thread that may be inside a handle of a function marked "threads: one".
class OneThread {
  public:
    explicit OneThread(std::mutex& mutex) : lock_(mutex, std::try_to_lock) {
        if (!lock_) fail(DEFREC_ERROR_BUSY, "another thread is inside this handle");
    }

  private:
    std::unique_lock<std::mutex> lock_;
};

struct RigObject {
    std::shared_ptr<Context> context;
    std::shared_ptr<const Rig> rig;
};
struct TrackerObject {
    std::shared_ptr<Context> context;
    std::unique_ptr<Tracker> tracker;
    std::mutex inside;
};
struct TemplateObject {
    explicit TemplateObject(std::shared_ptr<const Template> given) : surface(std::move(given)) {}
    std::shared_ptr<const Template> surface;
};
struct MemoryObject {
    std::shared_ptr<Context> context;
    std::shared_ptr<const DeviceBuffer> buffer;
};
struct JobObject {
    std::shared_ptr<Job> job;
    std::optional<Eigen::Isometry3d> camera_pose;  // as defrec_frame had it
    std::shared_mutex in_use;  // shared by whoever reads the job, alone for its release
    bool released = false;
};
// Neither changes once it is made. With the texts that its description points to.
struct RegistrationObject {
    Registration found;
    ModelFindings model;
    bool model_has_outside = false;
    std::vector<uint32_t> triangles;
    std::vector<std::string> free_texts;
};
struct HandEyeObject {
    HandEyeCalibration found;
    std::string notes;
    std::vector<std::string> free_texts;
};
// With the parts that its description points to.
struct PlanObject {
    std::shared_ptr<const Plan> plan;
    std::vector<defrec_plan_part> parts;
    std::vector<const char*> target_names;
};
struct PredictorObject {
    explicit PredictorObject(size_t points) : predictor(points) {}
    Predictor predictor;
    std::mutex inside;  // a call waits for another one's end
};
struct StageObject {
    StageObject(std::shared_ptr<Context> owner, const DeviceChoice& device,
                const StageParams& params)
        : context(std::move(owner)), runner(device, params) {}
    std::shared_ptr<Context> context;
    StageRunner runner;
    std::mutex inside;
};

template <>
struct HandleTraits<defrec_context> {
    static constexpr HandleKind kind = HandleKind::kContext;
    using Object = Context;
};
template <>
struct HandleTraits<defrec_rig> {
    static constexpr HandleKind kind = HandleKind::kRig;
    using Object = RigObject;
};
template <>
struct HandleTraits<defrec_tracker> {
    static constexpr HandleKind kind = HandleKind::kTracker;
    using Object = TrackerObject;
};
template <>
struct HandleTraits<defrec_template> {
    static constexpr HandleKind kind = HandleKind::kTemplate;
    using Object = TemplateObject;
};
template <>
struct HandleTraits<defrec_job> {
    static constexpr HandleKind kind = HandleKind::kJob;
    using Object = JobObject;
};
template <>
struct HandleTraits<defrec_memory> {
    static constexpr HandleKind kind = HandleKind::kMemory;
    using Object = MemoryObject;
};
template <>
struct HandleTraits<defrec_targets> {
    static constexpr HandleKind kind = HandleKind::kTargets;
    using Object = PreparedTargets;
};
template <>
struct HandleTraits<defrec_registration> {
    static constexpr HandleKind kind = HandleKind::kRegistration;
    using Object = RegistrationObject;
};
template <>
struct HandleTraits<defrec_hand_eye> {
    static constexpr HandleKind kind = HandleKind::kHandEye;
    using Object = HandEyeObject;
};
template <>
struct HandleTraits<defrec_plan> {
    static constexpr HandleKind kind = HandleKind::kPlan;
    using Object = PlanObject;
};
template <>
struct HandleTraits<defrec_predictor> {
    static constexpr HandleKind kind = HandleKind::kPredictor;
    using Object = PredictorObject;
};
template <>
struct HandleTraits<defrec_stage> {
    static constexpr HandleKind kind = HandleKind::kStage;
    using Object = StageObject;
};

}  // namespace defrec
