// Stage align, sections 5 and 6: Gauss-Newton on the shift of the live image. A lane has some rows
// of one of the patch's columns.
#pragma once
#include "backends/cuda/align_window.cuh"

namespace defrec::cuda {
namespace {

// A pixel of the patch: its row from the centre, template and its gradient; 0 where it takes no
// part.
struct PatchPixel {
    int32_t y, t, gx, gy, taken;
};

__device__ uint32_t pack(int32_t low, int32_t high) {
    return (static_cast<uint32_t>(low) & 0xffff) | (static_cast<uint32_t>(high) << 16);
}

template <int kRadius>
class Refinement {
    using L = Layout<kRadius>;

  public:
    // pixel: of the window, the patch's centre.
    __device__ Refinement(const Window<kRadius>& window, const Template<kRadius>& patch, int2 pixel)
        : window_(window) {
        const int32_t lane = static_cast<int32_t>(threadIdx.x), column = lane % L::kSide;
        const bool idle = lane >= L::kGroups * L::kSide;
        const int32_t row = idle ? 0 : lane / L::kSide * L::kRows;
        first_ = make_int2(pixel.x - kRadius + column + kLeadingBytes, pixel.y - kRadius + row);
        x_ = column - kRadius;
        for (int k = 0; k < L::kRows; ++k) {
            pixels_[k] = {};
            if (idle || row + k >= L::kSide || !usable_at(first_.x, first_.y + k)) continue;
            const int32_t y = row + k;
            pixels_[k] = {y - kRadius, patch.at(column, y) - patch.mean,
                          (patch.at(column + 1, y) - patch.at(column - 1, y) + 1) >> 1,
                          (patch.at(column, y + 1) - patch.at(column, y - 1) + 1) >> 1, 1};
        }
    }

    __device__ TemplateSums template_sums() const {
        TemplateSums s;
        for (const PatchPixel& p : pixels_) {
            s.n += p.taken;
            s.y += p.y;
            s.yy += p.y * p.y;
            s.t += p.t;
            s.gx += p.gx;
            s.gy += p.gy;
            s.yt += p.y * p.t;
            s.ygx += p.y * p.gx;
            s.ygy += p.y * p.gy;
            s.tt += p.t * p.t;
            s.gxx += p.gx * p.gx;
            s.gxy += p.gx * p.gy;
            s.gyy += p.gy * p.gy;
            s.gxt += p.gx * p.t;
            s.gyt += p.gy * p.t;
        }
        s.x = x_ * s.n;
        s.xx = x_ * s.x;
        s.xy = x_ * s.y;
        s.xt = x_ * s.t;
        s.xgx = x_ * s.gx;
        s.xgy = x_ * s.gy;
        for (int32_t* sum :
             {&s.n,   &s.x,   &s.y,   &s.xx,  &s.xy, &s.yy,  &s.t,   &s.gx,  &s.gy,  &s.xt, &s.yt,
              &s.xgx, &s.ygx, &s.xgy, &s.ygy, &s.tt, &s.gxx, &s.gxy, &s.gyy, &s.gxt, &s.gyt})
            *sum = sum_of_warp(*sum);
        return s;
    }

    // Sums of the live image shifted by `shift`.
    __device__ LiveSums live_sums(int2 shift) const {
        int32_t wx[4], wy[4], rows[L::kRows + 3];
        cubic_weights(shift.x & 255, wx);
        cubic_weights(shift.y & 255, wy);
        const int32_t left = static_cast<int32_t>(pack(wx[0], wx[1])),
                      right = static_cast<int32_t>(pack(wx[2], wx[3]));
        const int32_t byte = first_.x - 1 + (shift.x >> 8), top = first_.y - 1 + (shift.y >> 8);
        const uint32_t* word = window_.live + top * window_.size.words + (byte >> 2);
        for (int k = 0; k < L::kRows + 3; ++k, word += window_.size.words) {
            // Less 128, so that bytes have a sign; the weights add up to 256.
            const uint32_t four =
                __funnelshift_r(word[0], word[1], 8 * static_cast<uint32_t>(byte & 3)) ^
                0x80808080u;
            const int32_t pixels = static_cast<int32_t>(four);
            rows[k] = __dp2a_lo(left, pixels, __dp2a_hi(right, pixels, 128 * 256 + 8)) >> 4;
        }
        LiveSums s;
        for (int k = 0; k < L::kRows; ++k) {
            const PatchPixel& p = pixels_[k];
            const int32_t sum =
                wy[0] * rows[k] + wy[1] * rows[k + 1] + wy[2] * rows[k + 2] + wy[3] * rows[k + 3];
            const int32_t i = p.taken * ((sum + 512) >> 10);
            s.i += i;
            s.yi += p.y * i;
            s.ii += i * i;
            s.it += i * p.t;
            s.igx += i * p.gx;
            s.igy += i * p.gy;
        }
        return {sum_of_warp(s.i),  sum_of_warp(x_ * s.i), sum_of_warp(s.yi), sum_of_warp(s.ii),
                sum_of_warp(s.it), sum_of_warp(s.igx),    sum_of_warp(s.igy)};
    }

  private:
    __device__ bool usable_at(int32_t byte, int32_t row) const {
        return !window_.masked ||
               ((window_.usable[row * window_.size.words + (byte >> 2)] >> (8 * (byte & 3))) & 1) !=
                   0;
    }

    const Window<kRadius>& window_;
    int2 first_;  // byte and row of the window
    int32_t x_;   // of the column, from the patch's centre
    PatchPixel pixels_[L::kRows];
};

// Where the patch lies, found at a pixel of the level, which is that pixel of the window. fraction:
// of the predicted centre.
template <int kRadius>
__device__ defrec_patch_observation refine(const defrec_align_params& params,
                                           const Window<kRadius>& window,
                                           const Template<kRadius>& patch, int2 pixel,
                                           int2 window_pixel, int2 fraction) {
    const Refinement<kRadius> refinement(window, patch, window_pixel);
    const TemplateSums sums = refinement.template_sums();
    const LightFits fits = make_light_fits(sums, __frcp_rn(static_cast<float>(sums.n)));
    ShiftSystem system;
    int2 shift = make_int2(0, 0);
    int32_t score = 0;
    for (int32_t k = 0; k < kShiftSteps; ++k) {
        const LiveSums live = refinement.live_sums(shift);
        const ShiftStep step =
            k == 0 ? first_shift_step(sums, fits, live, system) : shift_step(system, live);
        if (!step.valid) return {};
        score = step.score;
        shift = make_int2(shift.x + step.x, shift.y + step.y);
        if (shift.x < -kPatchOne || shift.y < -kPatchOne || shift.x >= kPatchOne ||
            shift.y >= kPatchOne)
            return {};
        if (step.is_short()) break;
    }
    if (score >> kScoreShift < static_cast<int32_t>(params.min_score)) return {};
    defrec_patch_observation out{};
    out.u = from_level(kPatchOne * pixel.x + fraction.x + shift.x, params.level);
    out.v = from_level(kPatchOne * pixel.y + fraction.y + shift.y, params.level);
    out.score = score >> kScoreShift;
    out.valid = 1;
    information(system, Layout<kRadius>::kPixels, score, params.level, out.information);
    return out;
}

}  // namespace
}  // namespace defrec::cuda
