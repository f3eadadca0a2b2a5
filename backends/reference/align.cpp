// Guided patch search: where pieces of the template's images lie in the live image, to a fraction
// of a pixel. Definition: docs/stages/align.md.
#include "backends/stages/align.hpp"

#include <algorithm>
#include <vector>

#include "backends/definition/align_math.hpp"
#include "backends/reference/stages.hpp"
#include "backends/shared/align_view.hpp"

namespace defrec::reference {
namespace {
using namespace align;

struct Image {
    int32_t width = 0, height = 0;
    std::vector<uint8_t> pixels;
    const uint8_t& at(int32_t x, int32_t y) const {
        return pixels[size_t(y) * size_t(width) + size_t(x)];
    }
    uint8_t& at(int32_t x, int32_t y) { return pixels[size_t(y) * size_t(width) + size_t(x)]; }
};

Image copy_image(const uint8_t* pixels, const defrec_align_params& params) {
    Image out{int32_t(params.width), int32_t(params.height), {}};
    for (uint32_t y = 0; y < params.height; ++y)
        out.pixels.insert(out.pixels.end(), pixels + size_t(y) * params.stride,
                          pixels + size_t(y) * params.stride + params.width);
    return out;
}

// combine(a, b, c, d) of each 2x2 block.
template <class Combine>
Image halve(const Image& in, Combine combine) {
    Image out{in.width / 2, in.height / 2,
              std::vector<uint8_t>(size_t(in.width / 2) * size_t(in.height / 2))};
    for (int32_t y = 0; y < out.height; ++y)
        for (int32_t x = 0; x < out.width; ++x)
            out.at(x, y) = uint8_t(combine(in.at(2 * x, 2 * y), in.at(2 * x + 1, 2 * y),
                                           in.at(2 * x, 2 * y + 1), in.at(2 * x + 1, 2 * y + 1)));
    return out;
}
Image gray_level(Image image, uint32_t level) {
    for (uint32_t l = 0; l < level; ++l)
        image = halve(image, [](int a, int b, int c, int d) { return (a + b + c + d + 2) >> 2; });
    return image;
}
Image mask_level(Image image, uint32_t level) {
    for (uint8_t& usable : image.pixels) usable = usable != 0;
    for (uint32_t l = 0; l < level; ++l)
        image = halve(image, [](int a, int b, int c, int d) { return a & b & c & d; });
    return image;
}

Image doubled(const Image& in) {
    Image out{2 * in.width, 2 * in.height, std::vector<uint8_t>(4 * in.pixels.size())};
    double_size(in.pixels.data(), in.width, in.height, size_t(in.width), out.pixels.data());
    return out;
}

// A patch sampled from its view with one pixel more on every side, 1/16 gray level, less its
// rounded mean.
class Sampled {
  public:
    explicit Sampled(int32_t radius)
        : radius_(radius), values_(size_t((2 * radius + 3) * (2 * radius + 3))) {}
    int32_t& at(int32_t x, int32_t y) {
        return values_[size_t((y + radius_ + 1) * (2 * radius_ + 3) + x + radius_ + 1)];
    }
    int32_t at(int32_t x, int32_t y) const { return const_cast<Sampled*>(this)->at(x, y); }
    int32_t gradient_x(int32_t x, int32_t y) const {
        return (at(x + 1, y) - at(x - 1, y) + 1) >> 1;
    }
    int32_t gradient_y(int32_t x, int32_t y) const {
        return (at(x, y + 1) - at(x, y - 1) + 1) >> 1;
    }

  private:
    int32_t radius_;
    std::vector<int32_t> values_;
};

class Align final : public Stage {
  public:
    explicit Align(const defrec_align_params& params) : params_(bounded(params)) {
        check_params(params);
        for (uint32_t n = 1; n <= pixels(); ++n) {
            inverse_.push_back(1.0f / float(n));
            root_.push_back(std::sqrt(float(n)));
        }
    }

    void prepare(std::span<const InBuffer> in) override {
        const AlignTemplate given = read_template(params_, in);
        patches_.assign(given.patches.begin(), given.patches.end());
        slopes_ = given.slopes;
        views_.clear();
        for (uint32_t i = 0; i < params_.views; ++i)
            views_.push_back(doubled(gray_level(
                copy_image(given.views + view_offset(params_, i), params_), params_.level)));
        prepared_ = true;
    }

    void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        if (!prepared_) throw StageError(DEFREC_ERROR_STATE, "align: run before prepare");
        const AlignBuffers buffers = align_buffers(params_, patches_.size(), in, out);
        live_ = gray_level(copy_image(buffers.gray, params_), params_.level);
        mask_ = buffers.mask != nullptr
                    ? mask_level(copy_image(buffers.mask, params_), params_.level)
                    : Image{};
        for (size_t i = 0; i < patches_.size(); ++i) {
            const defrec_patch_prediction prediction =
                buffers.given != nullptr
                    ? buffers.given[i]
                    : predict<double>(patches_[i], slopes_[i], buffers.motions, params_);
            buffers.observations[i] = observe(patches_[i], prediction);
            if (buffers.predictions != nullptr) buffers.predictions[i] = prediction;
        }
    }

  private:
    int32_t radius() const { return int32_t(params_.patch_radius); }
    uint32_t pixels() const {
        return (2 * params_.patch_radius + 1) * (2 * params_.patch_radius + 1);
    }

    // fraction: of the patch's centre in the live image, 1/256 px. False where the patch leaves its
    // view or has no texture.
    bool sample(const defrec_patch& patch, const int32_t matrix[4], int32_t fraction_x,
                int32_t fraction_y, Sampled& out) const {
        const Image& view = views_[size_t(patch.view)];
        int32_t centre_x = 0, centre_y = 0;
        if (!to_fixed(patch.u, centre_x) || !to_fixed(patch.v, centre_y)) return false;
        centre_x = to_level(centre_x, params_.level);
        centre_y = to_level(centre_y, params_.level);
        const int32_t r = radius();
        int32_t sum = 0;
        for (int32_t oy = -r - 1; oy <= r + 1; ++oy)
            for (int32_t ox = -r - 1; ox <= r + 1; ++ox) {
                const int32_t dx = kPatchOne * ox - fraction_x, dy = kPatchOne * oy - fraction_y;
                const int32_t x = 256 * centre_x + ((matrix[0] * dx + matrix[1] * dy + 128) >> 8);
                const int32_t y = 256 * centre_y + ((matrix[2] * dx + matrix[3] * dy + 128) >> 8);
                const int32_t x0 = x >> 15, y0 = y >> 15, fx = (x >> 7) & 255, fy = (y >> 7) & 255;
                if (x0 < 0 || y0 < 0 || x0 + 1 >= view.width || y0 + 1 >= view.height) return false;
                const int32_t top = view.at(x0, y0) * (256 - fx) + view.at(x0 + 1, y0) * fx;
                const int32_t bottom =
                    view.at(x0, y0 + 1) * (256 - fx) + view.at(x0 + 1, y0 + 1) * fx;
                out.at(ox, oy) = (top * (256 - fy) + bottom * fy + 2048) >> 12;
                if (inner(ox, oy)) sum += out.at(ox, oy);
            }
        const int32_t n = int32_t(pixels()), mean = (2 * sum + n) / (2 * n);
        int64_t squares = 0, rest = 0;
        for (int32_t oy = -r - 1; oy <= r + 1; ++oy)
            for (int32_t ox = -r - 1; ox <= r + 1; ++ox) {
                const int32_t value = out.at(ox, oy) -= mean;
                if (!inner(ox, oy)) continue;
                rest += value;
                squares += value * value;
            }
        return n * squares - rest * rest >= int64_t(n) * n * params_.texture * params_.texture;
    }
    bool inner(int32_t x, int32_t y) const {
        return std::max(std::abs(x), std::abs(y)) <= radius();
    }

    // ZNCC of the sampled patch with the live window round (x, y), 1/65536, over the usable pixels.
    int32_t score(const Sampled& patch, int32_t x, int32_t y) const {
        const int32_t r = radius();
        if (x < r || y < r || x + r >= live_.width || y + r >= live_.height) return kUnscored;
        int32_t n = 0, t = 0, tt = 0, i = 0, ii = 0, ti = 0;
        for (int32_t oy = -r; oy <= r; ++oy)
            for (int32_t ox = -r; ox <= r; ++ox) {
                if (!usable_at(x + ox, y + oy)) continue;
                const int32_t gray = live_.at(x + ox, y + oy), value = patch.at(ox, oy);
                n += 1;
                t += value;
                tt += value * value;
                i += gray;
                ii += gray * gray;
                ti += value * gray;
            }
        // Modulo 2^32: the products may be larger, the difference is not.
        const int32_t live_variance =
            int32_t(uint32_t(n) * uint32_t(ii) - uint32_t(i) * uint32_t(i));
        if (4 * n < kMinUsableQuarters * int32_t(pixels()) || live_variance < 1) return kUnscored;
        const float inverse = inverse_[size_t(n - 1)];
        const float patch_variance = float(tt) - (float(t) * float(t)) * inverse;
        if (!(patch_variance >= 1.0f)) return kUnscored;
        const float covariance = float(ti) - (float(t) * float(i)) * inverse;
        const float z = ((covariance * reciprocal_sqrt(patch_variance)) *
                         reciprocal_sqrt(float(live_variance))) *
                        root_[size_t(n - 1)];
        return int32_t(std::floor(z * float(kOneScore) + 0.5f));
    }

    bool usable_at(int32_t x, int32_t y) const {
        return mask_.pixels.empty() || mask_.at(x, y) != 0;
    }

    defrec_patch_observation observe(const defrec_patch& patch,
                                     const defrec_patch_prediction& prediction) const {
        if (!usable(prediction, params_)) return {};
        const int32_t u = to_level(prediction.u, params_.level),
                      v = to_level(prediction.v, params_.level);
        int32_t x = (u + 128) >> 8, y = (v + 128) >> 8;
        const int32_t fraction_x = u - kPatchOne * x, fraction_y = v - kPatchOne * y;
        Sampled sampled(radius());
        if (!sample(patch, prediction.view_from_live, fraction_x, fraction_y, sampled)) return {};
        const int32_t q = params_.keep_predicted != 0 ? score(sampled, x, y) : kUnscored;
        if (search(sampled, x, y)) {
            const auto found = refine(sampled, x, y, fraction_x, fraction_y);
            if (found.valid != 0) return found;
        }
        return predicted_observation(prediction, q, params_);
    }

    // The best displacement among some from the pixel (x, y).
    struct Best {
        int32_t x = 0, y = 0, rank = kUnscored;
    };
    void compare(const Sampled& sampled, int32_t x, int32_t y, int32_t dx, int32_t dy,
                 Best& best) const {
        const int32_t q = score(sampled, x + dx, y + dy);
        if (q == kUnscored) return;
        const int32_t rank = q - kDistancePenalty * (dx * dx + dy * dy);
        if (rank > best.rank) best = {dx, dy, rank};
    }

    // Moves (x, y) to the best displacement within the search radius; false if it lies at the
    // border.
    bool search(const Sampled& sampled, int32_t& x, int32_t& y) const {
        const int32_t s = int32_t(params_.search_radius);
        Best coarse, fine;
        for (int32_t dy = -s; dy <= s; ++dy)
            for (int32_t dx = -s; dx <= s; ++dx)
                if ((dx + dy) % 2 == 0 && (dx % 2 == 0 || s > kEvenSearch))
                    compare(sampled, x, y, dx, dy, coarse);
        if (coarse.rank == kUnscored) return false;
        for (int32_t dy = std::max(-s, coarse.y - 1); dy <= std::min(s, coarse.y + 1); ++dy)
            for (int32_t dx = std::max(-s, coarse.x - 1); dx <= std::min(s, coarse.x + 1); ++dx)
                compare(sampled, x, y, dx, dy, fine);
        x += fine.x;
        y += fine.y;
        return std::abs(fine.x) < s && std::abs(fine.y) < s;
    }

    // Gauss-Newton on the shift of the live image, starting from the pixel (x, y).
    defrec_patch_observation refine(const Sampled& sampled, int32_t x, int32_t y,
                                    int32_t fraction_x, int32_t fraction_y) const {
        defrec_patch_observation out{};
        const int32_t r = radius();
        if (x < r + 2 || y < r + 2 || x + r + 2 >= live_.width || y + r + 2 >= live_.height)
            return out;
        const TemplateSums sums = template_sums(sampled, x, y);
        const LightFits fits = make_light_fits(sums, inverse_[size_t(sums.n - 1)]);
        ShiftSystem system{};
        int32_t shift_x = 0, shift_y = 0, score = 0;
        for (int32_t k = 0; k < kShiftSteps; ++k) {
            const LiveSums live = live_sums(sampled, x, y, shift_x, shift_y);
            const ShiftStep step =
                k == 0 ? first_shift_step(sums, fits, live, system) : shift_step(system, live);
            if (!step.valid) return out;
            shift_x += step.x;
            shift_y += step.y;
            score = step.score;
            if (shift_x < -kPatchOne || shift_y < -kPatchOne || shift_x >= kPatchOne ||
                shift_y >= kPatchOne)
                return out;
            if (step.is_short()) break;
        }
        out.score = score >> kScoreShift;
        if (out.score < int32_t(params_.min_score)) return {};
        out.u = from_level(kPatchOne * x + fraction_x + shift_x, params_.level);
        out.v = from_level(kPatchOne * y + fraction_y + shift_y, params_.level);
        out.valid = 1;
        information(system, pixels(), score, params_.level, out.information);
        return out;
    }

    TemplateSums template_sums(const Sampled& sampled, int32_t x, int32_t y) const {
        TemplateSums s;
        for (int32_t oy = -radius(); oy <= radius(); ++oy)
            for (int32_t ox = -radius(); ox <= radius(); ++ox) {
                if (!usable_at(x + ox, y + oy)) continue;
                const int32_t t = sampled.at(ox, oy), gx = sampled.gradient_x(ox, oy),
                              gy = sampled.gradient_y(ox, oy);
                s.n += 1;
                s.x += ox;
                s.y += oy;
                s.xx += ox * ox;
                s.xy += ox * oy;
                s.yy += oy * oy;
                s.t += t;
                s.xt += ox * t;
                s.yt += oy * t;
                s.xgx += ox * gx;
                s.ygx += oy * gx;
                s.xgy += ox * gy;
                s.ygy += oy * gy;
                s.tt += t * t;
                s.gx += gx;
                s.gy += gy;
                s.gxx += gx * gx;
                s.gxy += gx * gy;
                s.gyy += gy * gy;
                s.gxt += gx * t;
                s.gyt += gy * t;
            }
        return s;
    }

    LiveSums live_sums(const Sampled& sampled, int32_t x, int32_t y, int32_t shift_x,
                       int32_t shift_y) const {
        LiveSums s;
        for (int32_t oy = -radius(); oy <= radius(); ++oy)
            for (int32_t ox = -radius(); ox <= radius(); ++ox) {
                if (!usable_at(x + ox, y + oy)) continue;
                const int32_t i = shifted(x + ox, y + oy, shift_x, shift_y);
                s.i += i;
                s.xi += ox * i;
                s.yi += oy * i;
                s.ii += i * i;
                s.it += i * sampled.at(ox, oy);
                s.igx += i * sampled.gradient_x(ox, oy);
                s.igy += i * sampled.gradient_y(ox, oy);
            }
        return s;
    }

    // The live image at a pixel plus a shift in 1/256 px, cubic along rows and then along columns,
    // 1/4 gray level.
    int32_t shifted(int32_t x, int32_t y, int32_t shift_x, int32_t shift_y) const {
        x += shift_x >> 8;
        y += shift_y >> 8;
        int32_t wx[4], wy[4], sum = 0;
        cubic_weights(shift_x & 255, wx);
        cubic_weights(shift_y & 255, wy);
        for (int32_t j = 0; j < 4; ++j) {
            int32_t row = 0;
            for (int32_t k = 0; k < 4; ++k) row += wx[k] * live_.at(x + k - 1, y + j - 1);
            sum += wy[j] * ((row + 8) >> 4);
        }
        return (sum + 512) >> 10;
    }

    defrec_align_params params_;
    std::vector<float> inverse_, root_;  // 1 / n and sqrt(n), at n - 1
    std::vector<defrec_patch> patches_;
    std::vector<defrec_patch_slope> slopes_;
    std::vector<Image> views_;
    Image live_, mask_;
    bool prepared_ = false;
};

}  // namespace

std::unique_ptr<Stage> make_align(const defrec_align_params& params, const Host&) {
    return std::make_unique<Align>(params);
}

}  // namespace defrec::reference
