// Which pieces of a surface a frame shows, each by its own evidence.
#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "sdk/base/util/ratio.hpp"
#include "sdk/template/decisions.hpp"
#include "sdk/tracking/decisions/states.hpp"
#include "sdk/tracking/monitors/frame_state.hpp"

namespace defrec {

struct PieceEvidence {
    uint32_t vertices = 0, vertices_inside = 0;  // the latter in the image
    uint32_t vertices_measured = 0;              // with live depth that agrees
    uint32_t patches_expected = 0, patches_confirmed = 0;

    // Enough of the piece lies in the image to be found there.
    bool is_expected() const {
        constexpr Ratio kShare = decisions::Pieces::kExpectedShare;
        return vertices_inside > 0 &&
               kShare.denominator * vertices_inside >= kShare.numerator * vertices;
    }
};
using PieceEvidences = std::array<PieceEvidence, decisions::TemplatePieces::kMaxPieces>;
// vertex_pieces: per vertex. whole, patch_px2: of the whole surface, and of measure_patches
// (frame_state.hpp).
PieceEvidences weigh_pieces(const TemplateData& data, std::span<const uint8_t> vertex_pieces,
                            const FrameOutput& output, const Evidence& whole,
                            std::span<const double> patch_px2);

// What becomes of a surface's pieces from frame to frame.
class PieceStates {
  public:
    // Begins with another template. are_found: in the frame before.
    void reset(size_t pieces, bool are_found);

    // Whether a frame that is found by all its evidence shows any piece. uses_depth: else it was
    // followed by the left image alone.
    bool shows_any(const PieceEvidences& evidence, bool uses_depth) const;
    // state: the frame's. A single piece has that, and in a frame that is lost all do.
    void end_frame(uint32_t state, const PieceEvidences& evidence, bool uses_depth);

    // observed_share is not known here.
    std::span<const defrec_piece> pieces() const { return {pieces_.data(), count_}; }
    // One was not found in the last frame, but another one was, and it is expected in the image.
    bool misses_one() const { return misses_one_; }

  private:
    bool is_found(size_t piece, const PieceEvidence& evidence, bool uses_depth) const;

    std::array<defrec_piece, decisions::TemplatePieces::kMaxPieces> pieces_{};
    size_t count_ = 0;
    bool misses_one_ = false;
};

}  // namespace defrec
