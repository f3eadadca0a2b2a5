// 1-point RANSAC with reweighting, fast: a hypothesis is a task of the host's threads. Definition:
// docs/stages/ransac.md.
#include <limits>

#include "backends/cpu/ransac_kernels.hpp"
#include "backends/cpu/stages.hpp"
#include "backends/definition/ransac_definition.hpp"

namespace defrec::cpu {
namespace {
using namespace ransac;

class Ransac final : public Stage {
  public:
    Ransac(const defrec_ransac_params& params, const Host& host)
        : params_(bounded(params)), host_(host) {
        check_params(params);
        stride_ = (params.landmarks + kRansacPadding - 1) / kRansacPadding * kRansacPadding;
        arrays_.resize(8 * stride_);
        matches_.resize(params.landmarks);
        hypotheses_.resize(params.references);
        squares_.resize(params.references * stride_);
        landmarks_.reserve(params.landmarks);
    }

    void prepare(std::span<const InBuffer> in) override {
        const std::span<const defrec_landmark> landmarks = read_template(params_, in);
        landmarks_.assign(landmarks.begin(), landmarks.end());
        prepared_ = true;
    }

    void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        if (!prepared_) throw StageError(DEFREC_ERROR_STATE, "ransac: run before prepare");
        const auto b = view_buffers<RansacBuffers>(landmarks_.size(), in, out);

        gather(b.matches, b.weighted);
        threshold_ = params_.threshold_mm > 0 ? params_.threshold_mm : default_threshold();
        const uint32_t references = std::min(params_.references, count_);
        const RansacPairs pairs = {
            {axis(0), axis(1), axis(2)}, {axis(3), axis(4), axis(5)}, axis(6), padded_};
        host_.parallel_for(references, [&](size_t k) {
            ransac_follow(pairs, reference_index(params_.seed, uint32_t(k), references, count_),
                          params_.iterations, threshold_, hypotheses_[k],
                          squares_.data() + k * stride_);
        });
        *b.summary = merge(references, b.weighted);
    }

  private:
    float* axis(size_t k) { return arrays_.data() + k * stride_; }
    const float* axis(size_t k) const { return arrays_.data() + k * stride_; }

    void gather(const defrec_match* matches, defrec_match* weighted) {
        count_ = 0;
        for (uint32_t i = 0; i < landmarks_.size(); ++i) {
            const defrec_match match = matches[i];
            if (usable(landmarks_[i], match)) {
                for (size_t k = 0; k < 3; ++k) {
                    axis(k)[count_] = landmarks_[i].position[k];
                    axis(3 + k)[count_] = match.position[k];
                }
                axis(6)[count_] = 1;
                matches_[count_++] = i;
            }
            weighted[i] = match;
            weighted[i].weight = 0;
        }
        padded_ = (count_ + kRansacPadding - 1) / kRansacPadding * kRansacPadding;
        for (size_t k = 0; k < 7; ++k) std::fill(axis(k) + count_, axis(k) + padded_, 0.0f);
    }

    float default_threshold() const {
        if (count_ == 0) return float(kMinThreshold);
        double sum = 0, squares = 0, variance = 0;
        for (size_t k = 3; k < 6; ++k) {
            sum = squares = 0;
            for (uint32_t i = 0; i < count_; ++i) sum += double(axis(k)[i]);
            const double mean = sum / count_;
            for (uint32_t i = 0; i < count_; ++i)
                squares += (double(axis(k)[i]) - mean) * (double(axis(k)[i]) - mean);
            variance += squares / count_;
        }
        return float(std::max(kMinThreshold, kThresholdShare * std::sqrt(variance)));
    }

    defrec_ransac_summary merge(uint32_t references, defrec_match* weighted) {
        defrec_ransac_summary out{};
        out.rotation[0] = out.rotation[4] = out.rotation[8] = 1;
        out.valid_matches = int32_t(count_);
        if (references == 0) return out;
        uint32_t best = 0;
        for (uint32_t k = 1; k < references; ++k)
            if (hypotheses_[k].support > hypotheses_[best].support) best = k;
        const uint32_t needed = needed_support(params_, count_, hypotheses_[best].support);

        // The largest weight belongs to the least distance.
        float* minimum = axis(7);
        std::fill(minimum, minimum + count_, std::numeric_limits<float>::max());
        for (uint32_t k = 0; k < references; ++k) {
            if (hypotheses_[k].support < needed) continue;
            out.references += 1;
            const float* squares = squares_.data() + k * stride_;
            for (uint32_t i = 0; i < count_; ++i) minimum[i] = std::min(minimum[i], squares[i]);
        }
        for (uint32_t i = 0; i < count_; ++i) {
            const float weight = std::min(threshold_ / std::sqrt(minimum[i]), 1.0f);
            if (!(weight >= kKeptWeight)) continue;
            weighted[matches_[i]].weight = weight;
            out.inliers += 1;
        }
        if (hypotheses_[best].support >= needed) refine(best, out);
        return out;
    }

    // Fits the best reference's motion to its inliers, now without the reference as centre.
    void refine(uint32_t best, defrec_ransac_summary& out) {
        float* squares = squares_.data() + best * stride_;
        const float limit = threshold_ * threshold_;
        for (uint32_t step = 0; step < kRefinements; ++step) {
            double sum[6] = {}, m[9] = {}, count = 0;
            for (uint32_t i = 0; i < count_; ++i) {
                if (!(squares[i] < limit)) continue;
                for (size_t k = 0; k < 6; ++k) sum[k] += double(axis(k)[i]);
                count += 1;
            }
            if (count == 0) break;
            for (double& s : sum) s /= count;
            for (uint32_t i = 0; i < count_; ++i) {
                if (!(squares[i] < limit)) continue;
                for (size_t r = 0; r < 3; ++r)
                    for (size_t c = 0; c < 3; ++c)
                        m[3 * r + c] +=
                            (double(axis(3 + r)[i]) - sum[3 + r]) * (double(axis(c)[i]) - sum[c]);
            }
            nearest_rotation(m, out.rotation);
            for (size_t r = 0; r < 3; ++r) {
                double t = sum[3 + r];
                for (size_t c = 0; c < 3; ++c) t -= double(out.rotation[3 * r + c]) * sum[c];
                out.translation[r] = float(t);
            }
            for (uint32_t i = 0; i < count_; ++i) {
                float square = 0;
                for (size_t r = 0; r < 3; ++r) {
                    float rest = axis(3 + r)[i] - out.translation[r];
                    for (size_t c = 0; c < 3; ++c) rest -= out.rotation[3 * r + c] * axis(c)[i];
                    square += rest * rest;
                }
                squares[i] = square;
            }
        }
        for (uint32_t i = 0; i < count_; ++i) out.best_support += squares[i] < limit;
    }

    template <class T>
    HostVector<T> empty() const {
        return HostVector<T>(HostAllocator<T>(host_));
    }

    defrec_ransac_params params_;
    Host host_;
    size_t stride_ = 0, padded_ = 0;
    uint32_t count_ = 0;  // usable matches
    float threshold_ = 0;
    HostVector<float> arrays_ =
        empty<float>();  // template xyz, live xyz, used, least squared distance
    HostVector<uint32_t> matches_ = empty<uint32_t>();
    HostVector<RansacHypothesis> hypotheses_ = empty<RansacHypothesis>();
    HostVector<float> squares_ = empty<float>();
    HostVector<defrec_landmark> landmarks_ = empty<defrec_landmark>();
    bool prepared_ = false;
};

}  // namespace

std::unique_ptr<Stage> make_ransac(const defrec_ransac_params& params, const Host& host) {
    return std::make_unique<Ransac>(params, host);
}

}  // namespace defrec::cpu
