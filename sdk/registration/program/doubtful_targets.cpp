// See doubtful_targets.hpp.
#include "sdk/registration/program/doubtful_targets.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>

#include "sdk/io/text.hpp"
#include "sdk/registration/program/decisions.hpp"

namespace defrec::cli {
namespace {

using decisions::DoubtfulTargets;
using Place = std::array<double, 3>;

using Box = Eigen::AlignedBox3d;

bool holds(const Box& box, const Place& place, double margin) {
    const Eigen::Vector3d by = Eigen::Vector3d::Constant(margin);
    return Box(box.min() - by, box.max() + by).contains(Eigen::Vector3d(place.data()));
}

Place moved_by(const std::array<double, 12>& transform, const Place& place) {
    Place made;
    for (std::size_t i = 0; i < 3; ++i) {
        const double* row = &transform[4 * i];
        made[i] = row[0] * place[0] + row[1] * place[1] + row[2] * place[2] + row[3];
    }
    return made;
}

// Where targets are expected: around the model and the landmarks, in the model's frame and in that
// of the camera.
struct Expected {
    Box of_model, of_camera;
    double margin = 0;

    explicit Expected(const GivenTargets& given) {
        const auto add = [&](const Place& place) {
            of_model.extend(Eigen::Vector3d(place.data()));
            of_camera.extend(Eigen::Vector3d(moved_by(given.transform, place).data()));
        };
        const bool has_model = given.model != nullptr && !given.model->triangles.empty();
        if (has_model)
            for (const std::uint32_t vertex : given.model->triangles) {
                const float* at = &given.model->vertices[3 * std::size_t{vertex}];
                add({at[0], at[1], at[2]});
            }
        if (given.pairs != nullptr)
            for (std::size_t i = 0; i + 2 < given.pairs->model_xyz.size(); i += 3) {
                const double* at = &given.pairs->model_xyz[i];
                add({at[0], at[1], at[2]});
            }
        margin = has_model ? DoubtfulTargets::kBesideModel : DoubtfulTargets::kBesidePairs;
    }
};

using Change = std::function<Place(const Place&)>;

std::size_t count_in(std::span<const ModelTarget> targets, const Change& change, const Box& box,
                     double margin) {
    return static_cast<std::size_t>(std::count_if(
        targets.begin(), targets.end(),
        [&](const ModelTarget& target) { return holds(box, change(target.place), margin); }));
}

bool is_most(std::size_t some, std::span<const ModelTarget> all) { return 2 * some > all.size(); }

Change times(double factor) {
    return [factor](const Place& at) {
        return Place{factor * at[0], factor * at[1], factor * at[2]};
    };
}

// The change that puts most targets next to the model itself, among those that put most of them
// where they are expected.
std::string likely_cause(std::span<const ModelTarget> targets, const Expected& expected) {
    struct Candidate {
        Change change;
        const Box* box;
        const char* text;
    };
    const Candidate candidates[] = {
        {times(1000), &expected.of_model,
         "Times 1000 they lie there: they may be in metres; give mm, whatever the model's unit."},
        {times(10), &expected.of_model,
         "Times 10 they lie there: they may be in cm; give mm, whatever the model's unit."},
        {[](const Place& at) {
             return Place{-at[0], -at[1], at[2]};
         },
         &expected.of_model,
         "With x and y negated they lie there: model and targets may be one in LPS and one in "
         "RAS."},
        {times(1), &expected.of_camera,
         "As they are they lie there in the camera's frame: they may be registered already; give "
         "places of the model, or these to `defrec track --targets`."},
        {times(1000), &expected.of_camera,
         "Times 1000 they lie there in the camera's frame: they may be in metres and registered "
         "already; give places of the model, in mm."}};
    std::size_t best = 0;
    std::string cause = "Give mm in the model's frame.";
    for (const Candidate& candidate : candidates) {
        if (!is_most(count_in(targets, candidate.change, *candidate.box, expected.margin), targets))
            continue;
        const double beside = DoubtfulTargets::kNextTo * candidate.box->sizes().maxCoeff();
        const std::size_t near = 1 + count_in(targets, candidate.change, *candidate.box, beside);
        if (near <= best) continue;
        best = near;
        cause = candidate.text;
    }
    return cause;
}

double largest_coordinate(std::span<const ModelTarget> targets) {
    double largest = 0;
    for (const ModelTarget& target : targets)
        for (const double value : target.place) largest = std::max(largest, std::abs(value));
    return largest;
}

}  // namespace

std::string doubtful_targets(const GivenTargets& given) {
    const Expected expected(given);
    if (given.targets.empty() || expected.of_model.isEmpty()) return {};
    const std::string all = std::to_string(given.targets.size());
    const char* what = given.model != nullptr ? "the model" : "the pairs";
    const std::size_t outside = given.targets.size() - count_in(given.targets, times(1),
                                                                expected.of_model, expected.margin);
    if (is_most(outside, given.targets))
        return std::to_string(outside) + " of " + all + " targets lie more than " +
               format_fixed(expected.margin, 0) + " mm beside " + what + ". " +
               likely_cause(given.targets, expected);
    // Targets in metres lie in the model as well where the frame's origin does.
    const double largest = largest_coordinate(given.targets),
                 reach = expected.of_model.sizes().maxCoeff() + expected.margin;
    if (largest == 0 || largest > DoubtfulTargets::kOnePoint * reach ||
        !is_most(count_in(given.targets, times(1000), expected.of_model, expected.margin),
                 given.targets))
        return {};
    return "All " + all + " targets lie within " + format_fixed(largest, 2) +
           " mm of the origin of the model's frame. Times 1000 they lie about " + what +
           ": they may be in metres; give mm, whatever the model's unit.";
}

std::string targets_behind_camera(std::span<const ModelTarget> targets,
                                  std::span<const std::array<double, 3>> places) {
    constexpr std::size_t kMostNamed = 5;
    std::size_t behind = 0;
    std::string names;
    for (std::size_t i = 0; i < targets.size(); ++i) {
        if (places[i][2] > 0) continue;
        if (++behind <= kMostNamed) names += (behind > 1 ? ", " : "") + printable(targets[i].name);
    }
    if (behind == 0) return {};
    return std::to_string(behind) + " of " + std::to_string(targets.size()) +
           " targets lie behind the camera where the registration puts them (" + names +
           (behind > kMostNamed ? ", ..." : "") +
           "): no tissue that is seen is there. See whether they are in mm and in the model's "
           "frame.";
}

}  // namespace defrec::cli
