// Stage rectify on the CPU: bands of rows over the host's threads. docs/stages/rectify.md.
#include "backends/stages/rectify.hpp"

#include <algorithm>
#include <cstring>

#include "backends/cpu/host_block.hpp"
#include "backends/cpu/rectify_rows.hpp"
#include "backends/cpu/stages.hpp"

namespace defrec::cpu {
namespace {

constexpr uint32_t kBand = 32;  // rows one task works on

class Rectify final : public Stage {
  public:
    Rectify(const defrec_rectify_params& params, const Host& host)
        : p_(params),
          host_(host),
          padded_stride_(params.source_width + 1),
          gray_(host, padded_size()),
          ignore_(host, padded_size()),
          brightest_(params.height, HostAllocator<uint8_t>(host)) {}

    void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        const RectifyBuffers b = rectify_buffers(p_, in, out);
        if (b.map != nullptr) bands(p_.source_height, [&](uint32_t y) { pad_source_row(b, y); });
        bands(p_.height, [&](uint32_t y) { result_row(b, y); });
        if (p_.saturation <= 255) bands(p_.height, [&](uint32_t y) { mask_highlights(b, y); });
    }

  private:
    size_t padded_size() const {
        return (size_t{p_.source_width} + 1) * (p_.source_height + 1) + 4;
    }

    template <class Row>
    void bands(uint32_t rows, Row&& row) const {
        host_.parallel_for((rows + kBand - 1) / kBand, [&](size_t band) {
            const uint32_t end = std::min(rows, uint32_t(band + 1) * kBand);
            for (uint32_t y = uint32_t(band) * kBand; y < end; ++y) row(y);
        });
    }

    void pad_source_row(const RectifyBuffers& b, uint32_t y) {
        const size_t w = p_.source_width;
        const auto repeat_last = [&](uint8_t* row) {
            row[w] = row[w - 1];
            if (y + 1 == p_.source_height) std::memcpy(row + padded_stride_, row, w + 1);
        };
        uint8_t* gray = gray_.data() + y * padded_stride_;
        gray_row(p_.format, b.source + size_t(y) * p_.source_stride, gray, w);
        repeat_last(gray);
        if (b.ignore == nullptr) return;
        uint8_t* ignore = ignore_.data() + y * padded_stride_;
        std::memcpy(ignore, b.ignore + y * w, w);
        repeat_last(ignore);
    }

    void result_row(const RectifyBuffers& b, uint32_t y) {
        const size_t w = p_.width;
        uint8_t* gray = b.gray + size_t(y) * p_.stride;
        uint8_t* mask = b.mask + size_t(y) * p_.stride;
        if (b.map != nullptr) {
            const int32_t stride = int32_t(padded_stride_);
            const PaddedSource source{
                .gray = {gray_.data(), stride},
                .ignore = {b.ignore != nullptr ? ignore_.data() : nullptr, stride},
                .width = int32_t(p_.source_width),
                .height = int32_t(p_.source_height)};
            sample_row(source, b.map + 2 * w * y, gray, mask, w);
        } else {
            gray_row(p_.format, b.source + size_t(y) * p_.source_stride, gray, w);
            if (b.ignore != nullptr)
                ignore_row(b.ignore + w * y, mask, w);
            else
                std::memset(mask, 255, w);
        }
        brightest_[y] = row_maximum(gray, w);
    }

    void mask_highlights(const RectifyBuffers& b, uint32_t y) {
        const uint32_t r = p_.highlight_radius;
        const uint8_t* rows[2 * kRectifyMaxHighlightRadius + 1];
        size_t count = 0;
        for (uint32_t v = y < r ? 0 : y - r; v <= std::min(p_.height - 1, y + r); ++v)
            if (brightest_[v] >= p_.saturation) rows[count++] = b.gray + size_t(v) * p_.stride;
        if (count == 0) return;
        uint8_t scratch[DEFREC_MAX_SIDE + 2 * kRectifyMaxHighlightRadius + 64];
        clear_near_highlights(rows, count, p_.width, int(r), uint8_t(p_.saturation), scratch,
                              b.mask + size_t(y) * p_.stride);
    }

    defrec_rectify_params p_;
    Host host_;
    size_t padded_stride_;
    HostBlock<uint8_t> gray_, ignore_;  // the source, padded for sampling
    HostVector<uint8_t> brightest_;     // largest gray value of each result row
};

}  // namespace

std::unique_ptr<Stage> make_rectify(const defrec_rectify_params& params, const Host& host) {
    check_params(params);
    return std::make_unique<Rectify>(params, host);
}

}  // namespace defrec::cpu
