// See likely_causes.hpp. Whether pairs fit a mirrored model is told by the singular values of their
// cross-covariance: the best turn has the sum of all three, the last one with the sign of the
// determinant, and the best mirrored turn has it with the other sign (Arun, Huang and Blostein,
// PAMI 1987).
#include "sdk/registration/program/likely_causes.hpp"

#include <Eigen/Core>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "sdk/io/text.hpp"
#include "sdk/registration/program/decisions.hpp"

namespace defrec::cli {
namespace {

using decisions::LikelyCauses;
using Places = Eigen::Matrix3Xd;

Places places_of(std::span<const double> xyz) {
    return Eigen::Map<const Places>(xyz.data(), 3, static_cast<Eigen::Index>(xyz.size() / 3));
}

Places places_of(std::span<const float> xyz) {
    return Eigen::Map<const Eigen::Matrix3Xf>(xyz.data(), 3,
                                              static_cast<Eigen::Index>(xyz.size() / 3))
        .cast<double>();
}

// Vertices that a triangle has.
Places places_of(const MeshFile& model) {
    Places made(3, static_cast<Eigen::Index>(model.triangles.size()));
    for (std::size_t i = 0; i < model.triangles.size(); ++i)
        made.col(static_cast<Eigen::Index>(i)) =
            Eigen::Map<const Eigen::Vector3f>(&model.vertices[3 * std::size_t{model.triangles[i]}])
                .cast<double>();
    return made;
}

double longest_side(const Places& places) {
    return (places.rowwise().maxCoeff() - places.rowwise().minCoeff()).maxCoeff();
}

Places centred(const Places& places) { return places.colwise() - places.rowwise().mean(); }

// "1000": which unit lies between two lengths; empty: none.
std::string unit_between(double ratio) {
    for (const double unit : {10.0, 1000.0})
        if (ratio > unit / LikelyCauses::kSameLength && ratio < unit * LikelyCauses::kSameLength)
            return format_fixed(unit, 0);
    return {};
}

std::string sizes_of_pairs(const Places& model, const Places& seen) {
    const double of_model = centred(model).norm(), of_seen = centred(seen).norm();
    const bool is_model_larger = of_model > of_seen;
    const std::string unit =
        unit_between(is_model_larger ? of_model / of_seen : of_seen / of_model);
    if (unit.empty()) return {};
    const std::string smaller = is_model_larger ? "x, y, z" : "model_x, model_y, model_z";
    return "The pairs lie " + unit + " times nearer to each other in " + smaller +
           " than in the other columns: " + smaller + " may be in " + (unit == "10" ? "cm" : "m") +
           "; give mm.";
}

// Squares that are left over by the best turn, and by the best turn of a mirrored model.
std::array<double, 2> squares_left(const Places& model, const Places& seen) {
    const Places a = centred(model), b = centred(seen);
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(a * b.transpose(),
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Eigen::Vector3d& s = svd.singularValues();
    const double sign = svd.matrixU().determinant() * svd.matrixV().determinant();
    const double all = a.squaredNorm() + b.squaredNorm(), last = sign > 0 ? s[2] : -s[2];
    return {std::max(0.0, all - 2 * (s[0] + s[1] + last)),
            std::max(0.0, all - 2 * (s[0] + s[1] - last))};
}

std::string mirrored_pairs(const Places& model, const Places& seen) {
    const auto count = static_cast<double>(model.cols());
    const auto [turned, mirrored] = squares_left(model, seen);
    const double rms = std::sqrt(turned / count), mirrored_rms = std::sqrt(mirrored / count);
    if (rms < LikelyCauses::kLeastOff || mirrored_rms * LikelyCauses::kFarBetter > rms) return {};
    return "The pairs would fit a mirrored model, to " + format_fixed(mirrored_rms, 1) +
           " mm in place of " + format_fixed(rms, 1) +
           ": an axis of one side may be turned round, as where one of x and y was changed between "
           "LPS and RAS.";
}

std::string sizes_of_surfaces(const Places& model, const Places& surface) {
    const double of_model = longest_side(model), of_surface = longest_side(surface);
    const double ratio = of_model / of_surface;
    if (ratio >= LikelyCauses::kLeastShare && ratio <= LikelyCauses::kMostTimes) return {};
    const std::string sizes = "The model's longest side is " + format_fixed(of_model, 1) +
                              " mm, that of the surface " + format_fixed(of_surface, 1) + " mm: ";
    if (ratio < LikelyCauses::kLeastShare)
        return sizes + "the model may be in another unit; see --unit.";
    return sizes + "the surface may be in another unit, mm were expected, or the model (--unit).";
}

// Distance to the nearest vertex, the median over places.
double median_distance(const Places& places, const Places& model) {
    std::vector<double> distances;
    for (Eigen::Index i = 0; i < places.cols() && i < LikelyCauses::kMostPairs; ++i)
        distances.push_back(
            std::sqrt((model.colwise() - places.col(i)).colwise().squaredNorm().minCoeff()));
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    return *middle;
}

// Landmarks may lie inside the model, and beside it.
std::string places_of_pairs(const Places& pairs, const Places& seen, const Places& model) {
    const double given = median_distance(pairs, model), side = longest_side(model);
    if (given < LikelyCauses::kBesideModel * side) return {};
    const std::string head = "Of the pairs, half of the places in the model lie " +
                             format_fixed(given, 0) + " mm or more from it";
    const Places flipped = Eigen::Vector3d(-1, -1, 1).asDiagonal() * pairs;
    if (median_distance(flipped, model) * LikelyCauses::kFarBetter < given)
        return head +
               ", and beside it with x and y negated: model and pairs may be one in LPS and "
               "one in RAS.";
    if (median_distance(seen, model) * LikelyCauses::kFarBetter < given)
        return head + ", and x, y, z beside it: the columns may be exchanged.";
    if (given < LikelyCauses::kFarFromModel * side) return {};
    return head + ": they may be of another frame or unit.";
}

}  // namespace

std::vector<std::string> likely_causes(const GivenPlaces& given) {
    std::vector<std::string> causes;
    const auto add = [&](std::string text) {
        if (!text.empty()) causes.push_back(std::move(text));
    };
    Places of_pairs, seen, model;
    constexpr std::size_t kLeastPairs = 3;  // that fix a rigid motion
    if (given.pairs != nullptr && given.pairs->ids.size() >= kLeastPairs) {
        of_pairs = places_of(given.pairs->model_xyz);
        seen = places_of(given.pairs->seen_xyz);
        add(sizes_of_pairs(of_pairs, seen));
        if (causes.empty()) add(mirrored_pairs(of_pairs, seen));
    }
    if (given.model != nullptr && !given.model->triangles.empty()) model = places_of(*given.model);
    if (model.cols() > 0 && !given.surface.empty())
        add(sizes_of_surfaces(model, places_of(given.surface)));
    if (model.cols() > 0 && of_pairs.cols() > 0 && causes.empty())
        add(places_of_pairs(of_pairs, seen, model));
    return causes;
}

}  // namespace defrec::cli
