// The kernels of stage stereo, as the stage records them one after the other.
// docs/stages/stereo.md; the numbers are its sections.
#pragma once
#include "backends/cuda/device/recorder.hpp"
#include "backends/stages/stereo.hpp"

namespace defrec::cuda {

constexpr int kBandRows = 4;  // of a half image, in one word of `words`

// Sizes in pixels. Rows of the caller's images are `stride` apart; rows of our own images are
// `full_stride` and `half_stride` apart, multiples of 16. Fields of samples have no gaps, nor has
// what the caller gets of the sub-stages.
struct StereoShape : StereoConstants {
    int full_stride, half_stride;
};
// Gray images of ours have more between their rows, for pixels that repeat a row's first and last:
// four before it, and at least six after.
constexpr int kGrayMargin = 16;
constexpr int gray_stride(int stride) { return stride + 2 * kGrayMargin; }

// The field of half resolution and its coarser ones, down to one sample, one after the other in one
// buffer.
struct DisparityPyramid {
    static constexpr int kMaxLevels = 13;  // one more than a quarter of 8192 px takes
    struct Level {
        int width, height, offset;
    };
    Level levels[kMaxLevels];
    int count;
    int16_t* data;
};
// Those that the kernel before the filling makes: level 4 at most.
constexpr int kTiledLevels = 4;
constexpr int top_level(const DisparityPyramid& pyramid) {
    return pyramid.count > kTiledLevels ? kTiledLevels : pyramid.count - 1;
}

// 1, 2
struct PreparedImage {
    const uint8_t *source, *mask;  // mask: nullptr if all is usable
    uint8_t *gray, *half;          // their first pixels; with margins
    uint8_t* half_mask;            // even rows
    uint32_t*
        words;  // the half image, less 128: at (x, q) the rows 4 q to 4 q + 3; 0 below the image
    uint8_t* given;  // gray without gaps, or nullptr
};
struct PrepareStep {
    StereoShape shape;
    PreparedImage images[2];
    int32_t* right_keys;  // cleared for the search
    bool words_aligned;   // rows of the sources and masks begin at multiples of 4 bytes
};
void record_prepare(Recorder& recorder, const PrepareStep& step);

// 3, and what section 4 asks of the left pixel alone
struct SearchStep {
    StereoShape shape;
    const uint32_t *left, *right;  // words
    uint16_t* candidates;  // 1 + index of the winner, 0 for none; written where a window and a
                           // disparity fit
    int32_t* right_keys;
    int32_t* left_keys;  // or nullptr; written where candidates are
};
void record_search(Recorder& recorder, const SearchStep& step);

// 4, 5, and 6 up to the pyramid with its holes
struct AgreeStep {
    StereoShape shape;
    const uint16_t* candidates;
    const int32_t* right_keys;
    const uint8_t *left_mask, *right_mask;  // even rows of half resolution
    int16_t* checked;                       // or nullptr
    int16_t* supported;
    DisparityPyramid pyramid;
};
void record_agree(Recorder& recorder, const AgreeStep& step);

// 6 to 8 at half resolution, but for the smoothing of what is refined
struct DenseStep {
    StereoShape shape;
    DisparityPyramid pyramid;
    const uint8_t *left, *right;  // the half images
    const int16_t* supported;
    int16_t* dense;  // or nullptr
    uint8_t* standing;
    int16_t* refined;
};
void record_dense(Recorder& recorder, const DenseStep& step);

// What is found at a sample of full resolution, in a word: its hypothesis; the confidence; and the
// disparity as its difference to the hypothesis, which is at most 16 either way, plus 17. The last
// two are 0 for none.
struct Found {
    int hypothesis, confidence, difference;
};
constexpr uint32_t pack_found(const Found& found) {
    return (static_cast<uint32_t>(found.hypothesis) & 0xffff) |
           static_cast<uint32_t>(found.confidence) << 16 |
           static_cast<uint32_t>(found.difference) << 24;
}
constexpr Found unpack_found(uint32_t word) {
    return {static_cast<int16_t>(word & 0xffff), static_cast<int>(word >> 16 & 0xff),
            static_cast<int>(word >> 24)};
}
constexpr int kNoDifference = 17;

// The end of 8 at half resolution, and 8 to 10 at full, up to the speckles
struct RefineStep {
    StereoShape shape;
    const uint8_t *left, *right;            // the inpainted images
    const uint8_t *left_mask, *right_mask;  // the caller's, or nullptr
    const int16_t* half;                    // refined, not smoothed
    const uint8_t* standing;
    uint32_t* found;
    int16_t *given_half, *given_hypothesis, *given_refined, *given_score;  // or nullptr
};
void record_refine(Recorder& recorder, const RefineStep& step);

// The end of 10, and 11 to 13
struct FinishStep {
    StereoShape shape;
    const uint32_t* found;
    int16_t* fields[2];                      // of samples; written if there are many passes
    int16_t *given_evidence, *given_filled;  // or nullptr
    int16_t* disparity;                      // the caller's image
    uint8_t* confidence;                     // likewise, or nullptr
    bool pairs_aligned;                      // pairs of both begin at multiples of their size
};
void record_finish(Recorder& recorder, const FinishStep& step);

}  // namespace defrec::cuda
