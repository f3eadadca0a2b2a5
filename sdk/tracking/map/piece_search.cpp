// See piece_search.hpp.
#include "sdk/tracking/map/piece_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "backends/shared/motion.hpp"
#include "sdk/tracking/decisions/states.hpp"
#include "sdk/tracking/map/local_fit.hpp"

namespace defrec {
namespace {

using decisions::PieceSearch;
using Pair = PointPair;

double squared(const Vec3<double>& v) { return dot(v, v); }

template <class IsSearched>  // of a control point
std::vector<Pair> pairs_of(const TemplateData& data, std::span<const defrec_match> matches,
                           const IsSearched& is_searched) {
    std::vector<Pair> pairs;
    for (size_t i = 0; i < matches.size(); ++i)
        if (matches[i].feature >= 0 && matches[i].position[2] > 0 &&
            is_searched(static_cast<size_t>(data.landmark_points[i].node[0])))
            pairs.push_back(
                {load3<double>(data.landmarks[i].position), load3<double>(matches[i].position)});
    return pairs;
}

// Three pairs that are far enough apart to fix a motion, and that one may have moved.
bool may_have_moved(const std::array<Pair, 3>& corners) {
    for (size_t k = 0; k < 3; ++k) {
        const Pair &a = corners[k], &b = corners[(k + 1) % 3];
        const double before = std::sqrt(squared(b.rest - a.rest)),
                     after = std::sqrt(squared(b.live - a.live));
        if (before < PieceSearch::kCornersApart ||
            std::abs(after - before) > PieceSearch::kTolerance / 2 + PieceSearch::kStretch * before)
            return false;
    }
    return true;
}

// The most pairs that agree on the rigid motion of three of them (RANSAC; Fischler and Bolles,
// Communications of the ACM 24(6), 1981).
std::vector<Pair> largest_agreement(const std::vector<Pair>& pairs) {
    std::vector<Pair> largest;
    uint32_t random = 1;
    const auto next = [&]() -> const Pair& {
        random = random * 1664525u + 1013904223u;  // Numerical Recipes' generator
        return pairs[(uint64_t{random} * pairs.size()) >> 32];
    };
    int motions = 0;
    for (int attempt = 0; attempt < PieceSearch::kAttempts && motions < PieceSearch::kMotions;
         ++attempt) {
        const std::array<Pair, 3> corners{next(), next(), next()};
        if (!may_have_moved(corners)) continue;
        ++motions;
        std::vector<Pair> agree = agreeing_pairs(pairs, fit_pairs(corners));
        if (agree.size() > largest.size()) largest = std::move(agree);
    }
    return largest;
}

// Fits the control points to the largest agreement.
template <class IsSearched>
bool search(const TemplateData& data, std::span<const defrec_match> matches,
            const IsSearched& is_searched, std::span<defrec_motion> motions) {
    const std::vector<Pair> pairs = pairs_of(data, matches, is_searched);
    if (pairs.size() < PieceSearch::kMinMatches) return false;
    std::vector<Pair> agree = largest_agreement(pairs);
    if (agree.size() >= 3) agree = agreeing_pairs(pairs, fit_pairs(agree));
    if (agree.size() < std::max(static_cast<double>(PieceSearch::kMinMatches),
                                PieceSearch::kMinShare * static_cast<double>(pairs.size())))
        return false;
    for (size_t node = 0; node < motions.size(); ++node)
        if (is_searched(node))
            motions[node] = fit_near(agree, load3<double>(&data.nodes[3 * node])).store();
    return true;
}

}  // namespace

bool search_piece(const TemplateData& data, size_t piece, std::span<const defrec_match> matches,
                  std::span<defrec_motion> motions) {
    return search(
        data, matches, [&](size_t node) { return data.piece_of_node(node) == piece; }, motions);
}

bool search_nodes(const TemplateData& data, std::span<const uint8_t> is_searched,
                  std::span<const defrec_match> matches, std::span<defrec_motion> motions) {
    return search(
        data, matches,
        [&](size_t node) { return node < is_searched.size() && is_searched[node] != 0; }, motions);
}

}  // namespace defrec
