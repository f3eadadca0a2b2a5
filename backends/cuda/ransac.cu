// Stage ransac: a block for each reference, then what they agree on. docs/stages/ransac.md.
#include <bit>
#include <cfloat>

#include "backends/cuda/ransac_pairs.cuh"
#include "backends/cuda/stages.hpp"
#include "backends/definition/ransac_definition.hpp"

namespace defrec::cuda {
namespace {
using namespace ransac;

struct Frame {
    uint32_t pairs;       // matches that take part
    uint32_t references;  // of them references
    float threshold;      // H, mm
};
struct Hypothesis {
    Rotation rotation;
    Vec3<float> from, to;  // the pair it turns about
    uint32_t support;
};
// What the first kernel leaves to the second.
struct Results {
    Frame* frame;
    Hypothesis* hypotheses;
    float4 *from, *to;  // by match; w: 1 if it takes part, else 0
};

struct Matches {
    const defrec_landmark* landmarks;
    const defrec_match* matches;
    __device__ Pair operator()(uint32_t i) const {
        if (!usable(landmarks[i], matches[i])) return {};
        return {load3<float>(landmarks[i].position), load3<float>(matches[i].position), true};
    }
};
struct StoredPairs {
    const float4 *from, *to;
    __device__ Pair operator()(uint32_t i) const {
        const float4 a = from[i], b = to[i];
        return {{a.x, a.y, a.z}, {b.x, b.y, b.z}, a.w != 0};
    }
};

// ---- each reference on its own ----------------------------------------------

// One bit for each match, set if it takes part. Every warp has to call these.
class Bitmap {
  public:
    __device__ Bitmap(uint32_t* words, uint32_t bits) : words_(words), count_(cover(bits, 32)) {}
    // i: of the warp's lanes, one after the other; beyond the last bit nothing is set.
    __device__ void store(uint32_t i, bool bit) {
        const uint32_t word = __ballot_sync(kAllLanes, bit);
        if (i % 32 == 0 && i / 32 < count_) words_[i / 32] = word;
    }
    __device__ uint32_t set_bits() const {
        uint32_t own = 0;
        for (uint32_t i = threadIdx.x % kWarp; i < count_; i += kWarp) own += __popc(words_[i]);
        for (uint32_t other = 1; other < kWarp; other *= 2)
            own += __shfl_xor_sync(kAllLanes, own, other);
        return own;
    }
    // Where the set bit is that has `rank` others before it.
    __device__ uint32_t find(uint32_t rank) const {
        const uint32_t lane = threadIdx.x % kWarp;
        for (uint32_t first = 0; first < count_; first += kWarp) {
            uint32_t word = first + lane < count_ ? words_[first + lane] : 0;
            uint32_t through = __popc(word);  // in the words up to this one
            for (uint32_t by = 1; by < kWarp; by *= 2) {
                const uint32_t before = __shfl_up_sync(kAllLanes, through, by);
                if (lane >= by) through += before;
            }
            const uint32_t beyond = __ballot_sync(kAllLanes, through > rank);
            if (beyond == 0) {
                rank -= __shfl_sync(kAllLanes, through, kWarp - 1);
                continue;
            }
            const int owner = __ffs(beyond) - 1;
            rank -= __shfl_sync(kAllLanes, through - __popc(word), owner);
            word = __shfl_sync(kAllLanes, word, owner);
            for (; rank > 0; --rank) word &= word - 1;
            return 32 * (first + owner) + __ffs(word) - 1;
        }
        return 0;
    }

  private:
    uint32_t* words_;
    uint32_t count_;
};

// A tenth of the root mean square distance of the live points from their mean.
__device__ float default_threshold(const Pairs<Matches>& pairs, uint32_t taken, BlockSums& sums) {
    const float share = 1 / static_cast<float>(taken);
    float mean[4] = {}, square[1] = {};
    pairs.each([&](const Pair& pair) {
        mean[0] += pair.to.x;
        mean[1] += pair.to.y;
        mean[2] += pair.to.z;
    });
    sums.add_up(mean);
    const Vec3<float> centre{share * mean[0], share * mean[1], share * mean[2]};
    pairs.each([&](const Pair& pair) {
        if (pair.taken) square[0] += squared_length(pair.to - centre);
    });
    sums.add_up(square);
    return fmaxf(static_cast<float>(kMinThreshold),
                 static_cast<float>(kThresholdShare) * std::sqrt(share * square[0]));
}

// Adds weight b a^T to m.
__device__ void add_moment(float m[9], float weight, const Vec3<float>& b, const Vec3<float>& a) {
    const float rows[3] = {weight * b.x, weight * b.y, weight * b.z};
    for (int i = 0; i < 3; ++i) {
        m[3 * i] = fmaf(rows[i], a.x, m[3 * i]);
        m[3 * i + 1] = fmaf(rows[i], a.y, m[3 * i + 1]);
        m[3 * i + 2] = fmaf(rows[i], a.z, m[3 * i + 2]);
    }
}

// Alternates the rotation about the origin and the weights; then how many pairs lie within the
// threshold.
__device__ Rotation follow_pairs(const Pairs<Matches>& pairs, uint32_t iterations, float threshold,
                                 BlockSums& sums, uint32_t& support) {
    constexpr float kMinSquare = 1e-20f;  // mm^2
    Rotation rotation{};
    float limit = FLT_MAX;  // at first every weight is 1
    for (uint32_t iteration = 0; iteration < iterations; ++iteration) {
        float moment[16] = {};
        pairs.each([&](const Pair& pair) {
            const float inverse =
                rsqrtf(fmaxf(squared_length(rest_of(rotation, pair.from, pair.to)), kMinSquare));
            add_moment(moment, fminf(limit * inverse * inverse, 1.0f), pair.to, pair.from);
        });
        sums.add_up(moment);
        rotation = nearest_rotation(moment);
        limit = threshold * threshold;
    }
    float within[1] = {};
    pairs.each([&](const Pair& pair) {
        if (pair.taken && squared_length(rest_of(rotation, pair.from, pair.to)) < limit)
            within[0] += 1;
    });
    sums.add_up(within);
    support = static_cast<uint32_t>(within[0]);
    return rotation;
}

// The first block also says what the frame gave, and begins the summary. Shared memory: the bitmap.
__global__ void __launch_bounds__(kMaxThreads)
    ransac_follow(Matches matches, uint32_t landmarks, defrec_ransac_params params, Results results,
                  defrec_ransac_summary* summary) {
    Pairs<Matches> pairs(matches, landmarks);
    Bitmap taken(dynamic_shared<uint32_t>(), landmarks);
    const bool first_block = blockIdx.x == 0;
    const auto note = [&](uint32_t i, const Pair& pair) {
        taken.store(i, pair.taken);
        if (!first_block || i >= landmarks) return;
        results.from[i] = make_float4(pair.from.x, pair.from.y, pair.from.z, pair.taken);
        results.to[i] = make_float4(pair.to.x, pair.to.y, pair.to.z, 0);
    };
    for (uint32_t k = 0; k < kHeld; ++k) note(k * blockDim.x + threadIdx.x, pairs.held[k]);
    for (uint32_t first = kHeld * blockDim.x; first < landmarks; first += blockDim.x) {
        const uint32_t i = first + threadIdx.x;
        note(i, i < landmarks ? matches(i) : Pair{});
    }
    __syncthreads();

    const uint32_t count = taken.set_bits(), references = min(params.references, count);
    BlockSums sums;
    float threshold = params.threshold_mm;
    if (!(threshold > 0) && count > 0) threshold = default_threshold(pairs, count, sums);
    if (first_block && threadIdx.x == 0) {
        *results.frame = {count, references, threshold};
        summary->inliers = 0;
    }
    if (blockIdx.x >= references) return;

    const Pair origin =
        matches(taken.find(reference_index(params.seed, blockIdx.x, references, count)));
    pairs.turn_about(origin.from, origin.to);
    uint32_t support = 0;
    const Rotation rotation = follow_pairs(pairs, params.iterations, threshold, sums, support);
    if (threadIdx.x == 0)
        results.hypotheses[blockIdx.x] = {rotation, origin.from, origin.to, support};
}

// ---- what they agree on -----------------------------------------------------

struct Choice {
    uint32_t best, needed;  // the reference with the largest support, of equals the first; the
                            // support that acceptance takes
    uint32_t accepted;      // how many references
    bool any;               // the best one is among them
};
// Every warp has to call it.
__device__ Choice choose(const defrec_ransac_params& params, const Results& results) {
    const Frame frame = *results.frame;
    const uint32_t lane = threadIdx.x % kWarp;
    uint32_t support = 0, best = 0;
    for (uint32_t k = lane; k < frame.references; k += kWarp) {
        const uint32_t other = results.hypotheses[k].support;
        if (other > support) {
            support = other;
            best = k;
        }
    }
    for (uint32_t with = 1; with < kWarp; with *= 2) {
        const uint32_t other = __shfl_xor_sync(kAllLanes, support, with),
                       its = __shfl_xor_sync(kAllLanes, best, with);
        if (other > support || (other == support && its < best)) {
            support = other;
            best = its;
        }
    }
    Choice choice{best, needed_support(params, frame.pairs, support), 0, false};
    for (uint32_t k = lane; k < frame.references; k += kWarp)
        choice.accepted += results.hypotheses[k].support >= choice.needed;
    for (uint32_t with = 1; with < kWarp; with *= 2)
        choice.accepted += __shfl_xor_sync(kAllLanes, choice.accepted, with);
    choice.any = choice.accepted > 0;
    return choice;
}

// Each thread's match gets its largest weight over the accepted references: that of the least
// distance.
__device__ void merge(const Matches& matches, uint32_t landmarks, const Results& results,
                      const Choice& choice, defrec_match* weighted,
                      defrec_ransac_summary* summary) {
    constexpr uint32_t kTile = 32;
    __shared__ Hypothesis tile[kTile];
    const Frame frame = *results.frame;
    const uint32_t i = (blockIdx.x - 1) * blockDim.x + threadIdx.x;
    const Pair pair = i < landmarks ? StoredPairs{results.from, results.to}(i) : Pair{};
    float minimum = FLT_MAX;
    for (uint32_t first = 0; first < frame.references; first += kTile) {
        const uint32_t count = min(kTile, frame.references - first);
        __syncthreads();
        if (threadIdx.x < count) tile[threadIdx.x] = results.hypotheses[first + threadIdx.x];
        __syncthreads();
        for (uint32_t k = 0; k < count; ++k)
            if (tile[k].support >= choice.needed)
                minimum = fminf(minimum,
                                squared_length(rest_of(tile[k].rotation, pair.from - tile[k].from,
                                                       pair.to - tile[k].to)));
    }
    float weight = pair.taken ? fminf(frame.threshold / std::sqrt(minimum), 1.0f) : 0;
    if (!(weight >= kKeptWeight)) weight = 0;
    if (i < landmarks) {
        defrec_match match = matches.matches[i];
        match.weight = weight;
        weighted[i] = match;
    }
    const int inliers = __syncthreads_count(weight > 0.5f);
    if (threadIdx.x == 0) atomicAdd(&summary->inliers, inliers);
}

// Fits the best reference's motion to its inliers, now without the reference as centre.
__device__ void summarise(uint32_t landmarks, const Results& results, const Choice& choice,
                          defrec_ransac_summary* summary) {
    const Frame frame = *results.frame;
    const float limit = frame.threshold * frame.threshold;
    Rotation rotation{{1, 0, 0, 0, 1, 0, 0, 0, 1}};
    Vec3<float> shift{}, translation{};  // shift: the translation of points relative to the origin
    uint32_t support = 0;
    if (choice.any) {
        const Hypothesis best = results.hypotheses[choice.best];
        Pairs<StoredPairs> pairs({results.from, results.to}, landmarks);
        pairs.turn_about(best.from, best.to);
        rotation = best.rotation;
        BlockSums sums;
        for (uint32_t round = 0; round <= kRefinements; ++round) {
            float sum[16] = {};  // moment about the origin, template and live points, count
            pairs.each([&](const Pair& pair) {
                if (!pair.taken ||
                    !(squared_length(rest_of(rotation, pair.from, pair.to) - shift) < limit))
                    return;
                add_moment(sum, 1, pair.to, pair.from);
                const float points[7] = {
                    pair.from.x, pair.from.y, pair.from.z, pair.to.x, pair.to.y, pair.to.z, 1};
                for (int i = 0; i < 7; ++i) sum[9 + i] += points[i];
            });
            sums.add_up(sum);
            support = static_cast<uint32_t>(sum[15]);
            if (round == kRefinements || support == 0) break;
            const float share = 1 / sum[15];
            const Vec3<float> from{share * sum[9], share * sum[10], share * sum[11]},
                to{share * sum[12], share * sum[13], share * sum[14]};
            add_moment(sum, -sum[15], to, from);  // now about the means
            rotation = nearest_rotation(sum);
            shift = rest_of(rotation, from, to);
        }
        translation = rest_of(rotation, best.from, best.to) + shift;
    }
    if (threadIdx.x != 0) return;
    summary->valid_matches = static_cast<int32_t>(frame.pairs);
    summary->references = static_cast<int32_t>(choice.accepted);
    summary->best_support = static_cast<int32_t>(support);
    for (int i = 0; i < 9; ++i) summary->rotation[i] = rotation.r[i];
    store3(translation, summary->translation);
}

// The first block writes the summary but for its inliers, which the others count.
__global__ void __launch_bounds__(kMaxThreads)
    ransac_merge(Matches matches, uint32_t landmarks, defrec_ransac_params params, Results results,
                 defrec_match* weighted, defrec_ransac_summary* summary) {
    const Choice choice = choose(params, results);
    if (blockIdx.x == 0)
        summarise(landmarks, results, choice, summary);
    else
        merge(matches, landmarks, results, choice, weighted, summary);
}

class Ransac final : public Stage {
  public:
    Ransac(const defrec_ransac_params& params, Device& device)
        : p_(bounded(params)),
          device_(device),
          frame_(make_buffer<Frame>(device, 1)),
          hypotheses_(make_buffer<Hypothesis>(device, params.references)),
          from_(make_buffer<float4>(device, params.landmarks)),
          to_(make_buffer<float4>(device, params.landmarks)) {}

    void prepare(std::span<const InBuffer> in) override {
        const std::span<const defrec_landmark> landmarks = read_template(p_, in);
        landmarks_ = upload(device_, std::vector(landmarks.begin(), landmarks.end()));
        count_ = static_cast<uint32_t>(landmarks.size());
    }

    void record(Recorder& recorder, std::span<const InBuffer> in,
                std::span<const OutBuffer> out) override {
        if (!landmarks_) throw StageError(DEFREC_ERROR_STATE, "ransac: run before prepare");
        const auto given = view_buffers<RansacBuffers>(count_, in, out);
        const Matches matches{landmarks_.as<defrec_landmark>(), given.matches};
        const Results results{frame_.as<Frame>(), hypotheses_.as<Hypothesis>(), from_.as<float4>(),
                              to_.as<float4>()};
        const uint32_t threads =
            std::clamp(std::bit_ceil(cover(count_, kHeld)), kMinThreads, kMaxThreads);
        recorder.launch(ransac_follow, {dim3(p_.references), dim3(threads), bitmap_bytes(count_)},
                        matches, count_, p_, results, given.summary);
        recorder.launch(ransac_merge, {dim3(1 + cover(count_, threads)), dim3(threads)}, matches,
                        count_, p_, results, given.weighted, given.summary);
    }

    static size_t bitmap_bytes(uint32_t landmarks) {
        return size_t{cover(landmarks, 32)} * sizeof(uint32_t);
    }

  private:
    defrec_ransac_params p_;
    Device& device_;
    uint32_t count_ = 0;
    Buffer landmarks_, frame_, hypotheses_, from_, to_;
};

}  // namespace

std::unique_ptr<Stage> make_ransac(const defrec_ransac_params& params, Device& device) {
    check_params(params);
    if (Ransac::bitmap_bytes(params.landmarks) + BlockSums::kSharedBytes >
        device.limits().shared_per_block)
        throw StageError(DEFREC_ERROR_UNSUPPORTED, "ransac: " + std::to_string(params.landmarks) +
                                                       " landmarks are too many for this device");
    return std::make_unique<Ransac>(params, device);
}

}  // namespace defrec::cuda
