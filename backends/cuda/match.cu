// Stage match: one search gives both directions, in splits; then one match for each landmark.
// docs/stages/match.md.
#include <algorithm>
#include <cstring>
#include <vector>

#include "backends/cuda/stages.hpp"
#include "backends/definition/match_definition.hpp"

namespace defrec::cuda {
namespace {

// Neighbours are compared by keys, distance << 16 | index: the least key is the nearest, then the
// first.
constexpr uint32_t kNoKey = 0xffffffff;
constexpr uint32_t kPlaces = 3;      // nearest live features of a landmark that count
constexpr uint32_t kMaxSplits = 32;  // a lane puts one split's keys together
constexpr uint32_t kSearchWarps = 4, kSearchThreads = kSearchWarps * kWarp;
constexpr uint32_t kStaged = 64;  // live features in shared memory at once
constexpr uint32_t kAcceptWarps = 4;

struct Descriptor {
    uint4 low, high;
};
static_assert(sizeof(Descriptor) == sizeof(defrec_landmark::descriptor));
static_assert(sizeof(defrec_feature) == 3 * sizeof(uint4) &&
              offsetof(defrec_feature, descriptor) == sizeof(uint4));

// The bits of three words added up: ones, and carries that count twice.
__device__ uint32_t ones(uint32_t a, uint32_t b, uint32_t c) { return a ^ b ^ c; }
__device__ uint32_t twos(uint32_t a, uint32_t b, uint32_t c) { return (a & b) | (c & (a ^ b)); }

// Four bit counts instead of eight: they are what a multiprocessor does least of.
__device__ uint32_t hamming(const Descriptor& a, const Descriptor& b) {
    const uint32_t x0 = a.low.x ^ b.low.x, x1 = a.low.y ^ b.low.y, x2 = a.low.z ^ b.low.z,
                   x3 = a.low.w ^ b.low.w;
    const uint32_t x4 = a.high.x ^ b.high.x, x5 = a.high.y ^ b.high.y, x6 = a.high.z ^ b.high.z,
                   x7 = a.high.w ^ b.high.w;
    const uint32_t ones1 = ones(x0, x1, x2), twos1 = twos(x0, x1, x2);
    const uint32_t ones2 = ones(x3, x4, x5), twos2 = twos(x3, x4, x5);
    const uint32_t ones3 = ones(ones1, ones2, x6), twos3 = twos(ones1, ones2, x6);
    const uint32_t all_twos = ones(twos1, twos2, twos3), fours = twos(twos1, twos2, twos3);
    return static_cast<uint32_t>(__popc(ones3) + __popc(x7) + 2 * __popc(all_twos) +
                                 4 * __popc(fours));
}

struct Best {
    uint32_t key[kPlaces] = {kNoKey, kNoKey, kNoKey};  // the least, in order
};
__device__ void insert(Best& best, uint32_t key) {
    const uint32_t behind_first = max(best.key[0], key),
                   behind_second = max(best.key[1], behind_first);
    best.key[0] = min(best.key[0], key);
    best.key[1] = min(best.key[1], behind_first);
    best.key[2] = min(best.key[2], behind_second);
}

__device__ uint32_t min_of_warp(uint32_t key) {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
    for (int step = 16; step > 0; step /= 2) key = min(key, __shfl_xor_sync(kAllLanes, key, step));
    return key;
#else
    return __reduce_min_sync(kAllLanes, key);
#endif
}

// Block (x, y) compares the x-th split of the live features with the y-th split of the landmarks. A
// lane has a landmark; each warp takes its turn of the features. feature_keys: for each landmark
// and split of features the three nearest. landmark_keys: for each live feature and split of
// landmarks the nearest. Dynamic shared memory: those of this split.
__global__ void __launch_bounds__(kSearchThreads, 8)
    search(MatchSizes sizes, const Descriptor* landmarks, const uint4* features,
           const uint32_t* live_count, uint32_t* feature_keys, uint32_t* landmark_keys) {
    __shared__ Descriptor staged[kStaged];
    __shared__ uint32_t of_warps[kSearchWarps][kPlaces][kWarp];
    uint32_t* const nearest = dynamic_shared<uint32_t>();
    const uint32_t thread = threadIdx.x, warp = thread / kWarp, lane = thread % kWarp;
    const uint32_t live = min(*live_count, sizes.features);
    const uint32_t share = (live + sizes.feature_splits - 1) / sizes.feature_splits;
    const uint32_t first = min(blockIdx.x * share, live), end = min(first + share, live);
    const uint32_t groups = (sizes.landmarks + kWarp - 1) / kWarp;
    const uint32_t group_share = (groups + sizes.landmark_splits - 1) / sizes.landmark_splits;
    const uint32_t first_group = blockIdx.y * group_share,
                   end_group = min(first_group + group_share, groups);

    for (uint32_t i = thread; i < end - first; i += kSearchThreads) nearest[i] = kNoKey;
    for (uint32_t group = first_group; group < end_group; ++group) {
        const uint32_t landmark = group * kWarp + lane;
        const bool there = landmark < sizes.landmarks;
        const Descriptor own = landmarks[min(landmark, sizes.landmarks - 1)];
        Best best;
        for (uint32_t begin = first; begin < end; begin += kStaged) {
            const uint32_t count = min(end - begin, kStaged);
            __syncthreads();
            for (uint32_t i = thread; i < 2 * count; i += kSearchThreads)
                (i % 2 == 0 ? staged[i / 2].low : staged[i / 2].high) =
                    features[3 * (begin + i / 2) + 1 + i % 2];
            __syncthreads();
            for (uint32_t i = warp; i < count; i += kSearchWarps) {
                const uint32_t distance = hamming(own, staged[i]) << 16;
                insert(best, distance | (begin + i));
                const uint32_t nearer = min_of_warp(there ? distance | landmark : kNoKey);
                if (lane == 0) nearest[begin + i - first] = min(nearest[begin + i - first], nearer);
            }
        }
        for (uint32_t place = 0; place < kPlaces; ++place)
            of_warps[warp][place][lane] = best.key[place];
        __syncthreads();
        if (warp == 0 && there) {
            for (uint32_t other = 1; other < kSearchWarps; ++other)
                for (uint32_t place = 0; place < kPlaces; ++place)
                    insert(best, of_warps[other][place][lane]);
            for (uint32_t place = 0; place < kPlaces; ++place)
                feature_keys[(landmark * sizes.feature_splits + blockIdx.x) * kPlaces + place] =
                    best.key[place];
        }
        __syncthreads();
    }
    for (uint32_t i = thread; i < end - first; i += kSearchThreads)
        landmark_keys[(first + i) * sizes.landmark_splits + blockIdx.y] = nearest[i];
}

// A warp for each landmark, a lane for each split.
__global__ void __launch_bounds__(kAcceptWarps* kWarp)
    accept(MatchSizes sizes, defrec_match_params params, match::Inputs live,
           const uint32_t* feature_keys, const uint32_t* landmark_keys, defrec_match* matches) {
    const uint32_t landmark = blockIdx.x * kAcceptWarps + threadIdx.x / kWarp,
                   lane = threadIdx.x % kWarp;
    if (landmark >= sizes.landmarks) return;
    Best best;
    if (lane < sizes.feature_splits)
        for (uint32_t place = 0; place < kPlaces; ++place)
            best.key[place] =
                feature_keys[(landmark * sizes.feature_splits + lane) * kPlaces + place];
    for (int step = 16; step > 0; step /= 2) {
        const Best own = best;
        for (uint32_t place = 0; place < kPlaces; ++place)
            insert(best, __shfl_xor_sync(kAllLanes, own.key[place], step));
    }
    uint32_t nearest_landmark =
        kNoKey;  // to the nearest feature; asked for before what needs it later
    if (best.key[0] != kNoKey && lane < sizes.landmark_splits)
        nearest_landmark = landmark_keys[(best.key[0] & 0xffff) * sizes.landmark_splits + lane];
    match::Nearest nearest;
    for (uint32_t place = 0; place < kPlaces; ++place) {
        if (best.key[place] == kNoKey) break;
        nearest.feature[place] = static_cast<int32_t>(best.key[place] & 0xffff);
        nearest.distance[place] = static_cast<int32_t>(best.key[place] >> 16);
    }
    const match::TwoBest two = match::choose(live, nearest);
    const bool mutual = (min_of_warp(nearest_landmark) & 0xffff) == landmark;
    if (lane == 0)
        matches[landmark] =
            match::lift<float>(params, live, two, match::accepts(params, two) && mutual);
}

// Enough blocks for a large device, little to put together.
uint32_t splits_of(uint32_t count) { return std::clamp(cover(count, kWarp), 1u, kMaxSplits); }

class Match final : public Stage {
  public:
    Match(const defrec_match_params& params, Device& device)
        : p_(params),
          device_(device),
          feature_keys_(make_buffer<uint32_t>(
              device, uint64_t{kPlaces} * splits_of(params.features) * params.landmarks)),
          landmark_keys_(make_buffer<uint32_t>(
              device, uint64_t{splits_of(params.landmarks)} * params.features)) {}

    void prepare(std::span<const InBuffer> in) override {
        const std::span<const defrec_landmark> given = read_template(p_, in);
        std::vector<Descriptor> descriptors(given.size());
        for (size_t i = 0; i < given.size(); ++i)
            std::memcpy(&descriptors[i], given[i].descriptor, sizeof descriptors[i]);
        landmarks_ = upload(device_, descriptors);
        landmark_count_ = static_cast<uint32_t>(given.size());
    }

    void record(Recorder& recorder, std::span<const InBuffer> in,
                std::span<const OutBuffer> out) override {
        const auto given =
            view_buffers<MatchBuffers>(MatchBuffers::Sizes{p_, landmark_count_}, in, out);
        const uint32_t features = room_for_features(p_, in[1]);
        if (landmark_count_ == 0) return;
        const MatchSizes sizes{.landmarks = landmark_count_,
                               .features = features,
                               .feature_splits = splits_of(features),
                               .landmark_splits = splits_of(landmark_count_)};
        const size_t shared = sizeof(uint32_t) * cover(features, sizes.feature_splits);
        recorder.early({range_of(given.count, 1), range_of(given.features, features)}, [&] {
            recorder.launch(
                search, {dim3(sizes.feature_splits, sizes.landmark_splits), kSearchThreads, shared},
                sizes, landmarks_.as<Descriptor>(), reinterpret_cast<const uint4*>(given.features),
                given.count, feature_keys_.as<uint32_t>(), landmark_keys_.as<uint32_t>());
        });
        recorder.launch(accept, {cover(landmark_count_, kAcceptWarps), kAcceptWarps * kWarp}, sizes,
                        p_, match::Inputs{features, given.features, given.disparity},
                        feature_keys_.as<uint32_t>(), landmark_keys_.as<uint32_t>(), given.matches);
    }

  private:
    defrec_match_params p_;
    Device& device_;
    uint32_t landmark_count_ = 0;
    Buffer landmarks_, feature_keys_, landmark_keys_;
};

}  // namespace

std::unique_ptr<Stage> make_match(const defrec_match_params& params, Device& device) {
    check_params(params);
    return std::make_unique<Match>(params, device);
}

}  // namespace defrec::cuda
