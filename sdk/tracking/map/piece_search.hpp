// Where a piece of the surface went that was not found near where it was expected.
#pragma once
#include <span>

#include "sdk/template/template.hpp"

namespace defrec {

// Fits the control points of a piece to its landmarks' matches, of which most may be wrong.
// matches: one per landmark, with live positions where depth is known, whatever their weights.
// motions: of all control points; those of the piece are set. Where too few matches agree on a
// rigid motion they are left as they are, and it gives false.
bool search_piece(const TemplateData& data, size_t piece, std::span<const defrec_match> matches,
                  std::span<defrec_motion> motions);
// The same of a part of a piece. is_searched: 1 for its control points; those beyond its end are
// not.
bool search_nodes(const TemplateData& data, std::span<const uint8_t> is_searched,
                  std::span<const defrec_match> matches, std::span<defrec_motion> motions);

}  // namespace defrec
