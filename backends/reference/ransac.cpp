// 1-point RANSAC with reweighting (Zhou and Jagadeesan 2019, section 2.1): which matches move
// together. Definition: docs/stages/ransac.md.
#include <Eigen/Dense>
#include <vector>

#include "backends/definition/ransac_definition.hpp"
#include "backends/reference/stages.hpp"
#include "backends/shared/rigid_fit.hpp"

namespace defrec::reference {
namespace {
using namespace ransac;
using Eigen::Matrix3d;
using Eigen::Vector3d;

struct Pair {
    uint32_t match;
    Vector3d from, to;  // template and live, mm
};

struct Hypothesis {
    uint32_t support = 0;
    Matrix3d rotation = Matrix3d::Identity();
    std::vector<double> distance;  // per pair, mm
};

// The rotation that maximises trace(R^T m), never a reflection (Kabsch 1978, Umeyama 1991).
Matrix3d nearest_rotation(const Matrix3d& m) {
    return rotation_from_svd(
        Eigen::JacobiSVD<Matrix3d>(m, Eigen::ComputeFullU | Eigen::ComputeFullV));
}

class Ransac final : public Stage {
  public:
    explicit Ransac(const defrec_ransac_params& params) : params_(bounded(params)) {
        check_params(params);
    }

    void prepare(std::span<const InBuffer> in) override {
        const std::span<const defrec_landmark> landmarks = read_template(params_, in);
        landmarks_.assign(landmarks.begin(), landmarks.end());
        prepared_ = true;
    }

    void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        if (!prepared_) throw StageError(DEFREC_ERROR_STATE, "ransac: run before prepare");
        const auto b = view_buffers<RansacBuffers>(landmarks_.size(), in, out);

        pairs_.clear();
        for (uint32_t i = 0; i < landmarks_.size(); ++i) {
            if (usable(landmarks_[i], b.matches[i]))
                pairs_.push_back(
                    {i, Eigen::Map<const Eigen::Vector3f>(landmarks_[i].position).cast<double>(),
                     Eigen::Map<const Eigen::Vector3f>(b.matches[i].position).cast<double>()});
            b.weighted[i] = b.matches[i];
            b.weighted[i].weight = 0;
        }
        threshold_ = params_.threshold_mm > 0 ? double(params_.threshold_mm) : default_threshold();

        const uint32_t count = uint32_t(pairs_.size()),
                       references = std::min(params_.references, count);
        std::vector<Hypothesis> hypotheses;
        for (uint32_t k = 0; k < references; ++k)
            hypotheses.push_back(follow(reference_index(params_.seed, k, references, count)));
        *b.summary = merge(hypotheses, b.weighted);
    }

  private:
    // A tenth of the root mean square distance of the live points from their centre, mm.
    double default_threshold() const {
        Vector3d centre = Vector3d::Zero();
        for (const Pair& pair : pairs_) centre += pair.to / double(pairs_.size());
        double squares = 0;
        for (const Pair& pair : pairs_)
            squares += (pair.to - centre).squaredNorm() / double(pairs_.size());
        return std::max(kMinThreshold, kThresholdShare * std::sqrt(squares));
    }

    // Alternates the rotation about the reference and the weights.
    Hypothesis follow(uint32_t reference) const {
        Hypothesis out;
        const Pair& origin = pairs_[reference];
        std::vector<double> weight(pairs_.size(), 1.0);
        out.distance.resize(pairs_.size());
        for (uint32_t i = 0; i < params_.iterations; ++i) {
            Matrix3d m = Matrix3d::Zero();
            for (size_t k = 0; k < pairs_.size(); ++k)
                m += weight[k] * weight[k] * (pairs_[k].to - origin.to) *
                     (pairs_[k].from - origin.from).transpose();
            out.rotation = nearest_rotation(m);
            for (size_t k = 0; k < pairs_.size(); ++k) {
                out.distance[k] =
                    (pairs_[k].to - origin.to - out.rotation * (pairs_[k].from - origin.from))
                        .norm();
                weight[k] = std::min(threshold_ / out.distance[k], 1.0);
            }
        }
        for (const double distance : out.distance) out.support += distance < threshold_;
        return out;
    }

    defrec_ransac_summary merge(const std::vector<Hypothesis>& hypotheses,
                                defrec_match* weighted) const {
        defrec_ransac_summary out{};
        out.rotation[0] = out.rotation[4] = out.rotation[8] = 1;
        out.valid_matches = int32_t(pairs_.size());
        const Hypothesis* best = nullptr;
        for (const Hypothesis& hypothesis : hypotheses)
            if (best == nullptr || hypothesis.support > best->support) best = &hypothesis;
        if (best == nullptr) return out;
        const uint32_t needed = needed_support(params_, uint32_t(pairs_.size()), best->support);
        for (const Hypothesis& hypothesis : hypotheses) {
            if (hypothesis.support < needed) continue;
            out.references += 1;
            for (size_t k = 0; k < pairs_.size(); ++k) {
                const float weight = float(std::min(threshold_ / hypothesis.distance[k], 1.0));
                float& merged = weighted[pairs_[k].match].weight;
                if (weight >= kKeptWeight) merged = std::max(merged, weight);
            }
        }
        for (const Pair& pair : pairs_) out.inliers += weighted[pair.match].weight > 0.5f;
        if (best->support >= needed) refine(*best, out);
        return out;
    }

    // Fits the best reference's motion to its inliers, now without the reference as centre.
    void refine(const Hypothesis& best, defrec_ransac_summary& out) const {
        Matrix3d rotation = best.rotation;
        Vector3d translation = Vector3d::Zero();
        std::vector<double> distance = best.distance;
        for (uint32_t i = 0; i < kRefinements; ++i) {
            Vector3d from = Vector3d::Zero(), to = Vector3d::Zero();
            double count = 0;
            for (size_t k = 0; k < pairs_.size(); ++k) {
                if (!(distance[k] < threshold_)) continue;
                from += pairs_[k].from;
                to += pairs_[k].to;
                count += 1;
            }
            if (count == 0) break;
            from /= count;
            to /= count;
            Matrix3d m = Matrix3d::Zero();
            for (size_t k = 0; k < pairs_.size(); ++k)
                if (distance[k] < threshold_)
                    m += (pairs_[k].to - to) * (pairs_[k].from - from).transpose();
            rotation = nearest_rotation(m);
            translation = to - rotation * from;
            for (size_t k = 0; k < pairs_.size(); ++k)
                distance[k] = (pairs_[k].to - rotation * pairs_[k].from - translation).norm();
        }
        for (const double d : distance) out.best_support += d < threshold_;
        Eigen::Map<Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>(out.rotation) =
            rotation.cast<float>();
        Eigen::Map<Eigen::Vector3f>(out.translation) = translation.cast<float>();
    }

    defrec_ransac_params params_;
    std::vector<defrec_landmark> landmarks_;
    std::vector<Pair> pairs_;
    double threshold_ = 0;
    bool prepared_ = false;
};

}  // namespace

std::unique_ptr<Stage> make_ransac(const defrec_ransac_params& params, const Host&) {
    return std::make_unique<Ransac>(params);
}

}  // namespace defrec::reference
