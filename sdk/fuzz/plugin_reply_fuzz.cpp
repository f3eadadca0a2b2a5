// What a plugin's stages give for a frame: it is refused, or all that the host computes from it is
// defined.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "sdk/base/util/error.hpp"
#include "sdk/template/capture.hpp"
#include "sdk/template/check_patches.hpp"
#include "sdk/tracking/evidence/photometric_evidence.hpp"
#include "sdk/tracking/evidence/vertex_confidence.hpp"
#include "sdk/tracking/monitors/disparity_monitor.hpp"
#include "sdk/tracking/monitors/frame_state.hpp"
#include "sdk/tracking/monitors/row_monitor.hpp"
#include "sdk/tracking/stages/check_output.hpp"

namespace {

using namespace defrec;

constexpr uint32_t kWidth = 96, kHeight = 72, kMaxFeatures = 100;

// The template of a textured plane.
Template make_template() {
    std::vector<uint8_t> gray(kWidth * kHeight), mask(gray.size(), 255);
    for (uint32_t i = 0; i < gray.size(); ++i) {
        const uint32_t x = i % kWidth, y = i / kWidth;
        gray[i] = static_cast<uint8_t>(128 + 60 * std::sin(0.9 * x) * std::cos(0.7 * y));
    }
    const std::vector<int16_t> disparity(gray.size(), 96);
    CaptureInput input;
    input.width = kWidth;
    input.height = kHeight;
    input.camera = {100, 100, kWidth / 2.0, kHeight / 2.0, 5, 0};
    input.gray = gray.data();
    input.mask = mask.data();
    input.disparity = disparity.data();
    input.node_spacing_px = 20;
    std::optional<TemplateData> data = capture_template(input);
    if (!data) __builtin_trap();
    return Template(std::move(*data));
}

// The bytes go over what a good frame gives, again and again: each run of three says where.
class Reply {
  public:
    explicit Reply(const TemplateData& data)
        : motions_(data.nodes.size() / 3, DualQuaternion<float>::identity().store()),
          samples_(data.vertices.size()),
          matches_(data.landmarks.size()),
          observations_(data.patches.size()),
          predictions_(data.patches.size()),
          checks_(data.checks.size()),
          check_predictions_(data.checks.size()),
          right_(rig_patch_count(data)) {
        for (size_t i = 0; i < samples_.size(); ++i) {
            std::copy_n(data.vertices[i].position, 3, samples_[i].position);
            std::copy_n(data.vertices[i].normal, 3, samples_[i].normal);
        }
        output.summary = &summary_;
        output.motions = motions_;
        output.samples = samples_;
        output.matches = matches_;
        output.observations = observations_;
        output.predictions = predictions_;
        output.checks = checks_;
        output.check_predictions = check_predictions_;
        output.right_observations = right_;
    }
    void overwrite(const uint8_t* data, size_t size) {
        const std::span<std::byte> arrays[] = {
            std::as_writable_bytes(std::span(&summary_, 1)),
            std::as_writable_bytes(std::span(motions_)),
            std::as_writable_bytes(std::span(samples_)),
            std::as_writable_bytes(std::span(matches_)),
            std::as_writable_bytes(std::span(observations_)),
            std::as_writable_bytes(std::span(predictions_)),
            std::as_writable_bytes(std::span(checks_)),
            std::as_writable_bytes(std::span(check_predictions_)),
            std::as_writable_bytes(std::span(right_))};
        constexpr size_t kValue = sizeof(uint32_t), kStep = 3 + kValue;
        for (; size >= kStep; data += kStep, size -= kStep) {
            const std::span<std::byte> array = arrays[data[0] % std::size(arrays)];
            const size_t values = array.size() / kValue;
            if (values == 0) continue;
            const size_t place = (data[1] + 256u * data[2]) % values;
            std::memcpy(array.data() + place * kValue, data + 3, kValue);
        }
    }

    FrameOutput output;

  private:
    FrameSummary summary_;
    std::vector<defrec_motion> motions_;
    std::vector<defrec_surface_sample> samples_;
    std::vector<defrec_match> matches_;
    std::vector<defrec_patch_observation> observations_;
    std::vector<defrec_patch_prediction> predictions_;
    std::vector<defrec_patch_observation> checks_;
    std::vector<defrec_patch_prediction> check_predictions_;
    std::vector<defrec_patch_observation> right_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static const Template surface = make_template();
    const TemplateData& model_data = surface.data();
    static const SurfaceModel model(model_data);
    Reply reply(model_data);
    const std::vector<defrec_surface_sample> last(reply.output.samples.begin(),
                                                  reply.output.samples.end());
    reply.overwrite(data, size);
    // In a frame this is measured before what it is measured of has been checked.
    std::vector<double> patch_px2(model_data.patches.size());
    measure_patches(model_data, reply.output, 0, patch_px2);
    const VertexEvidence vertices = weigh_vertices(reply.output.samples);
    static_cast<void>(count_moved_farther(last, reply.output.samples, 5));
    const RigidSums sums = sum_for_rigid_motion(model, reply.output.samples, 0);
    PhotometricEvidence photometric;
    photometric.make_room(model_data);
    spread_patches(model_data, patch_px2, photometric);
    spread_checks(model_data, model.checked, reply.output, photometric);
    measure_photometric(model_data, reply.output, 0, reply.output.samples.size(), photometric);
    DisparityMonitor disparities;
    disparities.make_room();
    disparities.add_frame(model_data, reply.output.samples);
    std::vector<RigPatch> last_patches, patches;
    std::vector<RowMatch> row_matches;
    RowMonitor monitor(kWidth, kHeight);
    RigEstimate rig;
    for (int frame = 0; frame < 2; ++frame) {
        match_rows(model_data, reply.output, last_patches, patches, row_matches);
        last_patches = patches;
        rig = monitor.update(row_matches);
    }
    try {
        check_output(reply.output, model_data, kMaxFeatures);
    } catch (const Error&) {
        return 0;
    }
    const Evidence evidence = weigh_evidence(reply.output, {&vertices, 1}, patch_px2);
    static_cast<void>(classify(model_data, evidence, with_defaults({}), true));
    VertexConfidence confidence;
    begin_confidence(model, confidence);
    double motion[12];
    estimate_confidence(
        model,
        {reply.output, photometric, static_cast<float>(evidence.mean_residual_mm), rig, last, true},
        nullptr,
        [&] {
            fit_rigid_motion(model, {&sums, 1}, motion);
        },
        confidence);
    return 0;
}
