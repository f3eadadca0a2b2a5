#include "sdk/tracking/evidence/vertex_confidence.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <numbers>
#include <numeric>

#include "backends/shared/rigid_fit.hpp"
#include "sdk/base/util/array_part.hpp"
#include "sdk/template/cut.hpp"
#include "sdk/template/decisions.hpp"
#include "sdk/tracking/decisions/confidence.hpp"
#include "sdk/tracking/evidence/vertex_runs.hpp"

namespace defrec {
namespace {

using decisions::Confidence;
using Share = decisions::ExpectedError;

constexpr uint8_t kBoth = DEFREC_EVIDENCE_DEPTH | DEFREC_EVIDENCE_PHOTOMETRIC;

// Sets the covariance of an error that is the same in all directions. covariance: xx, xy, xz, yy,
// yz, zz.
template <class Real>
void set_isotropic(Real expected_error, Real* covariance) {
    std::fill_n(covariance, 6, Real{0});
    for (const int diagonal : {0, 3, 5})
        covariance[diagonal] = expected_error * expected_error / Real{3};
}

// age: frames since it was last known.
float error_unknown(uint32_t age) {
    return Confidence::kErrorUnknown +
           Confidence::kGrowthLost * static_cast<float>(std::min(age, Confidence::kLongestGrowth));
}

// Marks the vertices with one of another piece at most so many steps of the grid away.
void mark_beside_pieces(const TemplateData& data, std::vector<uint8_t>& is_marked) {
    constexpr int kReach = Confidence::kBesidePiece;
    const SurfaceGrid& grid = data.grid;
    if (grid.piece.empty()) return;
    const auto cell = [&](int x, int y) { return static_cast<size_t>(y * grid.columns + x); };
    const auto is_beside = [&](int x, int y) {
        const uint8_t piece = grid.piece[cell(x, y)];
        for (int other_y = std::max(0, y - kReach); other_y <= std::min(grid.rows - 1, y + kReach);
             ++other_y)
            for (int other_x = std::max(0, x - kReach);
                 other_x <= std::min(grid.columns - 1, x + kReach); ++other_x) {
                const size_t other = cell(other_x, other_y);
                if (grid.vertex[other] >= 0 && grid.piece[other] != piece) return true;
            }
        return false;
    };
    for (int y = 0; y < grid.rows; ++y)
        for (int x = 0; x < grid.columns; ++x)
            if (const int32_t vertex = grid.vertex[cell(x, y)]; vertex >= 0 && is_beside(x, y))
                is_marked[static_cast<size_t>(vertex)] = 1;
}

// Per vertex, mm in depth to the farthest vertex of another piece that lies beside it in the grid.
std::vector<float> depth_to_other_pieces(const TemplateData& data) {
    std::vector<float> depth(data.vertices.size(), 0);
    const SurfaceGrid& grid = data.grid;
    if (grid.piece.empty()) return depth;
    const auto cell = [&](int x, int y) { return static_cast<size_t>(y * grid.columns + x); };
    const auto compare = [&](size_t a, size_t b) {
        const int32_t one = grid.vertex[a], other = grid.vertex[b];
        if (one < 0 || other < 0 || grid.piece[a] == grid.piece[b]) return;
        const auto i = static_cast<size_t>(one), k = static_cast<size_t>(other);
        const float apart = std::abs(data.vertices[i].position[2] - data.vertices[k].position[2]);
        depth[i] = std::max(depth[i], apart);
        depth[k] = std::max(depth[k], apart);
    };
    for (int y = 0; y < grid.rows; ++y)
        for (int x = 0; x < grid.columns; ++x) {
            if (x + 1 < grid.columns) compare(cell(x, y), cell(x + 1, y));
            if (y + 1 == grid.rows) continue;
            compare(cell(x, y), cell(x, y + 1));
            if (x + 1 < grid.columns) compare(cell(x, y), cell(x + 1, y + 1));
            if (x > 0) compare(cell(x, y), cell(x - 1, y + 1));
        }
    return depth;
}

}  // namespace

SurfaceModel::SurfaceModel(const TemplateData& given)
    : data(&given), grids(given), checked(given), shear(given), cut_sides(given) {
    const auto count = static_cast<Eigen::Index>(given.vertices.size());
    is_at_edge = vertices_beside_cuts(given);
    mark_beside_pieces(given, is_at_edge);
    border_mm = depth_to_other_pieces(given);
    step_mm.resize(given.vertices.size());
    support_mm.resize(given.vertices.size());
    centred.setZero(4, count);
    centre.setZero();
    for (Eigen::Index i = 0; i < count; ++i) {
        const defrec_surface_point& vertex = given.vertices[static_cast<size_t>(i)];
        const double z = std::max<double>(1, vertex.position[2]);
        const auto index = static_cast<size_t>(i);
        step_mm[index] = static_cast<float>(given.grid.spacing * z / given.camera.fx);
        support_mm[index] = static_cast<float>(given.vertex_support[index] * z / given.camera.fx);
        centre += Eigen::Map<const Eigen::Vector3f>(vertex.position).cast<double>();
    }
    for (const SurfacePatch& part : given.parts)
        std::fill(step_mm.begin() + static_cast<std::ptrdiff_t>(part.before.vertices),
                  step_mm.end(), part.step_mm);
    centre /= static_cast<double>(std::max<Eigen::Index>(1, count));
    for (Eigen::Index i = 0; i < count; ++i) {
        const Eigen::Map<const Eigen::Vector3f> position(
            given.vertices[static_cast<size_t>(i)].position);
        centred.col(i).head<3>() = (position.cast<double>() - centre).cast<float>();
    }
}

namespace {

void make_room(VertexConfidence& confidence, size_t vertices) {
    confidence.status.resize(vertices);
    confidence.evidence.resize(vertices);
    confidence.covariance.resize(6 * vertices);
    confidence.expected_error.resize(vertices);
    confidence.common_mm2.resize(vertices);
}

// How far a vertex moved in the image, px.
struct ImageStep {
    float along, down;
};
ImageStep image_step(const defrec_camera& camera, const defrec_surface_sample& from,
                     const defrec_surface_sample& to) {
    const float *now = to.position, *last = from.position;
    return {static_cast<float>(camera.fx) * (now[0] / now[2] - last[0] / last[2]),
            static_cast<float>(camera.fy) * (now[1] / now[2] - last[1] / last[2])};
}

// Px^2 of disparity that a lag of a frame gets wrong at a vertex that moved so.
float px2_per_lag(const ImageStep& step) {
    return step.along * step.along + Share::kLateShare * step.down * step.down;
}

// Px^2 of disparity that the rig gets wrong at a vertex: by what moved during a lag, by a vergence
// that is wrong, and by rows of the views that do not agree, or of a view that do not belong
// together.
class RigDoubt {
  public:
    RigDoubt(const TemplateData& data, const FrameEvidence& evidence) : camera_(data.camera) {
        if (!evidence.last_samples.empty()) {
            squared_lag_ = evidence.rig.lag_frames * evidence.rig.lag_frames;
        }
        const double roll =
                         std::tan(evidence.rig.roll_deg * std::numbers::pi / 180) * data.width / 2,
                     ratio = (evidence.rig.focal_ratio - 1) * data.height / 2,
                     offset = evidence.rig.vertical_offset_px,
                     corner = double{evidence.rig.vergence} * data.width * data.height /
                              (4 * camera_.fx);
        rows_ = Share::kRowShare *
                static_cast<float>(offset * offset + roll * roll + ratio * ratio + corner * corner);
        if (evidence.is_interlaced) rows_ += Share::kInterlaced;
        const auto drift =
            static_cast<float>(evidence.baseline_drift_px * evidence.baseline_drift_px);
        rows_ += drift;
        const double angle = camera_.disparity_offset_px / camera_.fx;
        rows_ += Share::kConvergence * static_cast<float>(angle * angle);
        const double vergence = evidence.rig.vergence,
                     noise = Share::kVergenceNoise * double{evidence.rig.vergence_sigma};
        vergence_ = static_cast<float>(camera_.fx * camera_.fx *
                                       std::max(0.0, vergence * vergence - noise * noise));
        const auto left = static_cast<float>(camera_.fx * evidence.rig.corrected_sigma);
        corrected_ = left * left;
        common_ = drift + vergence_ + corrected_;
        one_view_ = Share::kOneView + vergence_ + corrected_ +
                    evidence.rig.last_depth_px * evidence.rig.last_depth_px;
    }
    struct Doubt {
        float px2 = 0;
        // Less what might be there and was not seen: what a correction left.
        float shown_px2 = 0;
        float common_px2 = 0;  // what all vertices share
    };
    Doubt at(const FrameEvidence& evidence, size_t vertex) const {
        if (!evidence.uses_depth) {
            const float px2 = one_view_ + (evidence.depth_speed == nullptr
                                               ? 0
                                               : evidence.depth_speed->unmeasured_px2(vertex));
            return {px2, px2, px2};
        }
        const float still = rows_ + vergence_;
        if (squared_lag_ == 0) return {still + corrected_, still, common_};
        const ImageStep step =
            image_step(camera_, evidence.last_samples[vertex], evidence.output.samples[vertex]);
        const float late =
            std::max(squared_lag_ * px2_per_lag(step), evidence.rig.lag_px * evidence.rig.lag_px);
        return {still + corrected_ + late, still + late, common_ + late};
    }

  private:
    const defrec_camera& camera_;
    float squared_lag_ = 0, rows_, vergence_, corrected_, common_, one_view_;
};

// Variances across the ray (both directions together) and along it (of the depth) as a covariance,
// at places x, y on a plane at distance 1.
template <class Values, class Covariances>
void set_covariance(const Values& x, const Values& y, const Values& across, const Values& along,
                    Covariances& covariance) {
    covariance.col(0) = across / 2 + along * x * x;
    covariance.col(1) = along * x * y;
    covariance.col(2) = along * x;
    covariance.col(3) = across / 2 + along * y * y;
    covariance.col(4) = along * y;
    covariance.col(5) = along;
}

}  // namespace

float squared_step(const defrec_camera& camera, const defrec_surface_sample& from,
                   const defrec_surface_sample& to) {
    const ImageStep step = image_step(camera, from, to);
    return step.along * step.along + step.down * step.down;
}

namespace {

// What the vertices of a frame share.
class ConfidenceEstimate {
  public:
    ConfidenceEstimate(const SurfaceModel& model, const FrameEvidence& evidence,
                       VertexConfidence& confidence)
        : model_(model),
          camera_(model.data->camera),
          evidence_(evidence),
          samples_(evidence.output.samples),
          photometric_(evidence.photometric),
          rig_(*model.data, evidence),
          max_doubt_(evidence.rig.lag_frames == 0 ? Confidence::kMaxRigDoubt
                                                  : Confidence::kMaxLateDoubt),
          max_contradicted_(
              std::max(decisions::ContradictedDepth::kMaxObserved,
                       decisions::ContradictedDepth::kObservedShare * evidence.mean_residual_mm)),
          noise_(Share::kNoiseShare * evidence.mean_residual_mm * evidence.mean_residual_mm),
          shared_noise_px2_(
              std::max(0.0f, evidence.rig.shared_noise_px2 - Share::kUsualSharedNoise)),
          confidence_(confidence) {}

    void look_for_shear(size_t i) const { confidence_.sheared[i] = model_.shear.at(i, samples_); }
    void spread_shear() const {
        model_.shear.spread(*model_.data, confidence_.sheared, confidence_.beside_sheared);
    }

    // What is seen of a vertex itself.
    void look_at(size_t i) const {
        const float per_px = depth_per_px(camera_, samples_[i].position[2]);
        RigDoubt::Doubt doubt = rig_.at(evidence_, i);
        add_given_doubt(i, doubt);
        confidence_.rig_px2[i] = doubt.px2;
        confidence_.common_mm2[i] = doubt.common_px2 * per_px * per_px;
        const unsigned stale =
            evidence_.stale_views.empty() ? 0u : unsigned{evidence_.stale_views[i]};
        const bool is_stale = (stale & (evidence_.uses_depth ? kBothViews : kLeftView)) != 0,
                   is_covered = evidence_.colours != nullptr && photometric_.is_confirmed[i] == 0 &&
                                (stale & kLeftView) == 0 &&
                                evidence_.colours->is_covered(i, samples_[i]);
        // Depth is of what covers it.
        if (!confidence_.covered.empty()) confidence_.covered[i] = is_covered ? 1 : 0;
        const bool agrees = !is_stale && !is_covered &&
                            (samples_[i].observation == DEFREC_OBSERVED ||
                             (!evidence_.uses_depth && samples_[i].observation != DEFREC_OUTSIDE)),
                   is_confirmed = photometric_.is_confirmed[i] != 0 && (stale & kLeftView) == 0 &&
                                  says_where(i),
                   has_depth = evidence_.uses_depth && !evidence_.is_interlaced && agrees &&
                               doubt.shown_px2 * per_px * per_px <= max_doubt_ * max_doubt_;
        confidence_.evidence[i] =
            static_cast<uint8_t>((has_depth ? DEFREC_EVIDENCE_DEPTH : 0) |
                                 (is_confirmed ? DEFREC_EVIDENCE_PHOTOMETRIC : 0));
        confidence_.between_mm[i] = is_confirmed || confidence_.sheared[i] == Shear::kNone
                                        ? 0
                                        : model_.shear.error_between(*model_.data, i, samples_);
        if (is_confirmed) set_known(confidence_.to_photometric[model_.grids.cell(i)]);
        if (is_confirmed && agrees) set_known(confidence_.to_observed[model_.grids.cell(i)]);
    }

    // Then, with the distances from those that are seen, a few vertices at a time, so that the
    // compiler makes vectors of them.
    void conclude(size_t begin, size_t end) const {
        for (size_t first = begin; first < end; first += kFew)
            conclude_few(first, std::min(kFew, end - first));
    }

  private:
    // Whether the check that confirms a vertex tells where it is. Between sides that slide none
    // does: the surface moves with neither. Beside them the surface is drawn along, and what shows
    // little texture looks alike elsewhere.
    bool says_where(size_t i) const {
        if (confidence_.beside_sheared[i] == Shear::kNone) return true;
        if (confidence_.sheared[i] == Shear::kCertain) return false;
        const auto check = static_cast<size_t>(model_.data->check_of_vertex[i]);
        const float information = least_information(evidence_.output.checks[check]);
        return confidence_.beside_sheared[i] == Shear::kCertain
                   ? information >= Confidence::kMinInformation
                   : information > 0;
    }
    // Disparity of the application leaves this open in place of that of stage stereo.
    void add_given_doubt(size_t i, RigDoubt::Doubt& doubt) const {
        const KeptDisparity& given = evidence_.given_disparity;
        if (!given.given() || !evidence_.uses_depth) return;
        const float sigma = sigma_at(i), error = evidence_.given_error_px;
        doubt.px2 += sigma * sigma - Share::kDisparityShare + error * error;
        doubt.shown_px2 += error * error;
        doubt.common_px2 += error * error;
    }
    // px; of a vertex where there is no disparity that of the whole image.
    float sigma_at(size_t i) const {
        const KeptDisparity& given = evidence_.given_disparity;
        if (given.sigma == nullptr || samples_[i].observation == DEFREC_OUTSIDE)
            return given.sigma_px;
        const float* p = samples_[i].position;
        const int64_t x = std::llround(camera_.cx + camera_.fx * p[0] / p[2]),
                      y = std::llround(camera_.cy + camera_.fy * p[1] / p[2]),
                      width = model_.data->width, height = model_.data->height;
        if (x < 0 || y < 0 || x >= width || y >= height) return given.sigma_px;
        const float sigma = given.sigma[y * width + x];
        return sigma > 0 ? sigma : given.sigma_px;
    }

    static constexpr size_t kFew = 64;
    using Few = Eigen::Array<float, Eigen::Dynamic, 1, 0, kFew, 1>;
    using Values = Eigen::Map<const Eigen::ArrayXf>;

    void conclude_few(size_t first, size_t given) const {
        const auto count = static_cast<Eigen::Index>(given);
        const auto values = [first, count](const std::vector<float>& of_all) {
            return Values(&of_all[first], count);
        };
        Few x(count), y(count), z(count), residual(count), to_photometric(count),
            to_observed(count), mismatch(count), astray(count);
        for (Eigen::Index k = 0; k < count; ++k) {
            const size_t i = first + static_cast<size_t>(k);
            const defrec_surface_sample& sample = samples_[i];
            x[k] = sample.position[0];
            y[k] = sample.position[1];
            z[k] = sample.position[2];
            residual[k] = sample.observation == DEFREC_OBSERVED ? sample.residual : 0;
            astray[k] = disagreement(i);
            to_photometric[k] = confidence_.to_photometric[model_.grids.cell(i)];
            to_observed[k] = confidence_.to_observed[model_.grids.cell(i)];
            mismatch[k] = photometric_.is_confirmed[i] != 0 ? 1 - photometric_.check_score[i] : 0;
        }
        const Values patches = values(photometric_.patch_px2),
                     check = values(photometric_.check_px2), step = values(model_.step_mm),
                     support = values(model_.support_mm), refuted = values(photometric_.refuted),
                     border = values(model_.border_mm);
        to_observed *= step;
        for (Eigen::Index k = 0; k < count; ++k)
            set_status(first + static_cast<size_t>(k), to_observed[k]);

        const Few mm_per_px = z / static_cast<float>(camera_.fx), per_px = depth_per_px(camera_, z);
        const Few far_photometric = (to_photometric * step).min(Confidence::kFarthestGrowth),
                  far_observed = to_observed.min(Confidence::kFarthestGrowth);
        Few across =
            mm_per_px * mm_per_px *
                (Share::kPatchShare * patches + Share::kCheckShare * check +
                 Share::kMismatchShare * mismatch + Share::kSharedNoiseAcross * shared_noise_px2_) +
            Share::kFarPhotometric * far_photometric * far_photometric +
            Share::kRefutedShare * refuted * refuted + values(confidence_.cut_side_mm).square();
        const Few along =
            per_px * per_px *
                (Share::kDisparityShare + Share::kSharedNoiseAlong * shared_noise_px2_ +
                 Share::kDisparityPatchShare * patches + values(confidence_.rig_px2)) +
            Share::kFarObserved * far_observed * far_observed +
            Share::kSupportShare * support * support + Share::kBorderShare * border * border +
            Share::kResidualShare * residual * residual + astray * astray + noise_;
        Few between = values(confidence_.between_mm);
        if (first + given <= evidence_.slip_doubts.size())
            between = between.max(Values(&evidence_.slip_doubts[first], count));
        across += between.square();
        x /= z;
        y /= z;
        Eigen::Array<float, Eigen::Dynamic, 6, 0, kFew, 6> covariance(count, 6);
        set_covariance(x, y, across, along, covariance);
        const Few trace = covariance.col(0) + covariance.col(3) + covariance.col(5);
        Eigen::Map<Eigen::ArrayXf>(&confidence_.common_mm2[first], count) *= x * x + y * y + 1;
        for (Eigen::Index k = 0; k < count; ++k)  // Eigen's own root of a vector is not exact
            confidence_.expected_error[first + static_cast<size_t>(k)] = std::sqrt(trace[k]);
        Eigen::Map<Eigen::Array<float, 6, Eigen::Dynamic>>(&confidence_.covariance[6 * first], 6,
                                                           count) = covariance.transpose();
    }

    // How far depth is off by the frames before, mm.
    float contradicted(size_t i) const {
        return evidence_.contradicted_mm.empty() ? 0 : evidence_.contradicted_mm[i];
    }
    // How far live depth is off where the tissue is, by this frame or those before, mm.
    float disagreement(size_t i) const {
        const defrec_surface_sample& sample = samples_[i];
        const bool is_behind = sample.observation == DEFREC_INCONSISTENT,
                   is_in_front =
                       sample.observation == DEFREC_OCCLUDED && photometric_.is_confirmed[i] != 0;
        return std::max(is_behind || is_in_front ? std::abs(sample.residual) : 0, contradicted(i));
    }
    void set_status(size_t i, float to_observed) const {
        // At an edge it lies in a gap, or was counted to the wrong side.
        const bool is_astray = model_.is_at_edge[i] != 0 &&
                               (confidence_.evidence[i] & DEFREC_EVIDENCE_PHOTOMETRIC) == 0;
        const bool is_observed = confidence_.evidence[i] == kBoth &&
                                 model_.border_mm[i] < Confidence::kMaxBorder &&
                                 confidence_.cut_side_mm[i] < Confidence::kMaxCutSide &&
                                 contradicted(i) < max_contradicted_;
        confidence_.status[i] = is_observed ? DEFREC_POINT_OBSERVED
                                : to_observed <= Confidence::kFarthest && !is_astray
                                    ? DEFREC_POINT_EXTRAPOLATED
                                    : DEFREC_POINT_UNKNOWN;
    }

    // Vertices of a file that are on no grid share a cell, and runs of vertices are computed at the
    // same time.
    static void set_known(float& distance) {
        std::atomic_ref(distance).store(0, std::memory_order_relaxed);
    }

    const SurfaceModel& model_;
    const defrec_camera& camera_;
    const FrameEvidence& evidence_;
    const SurfaceSamples samples_;
    const PhotometricEvidence& photometric_;
    const RigDoubt rig_;
    const float max_doubt_, max_contradicted_, noise_, shared_noise_px2_;
    VertexConfidence& confidence_;
};

}  // namespace

void begin_confidence(const SurfaceModel& model, VertexConfidence& confidence) {
    const size_t count = model.data->vertices.size();
    make_room(confidence, count);
    confidence.rig_px2.resize(count);
    confidence.cut_side_mm.resize(count);
    confidence.sheared.resize(count);
    confidence.beside_sheared.resize(count);
    confidence.between_mm.resize(count);
    confidence.seen_error.reserve(count);
    for (std::vector<float>* distance : {&confidence.to_photometric, &confidence.to_observed})
        distance->assign(model.grids.cells(), 1e6f);
    for (MapGrids::Workspace& spreading : confidence.spreading) model.grids.make_room(spreading);
}

void estimate_confidence(const SurfaceModel& model, const FrameEvidence& evidence,
                         const Services* helpers, const std::function<void()>& beside,
                         VertexConfidence& confidence) {
    const size_t count = evidence.output.samples.size();
    confidence.seen_error.clear();
    confidence.covered.resize(evidence.colours != nullptr ? count : 0);
    model.cut_sides.expect(*model.data, evidence.output.samples, evidence.unconfirmed,
                           confidence.cut_side_mm);
    std::vector<float>* const distances[2] = {&confidence.to_photometric, &confidence.to_observed};
    const ConfidenceEstimate estimate(model, evidence, confidence);
    enum : size_t { kShears, kSpreadsShear, kLooks, kSpreads, kConcludes };
    const size_t parts = vertex_parts(helpers, count);
    for_phases<5>(helpers, {parts, 1, parts, 3, parts}, [&](size_t phase, size_t index) {
        if (phase == kSpreads) {
            if (index == 2) return beside();
            return model.grids.spread(*distances[index], confidence.spreading[index]);
        }
        if (phase == kSpreadsShear) return estimate.spread_shear();
        const ArrayPart part{index, parts};
        const size_t begin = part.begin(count), end = part.end(count);
        if (phase == kConcludes) return estimate.conclude(begin, end);
        for (size_t i = begin; i < end; ++i)
            if (phase == kShears)
                estimate.look_for_shear(i);
            else
                estimate.look_at(i);
    });
}

void add_unseen_lag(const defrec_camera& camera, float lag_frames, SurfaceSamples before,
                    SurfaceSamples now, VertexConfidence& confidence) {
    if (lag_frames == 0 || before.empty()) return;
    confidence.seen_error = confidence.expected_error;
    for (size_t i = 0; i < now.size(); ++i) {
        if (confidence.status[i] == DEFREC_POINT_UNKNOWN) continue;
        const float* at = now[i].position;
        const float x = at[0] / at[2], y = at[1] / at[2],
                    depth = lag_frames * depth_per_px(camera, at[2]),
                    along = depth * depth * px2_per_lag(image_step(camera, before[i], now[i]));
        float* covariance = &confidence.covariance[6 * i];
        const float added[6] = {x * x, x * y, x, y * y, y, 1};
        for (size_t k = 0; k < 6; ++k) covariance[k] += along * added[k];
        confidence.expected_error[i] = std::sqrt(covariance[0] + covariance[3] + covariance[5]);
    }
}

void forget_confidence(uint32_t age, VertexConfidence& confidence, size_t vertices) {
    make_room(confidence, vertices);
    confidence.seen_error.clear();
    const float error = error_unknown(age);
    std::fill(confidence.status.begin(), confidence.status.end(), uint8_t{DEFREC_POINT_UNKNOWN});
    std::fill(confidence.evidence.begin(), confidence.evidence.end(), uint8_t{0});
    std::fill(confidence.expected_error.begin(), confidence.expected_error.end(), error);
    std::fill(confidence.common_mm2.begin(), confidence.common_mm2.end(), 0.0f);
    for (size_t i = 0; i < vertices; ++i) set_isotropic(error, &confidence.covariance[6 * i]);
}

void forget_vertex(uint32_t age, size_t vertex, VertexConfidence& confidence) {
    confidence.status[vertex] = DEFREC_POINT_UNKNOWN;
    confidence.evidence[vertex] = 0;
    confidence.expected_error[vertex] = error_unknown(age);
    if (!confidence.common_mm2.empty()) confidence.common_mm2[vertex] = 0;
    set_isotropic(confidence.expected_error[vertex], &confidence.covariance[6 * vertex]);
}

void forget_lost_pieces(std::span<const defrec_piece> pieces,
                        std::span<const uint8_t> vertex_pieces, VertexConfidence& confidence) {
    const auto is_lost = [](const defrec_piece& piece) { return piece.state == DEFREC_LOST; };
    if (std::none_of(pieces.begin(), pieces.end(), is_lost)) return;
    for (size_t i = 0; i < vertex_pieces.size(); ++i) {
        const defrec_piece& piece = pieces[vertex_pieces[i]];
        if (is_lost(piece)) forget_vertex(piece.age, i, confidence);
    }
}

uint32_t share_observed(std::span<const uint8_t> vertex_pieces, const VertexConfidence& confidence,
                        std::span<defrec_piece> pieces) {
    std::array<uint32_t, decisions::TemplatePieces::kMaxPieces> observed{};
    if (pieces.size() == 1)
        observed[0] = static_cast<uint32_t>(
            std::count(confidence.status.begin(), confidence.status.end(), DEFREC_POINT_OBSERVED));
    else
        for (size_t i = 0; i < vertex_pieces.size(); ++i)
            observed[vertex_pieces[i]] += confidence.status[i] == DEFREC_POINT_OBSERVED;
    for (size_t i = 0; i < pieces.size(); ++i)
        pieces[i].observed_share = static_cast<float>(observed[i]) /
                                   static_cast<float>(std::max(1u, pieces[i].vertices_inside));
    return std::accumulate(observed.begin(), observed.end(), 0u);
}

namespace {

SurfaceConfidence nothing_known() {
    SurfaceConfidence at;
    at.expected_error = Confidence::kFarthestOffSurface;
    set_isotropic(at.expected_error, at.covariance);
    return at;
}

}  // namespace

NearVertex near_vertex(const Template& surface, int32_t nearest, const double xyz[3]) {
    if (nearest < 0) return {};
    const TemplateData& data = surface.data();
    const size_t vertex = static_cast<size_t>(nearest);
    double squared = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double difference = xyz[axis] - data.vertices[vertex].position[axis];
        squared += difference * difference;
    }
    const double distance = std::sqrt(squared);
    if (!(distance <= Confidence::kFarthestOffSurface)) return {};
    const double step_mm = data.grid.spacing * data.vertices[vertex].position[2] / data.camera.fx;
    return {nearest, distance > Confidence::kFarthest,
            Confidence::kGrowthOffSurface * std::max(0.0, distance - 2 * step_mm)};
}

SurfaceConfidence confidence_at(const Template& surface, const VertexConfidence& confidence,
                                const double xyz[3]) {
    return confidence_at(confidence, near_vertex(surface, surface.vertex_at(xyz), xyz));
}

SurfaceConfidence confidence_at(const VertexConfidence& confidence, const NearVertex& near) {
    if (near.vertex < 0) return nothing_known();
    SurfaceConfidence at;
    const size_t vertex = static_cast<size_t>(near.vertex);
    at.status = confidence.status[vertex];
    if (near.is_off && at.status == DEFREC_POINT_OBSERVED) at.status = DEFREC_POINT_EXTRAPOLATED;
    at.evidence = confidence.evidence[vertex];
    at.expected_error = confidence.expected_error[vertex] + near.growth_mm;
    const double growth = at.expected_error / confidence.expected_error[vertex];
    for (size_t i = 0; i < 6; ++i)
        at.covariance[i] = growth * growth * confidence.covariance[6 * vertex + i];
    return at;
}

SurfaceConfidence confidence_beside(const VertexConfidence& confidence, size_t vertex,
                                    double distance_mm, const Vec3<double>& place) {
    if (place.z < Confidence::kNearestToCamera) return nothing_known();
    SurfaceConfidence at;
    const auto away =
        static_cast<float>(std::min<double>(distance_mm, Confidence::kFarthestGrowth));
    using One = Eigen::Array<float, 1, 1>;
    const One x(static_cast<float>(place.x)), y(static_cast<float>(place.y)),
        z(static_cast<float>(place.z)), across(Share::kFarPhotometric * away * away),
        along(Share::kFarObserved * away * away);
    Eigen::Array<float, 1, 6> further;
    set_covariance(One(x / z), One(y / z), across, along, further);
    for (size_t i = 0; i < 6; ++i)
        at.covariance[i] =
            confidence.covariance[6 * vertex + i] + further[static_cast<Eigen::Index>(i)];
    at.expected_error = std::sqrt(at.covariance[0] + at.covariance[3] + at.covariance[5]);
    if (distance_mm <= Confidence::kFarthest && confidence.status[vertex] != DEFREC_POINT_UNKNOWN)
        at.status = DEFREC_POINT_EXTRAPOLATED;
    return at;
}

namespace {

// place(i): of the vertex first + i, and any fourth number, which goes along for the sake of whole
// vectors.
template <class Place>
RigidSums sum_places(const SurfaceModel& model, size_t first, size_t count, const Place& place) {
    // Sums over a few vertices are in single precision, their sum is in double. Targets need no
    // centring where sources are centred.
    constexpr size_t kFew = 32;
    RigidSums sums;
    for (size_t begin = 0; begin < count; begin += kFew) {
        Eigen::Vector4f along[3] = {Eigen::Vector4f::Zero(), Eigen::Vector4f::Zero(),
                                    Eigen::Vector4f::Zero()};
        Eigen::Vector4f few = Eigen::Vector4f::Zero();
        for (size_t i = begin; i < std::min(begin + kFew, count); ++i) {
            const Eigen::Vector4f target = place(i);
            const float* source = model.centred.data() + 4 * (first + i);
            few += target;
            for (int axis = 0; axis < 3; ++axis) along[axis] += source[axis] * target;
        }
        sums.positions += few.cast<double>();
        for (int axis = 0; axis < 3; ++axis) sums.products.col(axis) += along[axis].cast<double>();
    }
    return sums;
}

}  // namespace

RigidSums sum_for_rigid_motion(const SurfaceModel& model, SurfaceSamples samples, size_t first) {
    return sum_places(model, first, samples.size(), [&](size_t i) -> Eigen::Vector4f {
        return Eigen::Map<const Eigen::Vector4f>(samples[i].position);  // and a part of the normal
    });
}

RigidSums sum_for_rigid_motion(const SurfaceModel& model, std::span<const float> vertices,
                               size_t first) {
    return sum_places(model, first, vertices.size() / 3, [&](size_t i) {
        const float* place = &vertices[3 * i];
        return Eigen::Vector4f(place[0], place[1], place[2], 0);
    });
}

void fit_rigid_motion(const SurfaceModel& model, std::span<const RigidSums> runs,
                      double motion[12]) {
    RigidSums sums;
    for (const RigidSums& run : runs) {
        sums.products += run.products;
        sums.positions += run.positions;
    }
    const auto count = static_cast<double>(std::max<Eigen::Index>(1, model.centred.cols()));
    const Eigen::Vector3d to = sums.positions.head<3>() / count;
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sums.products.topRows<3>(),
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Eigen::Matrix3d rotation = rotation_from_svd(svd);
    const Eigen::Vector3d translation = to - rotation * model.centre;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) motion[4 * row + column] = rotation(row, column);
        motion[4 * row + 3] = translation[row];
    }
}

size_t count_moved_farther(SurfaceSamples from, SurfaceSamples to, float distance_mm) {
    size_t farther = 0;
    for (size_t i = 0; i < to.size(); ++i) {
        float squared = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const float step = to[i].position[axis] - from[i].position[axis];
            squared += step * step;
        }
        farther += squared > distance_mm * distance_mm;
    }
    return farther;
}

void split_samples(SurfaceSamples samples, std::span<float> positions, std::span<float> normals) {
    for (size_t i = 0; i < samples.size(); ++i) {
        std::memcpy(&positions[3 * i], samples[i].position, sizeof samples[i].position);
        std::memcpy(&normals[3 * i], samples[i].normal, sizeof samples[i].normal);
    }
}

}  // namespace defrec
