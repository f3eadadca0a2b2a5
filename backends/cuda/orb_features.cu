// Stage orb, sections 7 to 9 (docs/stages/orb.md): a warp makes a feature from the pixels round it,
// which it smooths itself (section 2).
#include <vector>

#include "backends/cuda/orb_score.cuh"
#include "backends/cuda/orb_steps.hpp"

namespace defrec::cuda {
namespace {

constexpr int kWarps = 4;  // of a block
constexpr int kPatchRadius = orb::kPatchRadius,
              kRadius = orb::kBorder;   // of the descriptor, and of what it is smoothed from
constexpr int kSide = 2 * kRadius + 1;  // rows of the patch
constexpr int kRowWords = (kSide + 3 + 3) / 4;  // wherever the first pixel lies in its word
constexpr int kSmoothedStride = 32;
constexpr int kSmoothRadius = orb::kSmoothRadius;
constexpr uint32_t kSmoothWeights = 0x04060401;  // the first four of 1 4 6 4 1
constexpr int kWords = static_cast<int>(orb::kTests) / 32;

// The disc's half heights in columns 0 .. 15 from its middle, 4 bits each; as it is its own mirror
// image, those are the half widths of rows.
constexpr uint64_t kDiscHalfHeights = [] {
    uint64_t packed = 0;
    for (int i = kPatchRadius; i >= 0; --i)
        packed = packed << 4 | static_cast<uint64_t>(orb::kDiscHalfWidth[static_cast<size_t>(i)]);
    return packed;
}();
constexpr bool kDiscIsSymmetric = [] {
    for (int x = 0; x <= kPatchRadius; ++x)
        for (int y = 0; y <= kPatchRadius; ++y)
            if ((x <= orb::kDiscHalfWidth[static_cast<size_t>(y)]) !=
                (y <= orb::kDiscHalfWidth[static_cast<size_t>(x)]))
                return false;
    return true;
}();
static_assert(kDiscIsSymmetric);

struct Patch {
    uint32_t words[kSide * kRowWords];
    uint16_t smoothed[(2 * kPatchRadius + 1) * kSmoothedStride];
    __device__ const uint8_t* bytes() const { return reinterpret_cast<const uint8_t*>(words); }
};

struct Place {
    int level, x, y;  // px of the level
    uint32_t score;
};
__device__ Place place_of(const OrbLevels& levels, uint32_t cell_index, const uint32_t* corners) {
    int l = 0;
    while (l + 1 < levels.levels && cell_index >= levels.level[l + 1].first_cell) ++l;
    const int in_level = static_cast<int>(cell_index - levels.level[l].first_cell),
              across = levels.level[l].cells_x;
    const uint32_t corner = corners[cell_index];
    return {l, orb::kBorder + levels.cell * (in_level % across) + static_cast<int>(corner & 255),
            orb::kBorder + levels.cell * (in_level / across) + static_cast<int>(corner >> 8 & 255),
            corner >> 16};
}

// The pixels round the place, in words; pixel (-kRadius, -kRadius) is byte `first` of them.
__device__ int load_patch(const OrbLevel& level, const Place& place, const uint8_t* pyramid,
                          int lane, Patch& patch) {
    const int first_byte = place.x - kRadius;
    const auto* words = reinterpret_cast<const uint32_t*>(pyramid + level.first) +
                        (place.y - kRadius) * (level.stride / 4) + first_byte / 4;
#pragma unroll
    for (int i = 0; i < kSide * kRowWords; i += static_cast<int>(kWarp))
        if (i + lane < kSide * kRowWords)
            patch.words[i + lane] =
                words[(i + lane) / kRowWords * (level.stride / 4) + (i + lane) % kRowWords];
    return first_byte % 4;
}

// Lane i smooths column i - kPatchRadius, and sums what of it lies in the disc. Returns the
// orientation bin.
__device__ uint32_t smooth_and_orient(int first, int lane, Patch& patch) {
    const int dx = lane - kPatchRadius, away = abs(dx);
    const int half_height =
        away <= kPatchRadius ? static_cast<int>(kDiscHalfHeights >> (4 * away) & 15) : -1;
    const uint32_t* const words = patch.words + (first + lane) / 4;
    const uint32_t shift = static_cast<uint32_t>(first + lane) % 4 * 8;
    uint32_t across[2 * kSmoothRadius + 1];  // of the last five rows, in turn
    int sum = 0, turning = 0;
#pragma unroll
    for (int row = 0; row < kSide; ++row) {
        const uint32_t low = words[row * kRowWords], high = words[row * kRowWords + 1];
        const uint32_t four = __funnelshift_r(low, high, shift), fifth = high >> shift & 255;
        across[row % 5] = __dp4a(four, kSmoothWeights, fifth);
        const int dy = row - kRadius;
        if (dy >= -kPatchRadius && dy <= kPatchRadius) {
            const int pixel = abs(dy) <= half_height ? static_cast<int>(four >> 16 & 255) : 0;
            sum += pixel;
            turning += dy * pixel;
        }
        if (row < 2 * kSmoothRadius) continue;
        const uint32_t outer = across[(row + 1) % 5] + across[row % 5],
                       inner = across[(row + 2) % 5] + across[(row + 4) % 5];
        patch.smoothed[(row - 2 * kSmoothRadius) * kSmoothedStride + lane] =
            static_cast<uint16_t>(outer + 4 * inner + 6 * across[(row + 3) % 5]);
    }
    int mx = dx * sum, my = turning;
    for (int step = 16; step > 0; step /= 2) {
        mx += __shfl_xor_sync(kAllLanes, mx, step);
        my += __shfl_xor_sync(kAllLanes, my, step);
    }
    return orb::angle_bin(mx, my);
}

// Scores of the corner and the pixels left, right, above and below it, by one lane each; the other
// lanes' mean nothing.
__device__ int score_near(int first, int lane, const Patch& patch) {
    constexpr int kStride = 4 * kRowWords;
    const int dx = lane == 1 ? -1 : lane == 2 ? 1 : 0, dy = lane == 3 ? -1 : lane == 4 ? 1 : 0;
    const uint8_t* centre = patch.bytes() + first + (kRadius + dy) * kStride + kRadius + dx;
    uint32_t circle[16];
    load_circle<kStride>(centre, circle, std::make_index_sequence<16>());
    return static_cast<int>(corner_scores(*centre, circle) & 0xffff);
}

__global__ void __launch_bounds__(kWarps* kWarp)
    describe(OrbLevels levels, const uint8_t* pyramid, const uint32_t* corners,
             const uint32_t* kept, const uint32_t* count, const uint32_t* patterns,
             uint32_t* features) {
    __shared__ Patch patches[kWarps];
    const uint32_t warp = threadIdx.x / kWarp, feature = blockIdx.x * kWarps + warp;
    if (feature >= *count) return;
    const int lane = static_cast<int>(threadIdx.x % kWarp);
    Patch& patch = patches[warp];
    const Place place = place_of(levels, kept[feature], corners);
    const int first = load_patch(levels.level[place.level], place, pyramid, lane, patch);
    __syncwarp();
    const uint32_t bin = smooth_and_orient(first, lane, patch);
    const int score = score_near(first, lane, patch);
    __syncwarp();

    constexpr int kHead = 4;  // words of a feature before the descriptor
    uint32_t own = 0;         // word `lane` of the feature
#pragma unroll
    for (int word = 0; word < kWords; ++word) {
        const uint32_t points =
            patterns[bin * orb::kTests + static_cast<uint32_t>(32 * word + lane)];
        const uint32_t bits = __ballot_sync(
            kAllLanes, patch.smoothed[points & 0xffff] < patch.smoothed[points >> 16]);
        if (lane == kHead + word) own = bits;
    }
    int scores[5];
    for (int i = 0; i < 5; ++i) scores[i] = __shfl_sync(kAllLanes, score, i);
    const auto level = static_cast<uint32_t>(place.level);
    const auto in_image = [&](int px, int before, int behind) {
        return static_cast<uint32_t>(
            orb::to_image(static_cast<uint32_t>(16 * px + orb::peak(before, scores[0], behind)),
                          level, static_cast<uint32_t>(levels.halvings)));
    };
    if (lane == 0) own = in_image(place.x, scores[1], scores[2]);
    if (lane == 1) own = in_image(place.y, scores[3], scores[4]);
    if (lane == 2) own = level | bin << 16;
    if (lane == 3) own = place.score;
    if (lane < kHead + kWords)
        features[feature * (kHead + kWords) + static_cast<uint32_t>(lane)] = own;
}
static_assert(sizeof(defrec_feature) == 4 * (4 + kWords));

}  // namespace

std::vector<uint32_t> orb_patterns() {
    std::vector<uint32_t> patterns;
    const auto in_patch = [](const orb::Offset& point) {
        return static_cast<uint32_t>((point.y + kPatchRadius) * kSmoothedStride + point.x +
                                     kPatchRadius);
    };
    for (uint32_t bin = 0; bin < DEFREC_ORB_ANGLE_BINS; ++bin) {
        const orb::Pattern pattern = orb::turned_pattern(bin);
        for (size_t i = 0; i < pattern.size(); i += 2)
            patterns.push_back(in_patch(pattern[i]) | in_patch(pattern[i + 1]) << 16);
    }
    return patterns;
}

void record_orb_features(Recorder& recorder, const OrbLevels& levels, const OrbMemory& memory,
                         const uint32_t* patterns) {
    recorder.launch(describe,
                    {cover(static_cast<uint32_t>(levels.capacity), kWarps), kWarps * kWarp}, levels,
                    memory.pyramid, memory.corners, memory.kept, memory.feature_count, patterns,
                    reinterpret_cast<uint32_t*>(memory.features));
}

}  // namespace defrec::cuda
