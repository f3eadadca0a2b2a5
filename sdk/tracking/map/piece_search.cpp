// See piece_search.hpp.
#include "sdk/tracking/map/piece_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "backends/shared/motion.hpp"
#include "backends/shared/rigid_fit.hpp"
#include "sdk/tracking/frame/decisions.hpp"

namespace defrec {
namespace {

using Point = Vec3<double>;

using decisions::PieceSearch;

struct Pair {
    Point rest, live;
};

double squared(const Point& v) { return dot(v, v); }

std::vector<Pair> pairs_of(const TemplateData& data, size_t piece,
                           std::span<const defrec_match> matches) {
    std::vector<Pair> pairs;
    for (size_t i = 0; i < matches.size(); ++i)
        if (matches[i].feature >= 0 && matches[i].position[2] > 0 &&
            data.piece_of(data.landmark_points[i]) == piece)
            pairs.push_back(
                {load3<double>(data.landmarks[i].position), load3<double>(matches[i].position)});
    return pairs;
}

std::vector<Pair> agreeing(const std::vector<Pair>& pairs, const DualQuaternion<double>& motion) {
    std::vector<Pair> agree;
    for (const Pair& pair : pairs)
        if (squared(apply(motion, pair.rest) - pair.live) <=
            PieceSearch::kTolerance * PieceSearch::kTolerance)
            agree.push_back(pair);
    return agree;
}

DualQuaternion<double> fit(std::span<const Pair> pairs) {
    RigidFit fit;
    for (const Pair& pair : pairs) fit.add(1, pair.rest, pair.live);
    return normalise(fit.solve());
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
        std::vector<Pair> agree = agreeing(pairs, fit(corners));
        if (agree.size() > largest.size()) largest = std::move(agree);
    }
    return largest;
}

// By the matches round a place, more than by the others.
DualQuaternion<double> fit_at(const std::vector<Pair>& pairs, const Point& place) {
    constexpr double kReach = PieceSearch::kFitReach;
    RigidFit fit;
    for (const Pair& pair : pairs)
        fit.add(PieceSearch::kFitElsewhere +
                    std::exp(-squared(pair.rest - place) / (2 * kReach * kReach)),
                pair.rest, pair.live);
    return normalise(fit.solve());
}

}  // namespace

bool search_piece(const TemplateData& data, size_t piece, std::span<const defrec_match> matches,
                  std::span<defrec_motion> motions) {
    const std::vector<Pair> pairs = pairs_of(data, piece, matches);
    if (pairs.size() < PieceSearch::kMinMatches) return false;
    std::vector<Pair> agree = largest_agreement(pairs);
    if (agree.size() >= 3) agree = agreeing(pairs, fit(agree));
    if (agree.size() < std::max(static_cast<double>(PieceSearch::kMinMatches),
                                PieceSearch::kMinShare * static_cast<double>(pairs.size())))
        return false;
    for (size_t node = 0; node < motions.size(); ++node)
        if (data.piece_of_node(node) == piece)
            motions[node] = fit_at(agree, load3<double>(&data.nodes[3 * node])).store();
    return true;
}

}  // namespace defrec
