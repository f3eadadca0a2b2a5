// See check_output.hpp. A look without a branch at whole arrays finds whether there is something;
// only then a second one says what.
#include "sdk/tracking/stages/check_output.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>

#include "sdk/base/util/error.hpp"
#include "sdk/tracking/decisions/stages.hpp"
#include "sdk/tracking/stages/pipeline.hpp"

namespace defrec {
namespace {

constexpr int32_t kMaxScore = 4096, kMaxHamming = 256, kMaxReferences = 1024;

uint32_t not_finite(float value) {
    return (std::bit_cast<uint32_t>(value) & 0x7f800000u) == 0x7f800000u ? 1 : 0;
}
template <size_t kCount>
uint32_t not_finite(const float (&values)[kCount]) {
    uint32_t found = 0;
    for (const float value : values) found |= not_finite(value);
    return found;
}
// Unsigned, so that negative ones are above any limit.
uint32_t above(int32_t value, int32_t max) {
    return static_cast<uint32_t>(value) > static_cast<uint32_t>(max) ? 1 : 0;
}
uint32_t far_outside(int32_t coordinate) {
    constexpr int32_t kFar = DEFREC_MAX_SIDE * 256;
    return coordinate < -kFar || coordinate > kFar ? 1 : 0;
}

template <class Record, class IsWrong>
void check_all(std::span<const Record> records, const char* stage, const char* buffer,
               const IsWrong& is_wrong) {
    uint32_t found = 0;
    for (const Record& record : records) found |= is_wrong(record);
    if (found == 0) return;
    const auto wrong = std::find_if(records.begin(), records.end(),
                                    [&](const Record& record) { return is_wrong(record) != 0; });
    fail(DEFREC_ERROR_PLUGIN, "stage ", stage, " gave ", buffer, " ", wrong - records.begin(),
         " a value that it never has");
}

uint32_t is_wrong(const defrec_surface_sample& sample) {
    return not_finite(sample.position) | not_finite(sample.normal) | not_finite(sample.residual) |
           (sample.observation > DEFREC_INCONSISTENT ? 1u : 0u);
}
uint32_t is_wrong(const defrec_patch_observation& patch) {
    return not_finite(patch.information) | above(patch.valid, 1) |
           (patch.score < -kMaxScore || patch.score > kMaxScore ? 1u : 0u) | far_outside(patch.u) |
           far_outside(patch.v);
}
// Nothing is used of one that is not valid.
uint32_t is_wrong(const defrec_patch_prediction& patch) {
    return above(patch.valid, 1) |
           (patch.valid == 1 ? far_outside(patch.u) | far_outside(patch.v) : 0u);
}
uint32_t is_wrong(const defrec_motion& motion) {
    using decisions::StageOutput;
    float length = 0;
    for (const float value : motion.real) length += value * value;
    return not_finite(motion.real) | not_finite(motion.dual) |
           (length > StageOutput::kMinSquaredNorm && length < StageOutput::kMaxSquaredNorm ? 0u
                                                                                           : 1u);
}
uint32_t is_wrong(const defrec_match& match, int32_t features) {
    return (match.feature < -1 || match.feature >= features ? 1u : 0u) |
           above(match.distance, kMaxHamming) | above(match.second, kMaxHamming) |
           not_finite(match.u) | not_finite(match.v) | not_finite(match.position) |
           (match.weight >= 0 && match.weight <= 1 ? 0u : 1u);
}
uint32_t is_wrong(const defrec_ransac_summary& summary, int32_t landmarks) {
    return above(summary.valid_matches, landmarks) | above(summary.inliers, landmarks) |
           above(summary.best_support, landmarks) | above(summary.references, kMaxReferences) |
           not_finite(summary.rotation) | not_finite(summary.translation);
}

void check_feature_count(uint32_t count, uint32_t max) {
    if (count > max)
        fail(DEFREC_ERROR_PLUGIN, "stage orb gave a count of ", count, " features where at most ",
             max, " fit");
}

// Calls visit(records, stage, buffer, is_wrong) for what the stages gave, but for the samples.
template <class Visit>
void visit_records(const FrameOutput& output, const TemplateData& data, const Visit& visit) {
    const auto all = [&visit]<class Record>(std::span<Record> records, const char* stage,
                                            const char* buffer) {
        visit(std::span<const Record>(records), stage, buffer,
              [](const Record& record) { return is_wrong(record); });
    };
    const FrameSummary& summary = *output.summary;
    const auto features = static_cast<int32_t>(summary.features);
    const auto landmarks = static_cast<int32_t>(data.landmarks.size());
    visit(std::span<const defrec_match>(output.matches), "ransac", "match",
          [=](const defrec_match& match) { return is_wrong(match, features); });
    visit(std::span<const defrec_ransac_summary>(&summary.ransac, 1), "ransac", "summary",
          [=](const defrec_ransac_summary& one) { return is_wrong(one, landmarks); });
    all(output.motions, "lm", "motion");
    all(output.observations, "align", "observation");
    all(output.predictions, "align", "prediction");
    all(output.checks, "align", "observation");
    all(output.check_predictions, "align", "prediction");
    all(output.right_observations, "align", "observation in the right view");
}

}  // namespace

bool any_wrong_record(const FrameOutput& output, const TemplateData& data, uint32_t max_features,
                      ArrayPart part) {
    if (output.summary->features > max_features) return true;
    uint32_t found = 0;
    visit_records(
        output, data, [&](auto records, const char*, const char*, const auto& is_wrong_one) {
            const size_t begin = part.begin(records.size()), end = part.end(records.size());
            for (size_t i = begin; i < end; ++i) found |= is_wrong_one(records[i]);
        });
    return found != 0;
}

// By bits: of a float that is not finite all of the exponent is set, and one more carries into the
// highest bit, as an observation beyond the last does with what is missing.
bool any_wrong_sample(std::span<const defrec_surface_sample> samples) {
    using Words = std::array<uint32_t, sizeof(defrec_surface_sample) / sizeof(uint32_t)>;
    constexpr uint32_t kTop = 0x80000000u, kExponent = 0x7f800000u, kOne = 0x00800000u;
    constexpr Words kKept = {kExponent, kExponent, kExponent, kExponent,
                             kExponent, kExponent, kExponent, ~0u},
                    kAdded = {kOne, kOne, kOne, kOne,
                              kOne, kOne, kOne, kTop - 1 - DEFREC_INCONSISTENT},
                    kOwn = {0, 0, 0, 0, 0, 0, 0, kTop};
    static_assert(offsetof(defrec_surface_sample, observation) == 7 * sizeof(uint32_t));
    Words found{};
    for (const defrec_surface_sample& sample : samples) {
        const auto words = std::bit_cast<Words>(sample);
        for (size_t k = 0; k < words.size(); ++k)
            found[k] |= ((words[k] & kKept[k]) + kAdded[k]) | (words[k] & kOwn[k]);
    }
    uint32_t all = 0;
    for (const uint32_t word : found) all |= word;
    return (all & kTop) != 0;
}

void check_output(const FrameOutput& output, const TemplateData& data, uint32_t max_features) {
    check_feature_count(output.summary->features, max_features);
    visit_records(
        output, data,
        [](auto records, const char* stage, const char* buffer, const auto& is_wrong_one) {
            check_all(records, stage, buffer, is_wrong_one);
        });
    check_all(std::span<const defrec_surface_sample>(output.samples), "warp", "sample",
              [](const defrec_surface_sample& sample) { return is_wrong(sample); });
}

void check_front(const FrontImages& images, uint32_t width, uint32_t height,
                 uint32_t max_features) {
    check_feature_count(images.feature_count, max_features);
    const auto right = static_cast<int32_t>(16 * width), bottom = static_cast<int32_t>(16 * height);
    check_all(std::span(images.features).first(images.feature_count), "orb", "feature",
              [=](const defrec_feature& feature) {
                  constexpr uint32_t kMaxLevels = 8;
                  return above(feature.x, right) | above(feature.y, bottom) |
                         (feature.level >= kMaxLevels ? 1u : 0u) |
                         (feature.angle >= DEFREC_ORB_ANGLE_BINS ? 1u : 0u);
              });
    if (images.given_sigma_px > 0) return;  // it was checked as it was given
    // Ranges are searched in twos, at half resolution: an odd one may be left by one more.
    const auto end = static_cast<int32_t>(DEFREC_DISPARITY_ONE * (images.searched_end + 2));
    check_all(std::span<const int16_t>(images.disparity), "stereo", "pixel", [=](int16_t value) {
        return value != DEFREC_DISPARITY_NONE ? above(value, end) : 0u;
    });
}

}  // namespace defrec
