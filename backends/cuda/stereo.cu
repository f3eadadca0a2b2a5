// Stage stereo: half resolution from the images to a refined field, then full resolution from the
// hypothesis to the result. docs/stages/stereo.md. Six kernels, one after the other; large images
// and many passes of smoothing take one more each.
#include <bit>

#include "backends/cuda/stages.hpp"
#include "backends/cuda/stereo_steps.hpp"

namespace defrec::cuda {
namespace {

int padded(int count) { return (count + 15) / 16 * 16; }

StereoShape shape_of(const StereoConstants& constants) {
    return {constants, padded(constants.width), padded(constants.half_width)};
}

uint64_t area(int stride, int height) {
    return static_cast<uint64_t>(stride) * static_cast<uint64_t>(height);
}

// Without memory.
DisparityPyramid pyramid_of(const StereoConstants& size) {
    DisparityPyramid pyramid{};
    int width = size.half_samples_x, height = size.half_samples_y, offset = 0;
    for (;; width = (width + 1) / 2, height = (height + 1) / 2) {
        pyramid.levels[pyramid.count++] = {width, height, offset};
        offset += width * height;
        if (width == 1 && height == 1) return pyramid;
    }
}

// One of the two images with what is made of it before the search.
struct Image {
    Image(Device& device, const StereoShape& shape)
        : half_mask(device, area(shape.half_stride, shape.half_samples_y)),
          words(make_buffer<uint32_t>(
              device, area(shape.half_stride, (shape.half_height + kBandRows - 1) / kBandRows))),
          gray_(device, area(gray_stride(shape.full_stride), shape.height)),
          half_(device, area(gray_stride(shape.half_stride), shape.half_height)) {}
    PreparedImage prepared(const uint8_t* source, const uint8_t* mask, uint8_t* given) const {
        return {source, mask, gray(), half(), half_mask.as<uint8_t>(), words.as<uint32_t>(), given};
    }
    uint8_t* gray() const { return gray_.as<uint8_t>() + kGrayMargin; }
    uint8_t* half() const { return half_.as<uint8_t>() + kGrayMargin; }
    Buffer half_mask, words;

  private:
    Buffer gray_, half_;
};

class Stereo final : public Stage {
  public:
    Stereo(const defrec_stereo_params& params, Device& device)
        : shape_(shape_of(constants_of(params))),
          pyramid_(pyramid_of(shape_)),
          left_(device, shape_),
          right_(device, shape_),
          candidates_(make_buffer<uint16_t>(device, shape_.half_samples())),
          right_keys_(make_buffer<int32_t>(device, shape_.right_winners())),
          supported_(make_buffer<int16_t>(device, shape_.half_samples())),
          fields_(make_buffer<int16_t>(
              device, static_cast<uint64_t>(pyramid_.levels[pyramid_.count - 1].offset) + 1)),
          standing_(device, shape_.half_samples()),
          half_refined_(make_buffer<int16_t>(device, shape_.half_samples())),
          found_(make_buffer<uint32_t>(device, shape_.samples())),
          smoothed_{make_buffer<int16_t>(device, shape_.samples()),
                    make_buffer<int16_t>(device, shape_.samples())} {
        pyramid_.data = fields_.as<int16_t>();
    }

    void record(Recorder& recorder, std::span<const InBuffer> in,
                std::span<const OutBuffer> out) override {
        const StereoBuffers given = view_buffers<StereoBuffers>(shape_, in, out);
        record_half(recorder, given);
        record_full(recorder, given);
    }

  private:
    // Half resolution, from the images to the refined field.
    void record_half(Recorder& recorder, const StereoBuffers& given) const {
        const auto own = [](auto* wanted, const Buffer& buffer) {
            return wanted != nullptr ? wanted
                                     : buffer.as<std::remove_pointer_t<decltype(wanted)>>();
        };
        int32_t* const right_keys = own(given.right_keys, right_keys_);
        int16_t* const supported = own(given.supported, supported_);

        // What the search leaves out has no winner.
        if (given.left_keys != nullptr)
            recorder.fill(given.left_keys, 0, shape_.half_samples() * sizeof(int32_t));
        record_prepare(
            recorder,
            {.shape = shape_,
             .images = {left_.prepared(given.left, given.left_mask, given.prepared_left),
                        right_.prepared(given.right, given.right_mask, given.prepared_right)},
             .right_keys = right_keys,
             .words_aligned = words_aligned(given)});
        record_search(recorder, {.shape = shape_,
                                 .left = left_.words.as<uint32_t>(),
                                 .right = right_.words.as<uint32_t>(),
                                 .candidates = candidates_.as<uint16_t>(),
                                 .right_keys = right_keys,
                                 .left_keys = given.left_keys});
        record_agree(recorder, {.shape = shape_,
                                .candidates = candidates_.as<uint16_t>(),
                                .right_keys = right_keys,
                                .left_mask = left_.half_mask.as<uint8_t>(),
                                .right_mask = right_.half_mask.as<uint8_t>(),
                                .checked = given.checked,
                                .supported = supported,
                                .pyramid = pyramid_});
        record_dense(recorder, {.shape = shape_,
                                .pyramid = pyramid_,
                                .left = left_.half(),
                                .right = right_.half(),
                                .supported = supported,
                                .dense = given.dense,
                                .standing = standing_.as<uint8_t>(),
                                .refined = half_refined_.as<int16_t>()});
    }

    // Full resolution, from the hypothesis to the result.
    void record_full(Recorder& recorder, const StereoBuffers& given) const {
        record_refine(recorder, {.shape = shape_,
                                 .left = left_.gray(),
                                 .right = right_.gray(),
                                 .left_mask = given.left_mask,
                                 .right_mask = given.right_mask,
                                 .half = half_refined_.as<int16_t>(),
                                 .standing = standing_.as<uint8_t>(),
                                 .found = found_.as<uint32_t>(),
                                 .given_half = given.half_refined,
                                 .given_hypothesis = given.hypothesis,
                                 .given_refined = given.refined,
                                 .given_score = given.score});
        record_finish(recorder,
                      {.shape = shape_,
                       .found = found_.as<uint32_t>(),
                       .fields = {smoothed_[0].as<int16_t>(), smoothed_[1].as<int16_t>()},
                       .given_evidence = given.evidence,
                       .given_filled = given.filled,
                       .disparity = given.disparity,
                       .confidence = given.confidence,
                       .pairs_aligned =
                           shape_.stride % 2 == 0 &&
                           std::bit_cast<uintptr_t>(given.disparity) % (2 * sizeof(int16_t)) == 0 &&
                           std::bit_cast<uintptr_t>(given.confidence) % 2 == 0});
    }

    bool words_aligned(const StereoBuffers& given) const {
        uintptr_t all = static_cast<uintptr_t>(shape_.stride);
        for (const uint8_t* image : {given.left, given.right, given.left_mask, given.right_mask})
            all |= std::bit_cast<uintptr_t>(image);
        return all % 4 == 0;
    }

    StereoShape shape_;
    DisparityPyramid pyramid_;
    Image left_, right_;
    Buffer candidates_, right_keys_, supported_, fields_, standing_, half_refined_, found_;
    Buffer smoothed_[2];
};

}  // namespace

std::unique_ptr<Stage> make_stereo(const defrec_stereo_params& params, Device& device) {
    check_params(params);
    return std::make_unique<Stereo>(params, device);
}

}  // namespace defrec::cuda
