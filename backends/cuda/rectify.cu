// Stage rectify: a block samples its tile and the rim round it, and grows the mask in shared
// memory, a bit for each pixel. docs/stages/rectify.md.
#include "backends/cuda/stages.hpp"
#include "backends/shared/gray.hpp"
#include "backends/stages/rectify.hpp"

namespace defrec::cuda {
namespace {

// A tile with the rim round it is so many words of bits wide.
constexpr int kBits = static_cast<int>(kWarp), kWords = 4, kRimWidth = kWords * kBits,
              kTileHeight = 32, kThreads = 512;
constexpr int kMaxRows = kTileHeight + 2 * kRectifyMaxHighlightRadius;
constexpr uint32_t kUsualRadius = 4;  // of highlights: the default
constexpr int tile_width(int radius) { return kRimWidth - 2 * radius; }

struct Sample {
    int gray;
    bool outside, covered;
};

template <uint32_t kFormat>
__device__ int gray_at(const uint8_t* row, int x) {
    const uint8_t* pixel = row + x * bytes_per_pixel(kFormat);
    if constexpr (kFormat == DEFREC_FORMAT_GRAY8) return pixel[0];
    const int red = pixel[kFormat == DEFREC_FORMAT_RGB8 ? 0 : 2], green = pixel[1],
              blue = pixel[kFormat == DEFREC_FORMAT_RGB8 ? 2 : 0];
    return gray_of(red, green, blue);
}

__device__ const uint8_t* row_of(const RectifyConstants& c, const RectifyBuffers& given, int y) {
    return given.source + int64_t{y} * c.source_stride;
}
__device__ bool usable(const RectifyConstants& c, const RectifyBuffers& given, int x, int y) {
    return given.ignore[int64_t{y} * c.source_width + x] == 0;
}

template <uint32_t kFormat>
__device__ Sample sample(const RectifyConstants& c, const RectifyBuffers& given, int x, int y) {
    if (given.map == nullptr)
        return {gray_at<kFormat>(row_of(c, given, y), x), false,
                given.ignore == nullptr || usable(c, given, x, y)};
    const int2 at = reinterpret_cast<const int2*>(given.map)[int64_t{y} * c.width + x];
    const int last_x = c.source_width - 1, last_y = c.source_height - 1;
    if (at.x < 0 || at.y < 0 || at.x > kMapOne * last_x || at.y > kMapOne * last_y)
        return {0, true, false};
    const int left = at.x >> 7, upper = at.y >> 7, a = at.x & 127, b = at.y & 127;
    const int right = min(left + 1, last_x), lower = min(upper + 1, last_y);
    const uint8_t *const upper_row = row_of(c, given, upper), *const lower_row =
                                                                  row_of(c, given, lower);
    const int above =
        (128 - a) * gray_at<kFormat>(upper_row, left) + a * gray_at<kFormat>(upper_row, right);
    const int below =
        (128 - a) * gray_at<kFormat>(lower_row, left) + a * gray_at<kFormat>(lower_row, right);
    const bool covered = given.ignore == nullptr ||
                         (usable(c, given, left, upper) && usable(c, given, right, upper) &&
                          usable(c, given, left, lower) && usable(c, given, right, lower));
    return {((128 - b) * above + b * below + 8192) >> 14, false, covered};
}

// Bit k of a row's word w is column 32 w + k of its tile with the rim round it.
struct MaskRows {
    uint32_t words[kMaxRows][kWords];
    __device__ uint32_t& at(int item) { return words[item / kWords][item % kWords]; }
};

// Whether there is a set bit within the radius, in the row alone.
__device__ __forceinline__ uint32_t grown_in_row(const uint32_t (&row)[kWords], int word,
                                                 int radius) {
    const uint32_t before = word > 0 ? row[word - 1] : 0, here = row[word],
                   after = word + 1 < kWords ? row[word + 1] : 0;
    uint32_t grown = here;
    for (int dx = 1; dx <= radius; ++dx)
        grown |= __funnelshift_r(here, after, static_cast<uint32_t>(dx)) |
                 __funnelshift_r(before, here, static_cast<uint32_t>(kBits - dx));
    return grown;
}

// kRadius: of highlights, where it is known beforehand, else 0.
template <uint32_t kFormat, int kRadius>
__global__ void __launch_bounds__(kThreads) rectify(RectifyConstants c, RectifyBuffers given) {
    __shared__ MaskRows saturated, near_in_row, usable_here;
    const int radius = kRadius > 0 ? kRadius : static_cast<int>(c.highlight_radius);
    const int width = tile_width(radius), rows = kTileHeight + 2 * radius;
    const int left = static_cast<int>(blockIdx.x) * width,
              top = static_cast<int>(blockIdx.y) * kTileHeight;
    const int thread = static_cast<int>(threadIdx.x), word = thread / kBits % kWords,
              bit = thread % kBits, column = kBits * word + bit - radius, x = left + column;

    for (int row = thread / kRimWidth; row < rows; row += kThreads / kRimWidth) {
        const int y = top + row - radius;
        const bool in_image = x >= 0 && y >= 0 && x < c.width && y < c.height;
        const Sample here = in_image ? sample<kFormat>(c, given, x, y) : Sample{0, true, false};
        const uint32_t light = __ballot_sync(kAllLanes, !here.outside && here.gray >= c.saturation);
        const uint32_t usable = __ballot_sync(kAllLanes, !here.outside && here.covered);
        if (bit == 0) {
            saturated.words[row][word] = light;
            usable_here.words[row][word] = usable;
        }
        if (in_image && row >= radius && row < radius + kTileHeight && column >= 0 &&
            column < width)
            given.gray[int64_t{y} * c.stride + x] = static_cast<uint8_t>(here.gray);
    }
    __syncthreads();
    for (int i = thread; i < kWords * rows; i += kThreads)
        near_in_row.at(i) = grown_in_row(saturated.words[i / kWords], i % kWords, radius);
    __syncthreads();
    for (int i = thread; i < kWords * kTileHeight; i += kThreads) {
        uint32_t near_any = 0;
        for (int dy = 0; dy <= 2 * radius; ++dy) near_any |= near_in_row.at(i + kWords * dy);
        usable_here.at(i + kWords * radius) &= ~near_any;
    }
    __syncthreads();
    if (column < 0 || column >= width || x >= c.width) return;
    for (int row = thread / kRimWidth; row < min(kTileHeight, c.height - top);
         row += kThreads / kRimWidth) {
        const uint32_t usable = usable_here.words[row + radius][word] >> bit & 1;
        given.mask[int64_t{top + row} * c.stride + x] = usable != 0 ? 255 : 0;
    }
}

class Rectify final : public Stage {
  public:
    explicit Rectify(const defrec_rectify_params& params) : p_(params) {}

    bool reentrant() const override { return true; }
    void record(Recorder& recorder, std::span<const InBuffer> in,
                std::span<const OutBuffer> out) override {
        const RectifyBuffers given = rectify_buffers(p_, in, out);
        const auto width = static_cast<uint32_t>(tile_width(static_cast<int>(p_.highlight_radius)));
        recorder.launch(
            kernel(), {dim3(cover(p_.width, width), cover(p_.height, kTileHeight)), dim3(kThreads)},
            constants_of(p_), given);
    }

  private:
    using Kernel = void (*)(RectifyConstants, RectifyBuffers);
    template <int kRadius>
    Kernel kernel_with() const {
        switch (p_.format) {
            case DEFREC_FORMAT_GRAY8:
                return rectify<DEFREC_FORMAT_GRAY8, kRadius>;
            case DEFREC_FORMAT_BGR8:
                return rectify<DEFREC_FORMAT_BGR8, kRadius>;
            case DEFREC_FORMAT_RGB8:
                return rectify<DEFREC_FORMAT_RGB8, kRadius>;
            default:
                return rectify<DEFREC_FORMAT_BGRA8, kRadius>;
        }
    }
    Kernel kernel() const {
        return p_.highlight_radius == kUsualRadius ? kernel_with<kUsualRadius>() : kernel_with<0>();
    }
    defrec_rectify_params p_;
};

}  // namespace

std::unique_ptr<Stage> make_rectify(const defrec_rectify_params& params, Device&) {
    check_params(params);
    return std::make_unique<Rectify>(params);
}

}  // namespace defrec::cuda
