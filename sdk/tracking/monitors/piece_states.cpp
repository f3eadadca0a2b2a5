// See piece_states.hpp.
#include "sdk/tracking/monitors/piece_states.hpp"

namespace defrec {

PieceEvidences weigh_pieces(const TemplateData& data, std::span<const uint8_t> vertex_pieces,
                            const FrameOutput& output, const Evidence& whole,
                            std::span<const double> patch_px2) {
    PieceEvidences evidence{};
    if (data.pieces() == 1) {
        evidence[0] = {static_cast<uint32_t>(output.samples.size()), whole.vertices_inside,
                       whole.vertices_observed, whole.patches_expected, whole.patches_confirmed};
        return evidence;
    }
    // Long runs of vertices belong to one piece.
    for (size_t i = 0; i < output.samples.size();) {
        const size_t begin = i;
        const uint8_t piece = vertex_pieces[begin];
        uint32_t inside = 0, measured = 0;
        for (; i < output.samples.size() && vertex_pieces[i] == piece; ++i) {
            inside += output.samples[i].observation != DEFREC_OUTSIDE;
            measured += output.samples[i].observation == DEFREC_OBSERVED;
        }
        evidence[piece].vertices += static_cast<uint32_t>(i - begin);
        evidence[piece].vertices_inside += inside;
        evidence[piece].vertices_measured += measured;
    }
    for (size_t i = 0; i < patch_px2.size(); ++i) {
        PieceEvidence& piece = evidence[data.piece_of(data.patches[i])];
        piece.patches_expected += output.predictions[i].valid != 0;
        piece.patches_confirmed += is_confirmed(patch_px2[i]);
    }
    return evidence;
}

void PieceStates::reset(size_t pieces, bool are_found) {
    count_ = pieces;
    for (defrec_piece& piece : pieces_) {
        piece = {};
        piece.state = are_found ? DEFREC_TRACKING : DEFREC_LOST;
    }
    misses_one_ = false;
}

bool PieceStates::is_found(size_t piece, const PieceEvidence& evidence, bool uses_depth) const {
    const bool was_found = pieces_[piece].state != DEFREC_LOST;
    using decisions::Pieces;
    return evidence.patches_confirmed >= Pieces::kMinPatches.after(was_found) &&
           evidence.patches_confirmed >=
               Pieces::kMinPatchShare.after(was_found) * evidence.patches_expected &&
           (evidence.vertices_measured >=
                Pieces::kMinDepthShare.after(was_found) * evidence.vertices_inside ||
            !uses_depth);
}

bool PieceStates::shows_any(const PieceEvidences& evidence, bool uses_depth) const {
    if (count_ == 1) return true;
    for (size_t i = 0; i < count_; ++i)
        if (is_found(i, evidence[i], uses_depth)) return true;
    return false;
}

void PieceStates::end_frame(uint32_t state, const PieceEvidences& evidence, bool uses_depth) {
    misses_one_ = false;
    for (size_t i = 0; i < count_; ++i) {
        defrec_piece& piece = pieces_[i];
        uint32_t own = state;
        if (count_ > 1 && state != DEFREC_LOST) {
            const bool confirms_few =
                evidence[i].patches_confirmed <
                decisions::WideSearch::kFewConfirmed * evidence[i].patches_expected;
            own = !is_found(i, evidence[i], uses_depth) ? DEFREC_LOST
                  : piece.state == DEFREC_LOST          ? DEFREC_RELOCALISED
                  : confirms_few                        ? DEFREC_DEGRADED
                                                        : DEFREC_TRACKING;
            misses_one_ |= own == DEFREC_LOST && evidence[i].is_expected();
        }
        piece.age = own == DEFREC_LOST ? piece.age + 1 : 0;
        piece.state = own;
        piece.vertices_inside = evidence[i].vertices_inside;
        piece.patches = evidence[i].patches_confirmed;
    }
}

}  // namespace defrec
