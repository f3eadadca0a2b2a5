// Stage rectify: a block samples its tile and the rim round it, and grows the mask in shared
// memory. docs/stages/rectify.md.
#include "backends/cuda/stages.hpp"
#include "backends/shared/gray.hpp"
#include "backends/stages/rectify.hpp"

namespace defrec::cuda {
namespace {

constexpr int kTileWidth = 64, kTileHeight = 32, kThreads = 512;
constexpr uint32_t kUsualRadius = 4;  // of highlights: the default

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

// Shared memory: which pixels of the tile with its rim are saturated, then which have one of those
// within the radius in their row. kRadius: of highlights, where it is known beforehand, else 0.
template <uint32_t kFormat, int kRadius>
__global__ void __launch_bounds__(kThreads) rectify(RectifyConstants c, RectifyBuffers given) {
    const int radius = kRadius > 0 ? kRadius : static_cast<int>(c.highlight_radius);
    const int rim_width = kTileWidth + 2 * radius, rim_height = kTileHeight + 2 * radius;
    uint8_t* const saturated = dynamic_shared<uint8_t>();
    uint8_t* const near_in_row = saturated + rim_width * rim_height;
    uint8_t* const usable_here = near_in_row + kTileWidth * rim_height;
    const int left = static_cast<int>(blockIdx.x) * kTileWidth,
              top = static_cast<int>(blockIdx.y) * kTileHeight;
    const int thread = static_cast<int>(threadIdx.x);

    for (int i = thread; i < rim_width * rim_height; i += kThreads) {
        const int column = i % rim_width - radius, row = i / rim_width - radius;
        const int x = left + column, y = top + row;
        const bool in_image = x >= 0 && y >= 0 && x < c.width && y < c.height;
        const Sample here = in_image ? sample<kFormat>(c, given, x, y) : Sample{0, true, false};
        saturated[i] = !here.outside && here.gray >= c.saturation;
        if (column < 0 || row < 0 || column >= kTileWidth || row >= kTileHeight) continue;
        usable_here[row * kTileWidth + column] = !here.outside && here.covered;
        if (in_image) given.gray[int64_t{y} * c.stride + x] = static_cast<uint8_t>(here.gray);
    }
    __syncthreads();
    for (int i = thread; i < kTileWidth * rim_height; i += kThreads) {
        const uint8_t* from = saturated + i / kTileWidth * rim_width + i % kTileWidth;
        uint8_t near_any = 0;
        for (int dx = 0; dx <= 2 * radius; ++dx) near_any |= from[dx];
        near_in_row[i] = near_any;
    }
    __syncthreads();
    for (int i = thread; i < kTileWidth * kTileHeight; i += kThreads) {
        const int x = left + i % kTileWidth, y = top + i / kTileWidth;
        if (x >= c.width || y >= c.height) continue;
        uint8_t near_any = 0;
        for (int dy = 0; dy <= 2 * radius; ++dy) near_any |= near_in_row[i + dy * kTileWidth];
        given.mask[int64_t{y} * c.stride + x] = usable_here[i] != 0 && near_any == 0 ? 255 : 0;
    }
}

class Rectify final : public Stage {
  public:
    explicit Rectify(const defrec_rectify_params& params) : p_(params) {}

    bool reentrant() const override { return true; }
    void record(Recorder& recorder, std::span<const InBuffer> in,
                std::span<const OutBuffer> out) override {
        const RectifyBuffers given = rectify_buffers(p_, in, out);
        const uint32_t radius = p_.highlight_radius, rim_height = kTileHeight + 2 * radius;
        const size_t shared = rim_height * (kTileWidth + 2 * radius) + rim_height * kTileWidth +
                              kTileHeight * kTileWidth;
        recorder.launch(kernel(),
                        {dim3(cover(p_.width, kTileWidth), cover(p_.height, kTileHeight)),
                         dim3(kThreads), shared},
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
