// See compare_records.hpp.
#include "conformance/compare/compare_records.hpp"

#include <algorithm>
#include <cmath>

#include "backends/shared/motion.hpp"
#include "backends/shared/record_scales.h"

namespace defrec::conformance {
namespace {

double distance(const float a[3], const float b[3]) {
    return std::sqrt((double(a[0]) - b[0]) * (double(a[0]) - b[0]) +
                     (double(a[1]) - b[1]) * (double(a[1]) - b[1]) +
                     (double(a[2]) - b[2]) * (double(a[2]) - b[2]));
}

template <class Params>
const Params& params_of(const StageJob& job) {
    return *static_cast<const Params*>(job.params.get());
}

// "matches[3].feature is -1, 7 expected".
template <class T>
void same(const char* record, size_t i, const char* field, T expected, T found) {
    require(expected == found, record, "[", i, "].", field, " is ", found, ", ", expected,
            " expected");
}

// Everything of a match but what `skip` names.
void same_match(size_t i, const defrec_match& a, const defrec_match& b) {
    same("matches", i, "feature", a.feature, b.feature);
    same("matches", i, "distance", a.distance, b.distance);
    same("matches", i, "second", a.second, b.second);
    same("matches", i, "reserved", a.reserved, b.reserved);
}

}  // namespace

// ---- match ------------------------------------------------------------------

void match_spread(const StageJob&, const std::vector<Bytes>& expected,
                  const std::vector<Bytes>& found, Spread& spread) {
    const auto a = as<defrec_match>(expected[0]), b = as<defrec_match>(found[0]);
    Distances& position = spread["match.position"];
    for (size_t i = 0; i < a.size(); ++i) {
        same_match(i, a[i], b[i]);
        same("matches", i, "u", a[i].u, b[i].u);
        same("matches", i, "v", a[i].v, b[i].v);
        same("matches", i, "weight", a[i].weight, b[i].weight);
        if (a[i].position[2] == 0)
            for (int k = 0; k < 3; ++k) same("matches", i, "position", 0.0f, b[i].position[k]);
        else
            position.add(100 * distance(a[i].position, b[i].position) / double(a[i].position[2]));
    }
}

// ---- align ------------------------------------------------------------------

void align_spread(const StageJob& job, const std::vector<Bytes>& expected,
                  const std::vector<Bytes>& found, Spread& spread) {
    const auto& p = params_of<defrec_align_params>(job);
    const auto a = as<defrec_patch_prediction>(expected[1]),
               b = as<defrec_patch_prediction>(found[1]);
    const auto near_limit = [&](const defrec_patch_prediction& one) {
        const auto near = [&](int32_t at, uint32_t side) {
            const int32_t margin = int32_t((p.patch_radius + 2) << p.level) * kPatchOne,
                          far = int32_t(side - 1) * kPatchOne - margin;
            return std::abs(int64_t{at} - margin) <= 1 || std::abs(int64_t{at} - far) <= 1;
        };
        return near(one.u, p.width) || near(one.v, p.height);
    };
    for (size_t i = 0; i < a.size(); ++i) {
        require(b[i].valid == 0 || b[i].valid == 1, "predictions[", i, "].valid is ", b[i].valid,
                ", 0 or 1 expected");
        if (a[i].valid != b[i].valid && near_limit(a[i].valid != 0 ? a[i] : b[i])) continue;
        same("predictions", i, "valid", a[i].valid, b[i].valid);
        same("predictions", i, "reserved", a[i].reserved, b[i].reserved);
        // As double: a conversion that went wrong gives INT32_MIN, from which the distance is no
        // int32.
        spread["align.prediction"].add(
            std::max(std::abs(double(a[i].u) - b[i].u), std::abs(double(a[i].v) - b[i].v)));
        for (int k = 0; k < 4; ++k)
            spread["align.matrix"].add(a[i].view_from_live[k], b[i].view_from_live[k]);
    }
}

// ---- ransac -----------------------------------------------------------------

namespace {

constexpr double kKept = 0.8;  // docs/stages/ransac.md: smaller weights become 0
constexpr double kKeptBand =
    1.1e-4;  // beside it a weight may fall on either side: the tolerance of ransac.weight

}  // namespace

void ransac_weight_spread(const StageJob&, const std::vector<Bytes>& expected,
                          const std::vector<Bytes>& found, Spread& spread) {
    const auto a = as<defrec_match>(expected[0]), b = as<defrec_match>(found[0]);
    for (size_t i = 0; i < a.size(); ++i) {
        defrec_match given = a[i], got = b[i];
        given.weight = got.weight = 0;
        // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): the bits are compared
        if (std::memcmp(&given, &got, sizeof given) != 0) {
            same_match(i, a[i], b[i]);
            fail_case("matches[", i, "] is not as given in u, v or position");
        }
        const double kept = std::max(double(a[i].weight), double(b[i].weight));
        const bool one_is_dropped = (a[i].weight == 0) != (b[i].weight == 0);
        if (one_is_dropped && std::abs(kept - kKept) <= kKeptBand) continue;
        spread["ransac.weight"].add(double(a[i].weight), double(b[i].weight));
    }
    const auto s = as<defrec_ransac_summary>(expected[1])[0],
               t = as<defrec_ransac_summary>(found[1])[0];
    same("summary", 0, "valid_matches", s.valid_matches, t.valid_matches);
    spread["ransac.references"].add(s.references, t.references);
    spread["ransac.support"].add(s.inliers, t.inliers);
    spread["ransac.support"].add(s.best_support, t.best_support);
    require_finite("summary.rotation", t.rotation);
    require_finite("summary.translation", t.translation);
}

void ransac_spread(const StageJob& job, const std::vector<Bytes>& expected,
                   const std::vector<Bytes>& found, Spread& spread) {
    ransac_weight_spread(job, expected, found, spread);
    const auto s = as<defrec_ransac_summary>(expected[1])[0],
               t = as<defrec_ransac_summary>(found[1])[0];
    for (int k = 0; k < 9; ++k)
        spread["ransac.rotation"].add(double(s.rotation[k]), double(t.rotation[k]));
    for (int k = 0; k < 3; ++k)
        spread["ransac.translation"].add(double(s.translation[k]), double(t.translation[k]));
}

// ---- lm ---------------------------------------------------------------------

void lm_spread(const StageJob& job, const std::vector<Bytes>& expected,
               const std::vector<Bytes>& found, Spread& spread) {
    const auto a = as<defrec_motion>(expected[0]), b = as<defrec_motion>(found[0]);
    const auto nodes = as<float>(job.prepare[0].bytes);
    for (size_t i = 0; i < a.size(); ++i) {
        const auto m = DualQuaternion<double>::load(a[i]), n = DualQuaternion<double>::load(b[i]);
        const auto p = load3<double>(&nodes[3 * i]);
        const auto away = apply(m, p) - apply(n, p);
        const double cosine =
            std::abs(dot(m.real, n.real)) / std::sqrt(dot(m.real, m.real) * dot(n.real, n.real));
        spread["lm.position"].add(std::sqrt(dot(away, away)));
        spread["lm.rotation"].add(2 * std::acos(std::min(cosine, 1.0)));
        spread["lm.unit"].add(
            std::max(std::abs(dot(n.real, n.real) - 1), std::abs(dot(n.real, n.dual)) / 100));
    }
    const auto s = as<defrec_lm_summary>(expected[1])[0], t = as<defrec_lm_summary>(found[1])[0];
    same("summary", 0, "failed", s.failed, t.failed);
    same("summary", 0, "reserved", s.reserved, t.reserved);
    require((s.iterations == 0) == (t.iterations == 0), "summary.iterations is ", t.iterations,
            ", ", s.iterations, " expected");
    require(std::isfinite(t.damping), "summary.damping is not a finite number");
    const double initial = double(s.initial_cost) + 1e-6,
                 scale = double(s.final_cost) + 1e-3 * initial;
    spread["lm.initial_cost"].add(std::abs(double(s.initial_cost) - double(t.initial_cost)) /
                                  initial);
    spread["lm.final_cost"].add(std::abs(double(s.final_cost) - double(t.final_cost)) / scale);
    for (const auto& [one, other] : {std::pair{s.icp_cost, t.icp_cost},
                                     {s.match_cost, t.match_cost},
                                     {s.patch_cost, t.patch_cost},
                                     {s.arap_cost, t.arap_cost}})
        spread["lm.term_cost"].add(std::abs(double(one) - double(other)) / scale);
    for (const auto& [one, other] :
         {std::pair{s.icp_points, t.icp_points}, {s.matches, t.matches}, {s.patches, t.patches}})
        spread["lm.residuals"].add(one, other);
    spread["lm.rms"].add(double(s.icp_rms), double(t.icp_rms));
    spread["lm.rms"].add(double(s.match_rms), double(t.match_rms));
    spread["lm.rms_px"].add(double(s.patch_rms), double(t.patch_rms));
}

// ---- warp -------------------------------------------------------------------

namespace {

// Where a decision of the definition falls: on a border between pixels, of the image, of the
// tolerance, or of facing.
bool at_border(const defrec_warp_params& p, const defrec_surface_sample& sample) {
    constexpr double kPixels = 2e-4, kDepth = 5e-3, kFacing = 1e-4;
    const auto x = load3<double>(sample.position), n = load3<double>(sample.normal);
    if (std::abs(x.z) < 0.01) return true;
    const double u = p.camera.fx * x.x / x.z + p.camera.cx,
                 v = p.camera.fy * x.y / x.z + p.camera.cy;
    const auto near = [&](double at) {
        return std::abs(2 * at - std::round(2 * at)) < 2 * kPixels;
    };
    const bool facing = std::abs(dot(n, x)) < kFacing * std::sqrt(dot(x, x));
    return near(u) || near(v) || facing ||
           std::abs(std::abs(double(sample.residual)) - double(p.tolerance_mm)) < kDepth;
}

}  // namespace

void warp_spread(const StageJob& job, const std::vector<Bytes>& expected,
                 const std::vector<Bytes>& found, Spread& spread) {
    constexpr double kJump =
        0.01;  // mm: residuals of a point at a border that fell on its other side are farther apart
    const auto& p = params_of<defrec_warp_params>(job);
    const auto a = as<defrec_surface_sample>(expected[0]), b = as<defrec_surface_sample>(found[0]);
    size_t undecided = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        spread["warp.position"].add(distance(a[i].position, b[i].position));
        spread["warp.normal"].add(distance(a[i].normal, b[i].normal));
        const double apart = std::abs(double(a[i].residual) - double(b[i].residual));
        require(std::isfinite(b[i].residual) && b[i].observation <= DEFREC_INCONSISTENT, "samples[",
                i, "] has residual ", b[i].residual, " and observation ", b[i].observation,
                ", which is none");
        if ((a[i].observation != b[i].observation || apart > kJump) && at_border(p, a[i])) {
            ++undecided;
            continue;
        }
        same("samples", i, "observation", a[i].observation, b[i].observation);
        spread["warp.residual"].add(apart);
    }
    spread["warp.undecided"].add(a.empty() ? 0 : double(undecided) / double(a.size()));
}

}  // namespace defrec::conformance
